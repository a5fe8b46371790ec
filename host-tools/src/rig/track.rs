//! A run of an axis as a function of time: straight lines between its rows.

use std::ops::Range;

use simulation::run::Run;

/// What the world does at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    /// Position along the rail, m.
    pub position_m: f64,
    /// Force the drive applies to the carriage, N, positive towards larger positions.
    pub drag_force_n: f64,
    /// Temperature of the block, °C.
    pub temperature_degc: Option<f64>,
    /// True preload, N.
    pub preload_n: Option<f64>,
}

/// One gap-free part of a run, time from its first row.
#[derive(Clone, Debug)]
pub struct Track {
    rows: Vec<(f64, World)>,
}

impl Track {
    /// Takes rows of a run, all of one part. Where the recording has no position, velocity is integrated.
    ///
    /// `None` when there are no rows.
    pub fn new(run: &Run, rows: Range<usize>) -> Option<Self> {
        let start_s = *run.time_s.get(rows.start)?;
        let at = |column: &Option<Vec<f64>>, row: usize| column.as_ref().map(|column| column[row]);
        let measured = |column, row| at(column, row).filter(|value| !value.is_nan());
        let mut world = Vec::with_capacity(rows.len());
        let (mut position_m, mut before) = (0.0, (0.0, 0.0));
        for row in rows {
            let time_s = run.time_s[row] - start_s;
            let velocity = at(&run.velocity_m_s, row).unwrap_or(0.0);
            position_m =
                at(&run.position_m, row).unwrap_or(position_m + 0.5 * (velocity + before.1) * (time_s - before.0));
            before = (time_s, velocity);
            let now = World {
                position_m,
                drag_force_n: run.drag_force_n[row],
                temperature_degc: measured(&run.temperature_block_degc, row),
                preload_n: measured(&run.preload_n, row),
            };
            world.push((time_s, now));
        }
        (!world.is_empty()).then_some(Track { rows: world })
    }

    /// Length, s.
    pub fn duration_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |(time, _)| *time)
    }

    /// The world at a time; before the first and after the last row it stands still.
    ///
    /// A quantity that was not measured in one of the two neighbouring rows is unknown between them.
    pub fn at(&self, time_s: f64) -> World {
        let next = self.rows.partition_point(|(time, _)| *time <= time_s);
        let (Some((from_s, from)), Some((to_s, to))) = (self.rows.get(next.wrapping_sub(1)), self.rows.get(next))
        else {
            // `Track::new` leaves at least one row
            return if next == 0 { self.rows[0].1 } else { self.rows[next - 1].1 };
        };
        let share = (time_s - from_s) / (to_s - from_s);
        let between = |a: f64, b: f64| a + share * (b - a);
        let known = |a: Option<f64>, b: Option<f64>| Some(between(a?, b?));
        World {
            position_m: between(from.position_m, to.position_m),
            drag_force_n: between(from.drag_force_n, to.drag_force_n),
            temperature_degc: known(from.temperature_degc, to.temperature_degc),
            preload_n: known(from.preload_n, to.preload_n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(time_s: &[f64], position_m: Option<&[f64]>, velocity_m_s: Option<&[f64]>) -> Run {
        let of = |f: fn(f64) -> f64| time_s.iter().copied().map(f).collect();
        Run {
            time_s: time_s.to_vec(),
            position_m: position_m.map(<[_]>::to_vec),
            velocity_m_s: velocity_m_s.map(<[_]>::to_vec),
            drag_force_n: of(|t| 10.0 * t),
            preload_n: Some(of(|t| 3000.0 - t)),
            temperature_block_degc: Some(of(|t| if t < 12.5 { 20.0 } else { f64::NAN })),
            ..Run::default()
        }
    }

    #[test]
    fn is_straight_between_rows_and_still_outside() {
        let track = Track::new(&run(&[0.0, 11.0, 12.0, 13.0], Some(&[9.0, 1.0, 3.0, 2.0]), None), 1..4).expect("rows");
        assert_eq!(track.duration_s(), 2.0);
        for (time, position) in [(-1.0, 1.0), (0.0, 1.0), (0.25, 1.5), (1.0, 3.0), (1.5, 2.5), (2.0, 2.0), (9.0, 2.0)] {
            assert_eq!(track.at(time).position_m, position, "{time}");
        }
        assert_eq!(track.at(0.5).drag_force_n, 115.0);
        assert_eq!(track.at(0.5).preload_n, Some(2988.5));
        assert_eq!(track.at(0.5).temperature_degc, Some(20.0));
        assert_eq!(track.at(1.5).temperature_degc, None);
        assert!(Track::new(&Run::default(), 0..0).is_none());
    }

    #[test]
    fn sums_velocity_where_there_is_no_position() {
        let track = Track::new(&run(&[0.0, 1.0, 2.0], None, Some(&[0.0, 1.0, 1.0])), 0..3).expect("rows");
        assert_eq!(track.at(2.0).position_m, 1.5);
    }
}
