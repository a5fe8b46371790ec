//! A long run, a stop, running again, while block and rail warm up and cool down (P8).
//!
//! ```text
//! dT/dt = (T_ambient + ΔT - T)/τ       ΔT: rise while running, 0 at rest; τ and ΔT differ between block and rail
//! ```

use super::limits::{DURATION, LENGTH, SPEED};
use super::path::Path;
use super::{Conditions, Course, Unfit};

/// Thermal response of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warming {
    /// Final temperature above the surroundings, K, -100 to 150.
    pub rise_k: f64,
    /// Time constant, s, 1 to 1e7.
    pub time_s: f64,
}

/// A warm-up.
#[derive(Clone, Debug, PartialEq)]
pub struct WarmUp {
    /// Speed, m/s, 1e-6 to 20.
    pub speed_m_s: f64,
    /// Stroke, ramps included, m, 1e-6 to 500.
    pub length_m: f64,
    /// Running time, s, 0 to 1e7; whole strokes forth and back.
    pub run_s: f64,
    /// Stopped time, s, 0 to 1e7.
    pub stop_s: f64,
    /// Second running time, s, 0 to 1e7.
    pub resume_s: f64,
    /// Temperature of the surroundings and initial temperature, °C, -60 to 200.
    pub ambient_degc: f64,
    /// The block.
    pub block: Warming,
    /// The rail.
    pub rail: Warming,
    /// Acceleration of the ramps, m/s², 1e-3 to 500.
    pub acceleration_m_s2: f64,
}

impl Default for WarmUp {
    /// 2 h at 6 m/min over half a metre, 1 h stop, 10 min again; from 22 °C the block warms by 10 K in 15 min, the rail
    /// by 4 K in 45 min.
    fn default() -> Self {
        WarmUp {
            speed_m_s: 0.1,
            length_m: 0.5,
            run_s: 7200.0,
            stop_s: 3600.0,
            resume_s: 600.0,
            ambient_degc: 22.0,
            block: Warming { rise_k: 10.0, time_s: 900.0 },
            rail: Warming { rise_k: 4.0, time_s: 2700.0 },
            acceleration_m_s2: 0.5,
        }
    }
}

impl WarmUp {
    /// Samples the profile at a rate, all in one segment, with the temperatures of block, rail and surroundings.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, a stroke too short for the speed, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check("speeds", self.speed_m_s, SPEED.0, SPEED.1, "m/s")?;
        Unfit::check("length", self.length_m, LENGTH.0, LENGTH.1, "m")?;
        Unfit::check("ambient", self.ambient_degc, -60.0, 200.0, "°C")?;
        for (what, duration) in [("run", self.run_s), ("stop", self.stop_s), ("resume", self.resume_s)] {
            Unfit::check(what, duration, DURATION.0, DURATION.1, "s")?;
        }
        for (rise, time, body) in [("block-rise", "block-time", self.block), ("rail-rise", "rail-time", self.rail)] {
            Unfit::check(rise, body.rise_k, -100.0, 150.0, "K")?;
            Unfit::check(time, body.time_s, 1.0, 1e7, "s")?;
        }
        let mut path = Path::new(self.acceleration_m_s2)?;
        path.segment();
        self.strokes(&mut path, self.run_s)?;
        let stop_s = path.end_s();
        path.rest(self.stop_s);
        let resume_s = path.end_s();
        self.strokes(&mut path, self.resume_s)?;
        let mut course = path.sample("warm-up", rate_hz, conditions)?;
        let run = &mut course.run;
        let column = |body: Warming| -> Vec<f64> {
            run.time_s.iter().map(|t| self.ambient_degc + body.above_k(*t, stop_s, resume_s)).collect()
        };
        run.temperature_block_degc = Some(column(self.block));
        run.temperature_rail_degc = Some(column(self.rail));
        run.temperature_ambient_degc = Some(vec![self.ambient_degc; run.len()]);
        Ok(course)
    }

    /// Strokes forth and back until the time is over.
    fn strokes(&self, path: &mut Path, duration_s: f64) -> Result<(), Unfit> {
        // guards against strokes of no duration, which would never end
        let stroke_s = self.length_m / self.speed_m_s + path.ramp_s(self.speed_m_s);
        if duration_s / stroke_s > super::MOST_ROWS {
            return Err(Unfit::TooLong { duration_s, rate_hz: 1.0 / stroke_s });
        }
        let end_s = path.end_s() + duration_s;
        while path.end_s() < end_s {
            path.go_to(self.length_m, self.speed_m_s)?.go_to(0.0, self.speed_m_s)?;
        }
        Ok(())
    }
}

impl Warming {
    /// Temperature above the surroundings, K, of a body that runs until `stop_s` and from `resume_s` on.
    fn above_k(self, t: f64, stop_s: f64, resume_s: f64) -> f64 {
        let decay = |from: f64, to: f64| libm::exp(-(to - from) / self.time_s);
        let running = self.rise_k * (1.0 - decay(0.0, t.min(stop_s)));
        if t <= stop_s {
            return running;
        }
        let resting = running * decay(stop_s, t.min(resume_s));
        if t <= resume_s {
            return resting;
        }
        self.rise_k + (resting - self.rise_k) * decay(resume_s, t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_warm_as_their_equation_says() {
        let warm_up = WarmUp { run_s: 1000.0, stop_s: 500.0, resume_s: 200.0, ..WarmUp::default() };
        let Course { run, motion } = warm_up.course(10.0, &Conditions::default()).expect("sound");
        let runs = |n: usize| {
            // at rest only while stopped: strokes follow each other without a pause
            (n.saturating_sub(3)..(n + 4).min(run.len())).any(|k| motion.velocity_m_s[k] != 0.0)
        };
        for (column, body) in [(&run.temperature_block_degc, warm_up.block), (&run.temperature_rail_degc, warm_up.rail)]
        {
            let column = column.as_ref().expect("set");
            let mut t = 22.0;
            for (n, got) in column.iter().enumerate().skip(1) {
                let target = 22.0 + if runs(n) { body.rise_k } else { 0.0 };
                t += (target - t) * (1.0 - (-0.1 / body.time_s).exp());
                assert!((got - t).abs() < 0.02, "{n}: {got} {t}");
            }
        }
        assert_eq!(run.temperature_ambient_degc.as_ref().map(|c| c[7]), Some(22.0));
    }
}
