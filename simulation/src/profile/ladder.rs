//! A staircase at every preload of a list, one segment each (P2).

use model_core::exact::Exact;
use model_core::quantity;

use super::paper_grid::LATERAL_N;
use super::path::Path;
use super::{Conditions, Course, Order, Staircase, Unfit};

/// A load ladder.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    /// Preloads, N, 0 to 1e6.
    pub preloads_n: Vec<f64>,
    /// The staircase at each preload; order [`Order::Both`] counts as [`Order::Up`].
    pub staircase: Staircase,
}

impl Ladder {
    /// The paper's grid for a guide: the preloads that its ten lateral forces cause, with its twenty speeds at each.
    ///
    /// # Errors
    /// [`Unfit::NoLoad`]: the geometry of this guide does not carry one of the forces.
    pub fn of_paper(guide: &Exact) -> Result<Self, Unfit> {
        let preload = |lateral_n: &f64| {
            let load = guide.load_of_lateral_force(*lateral_n).ok_or(Unfit::NoLoad { lateral_n: *lateral_n })?;
            Ok(guide.preload_n(load))
        };
        let preloads_n = LATERAL_N.iter().map(preload).collect::<Result<_, _>>()?;
        Ok(Ladder { preloads_n, staircase: Staircase { order: Order::Up, ..Staircase::default() } })
    }

    /// Samples the profile at a rate; segments count from 1 in the order of the preloads.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        let (least, most) = quantity::range("preload_n").map_or((0.0, 0.0), |row| (row.min, row.max));
        Unfit::check_all("preloads", &self.preloads_n, least, most, "N")?;
        let order = if self.staircase.order == Order::Down { Order::Down } else { Order::Up };
        let staircase = Staircase { order, ..self.staircase.clone() };
        let mut path = Path::new(staircase.acceleration_m_s2)?;
        for preload in &self.preloads_n {
            staircase.drive(path.preload(*preload))?;
        }
        path.sample("ladder", rate_hz, conditions)
    }
}

#[cfg(test)]
mod tests {
    use model_core::reference::zhou_2023::{FRICTION, GUIDE};

    use super::*;

    #[test]
    fn the_paper_s_grid_has_ten_segments_of_one_preload_each() {
        let ladder = Ladder::of_paper(&Exact::new(GUIDE, FRICTION)).expect("its own guide");
        let run = ladder.course(20.0, &Conditions::default()).expect("sound").run;
        let preload = run.preload_n.as_ref().expect("set");
        assert_eq!(run.parts.len(), 10);
        for (part, expected) in run.parts.iter().zip(&ladder.preloads_n) {
            assert!(preload[part.rows.clone()].iter().all(|p| p == expected));
        }
        // 500 and 9500 N of lateral force, rounded as in PRELOAD_RANGE_N
        assert!((485.0..500.0).contains(&preload[0]) && (7900.0..8300.0).contains(&preload[run.len() - 1]));
    }
}
