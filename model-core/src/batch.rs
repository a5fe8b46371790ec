//! Batch inversion for the desk: the block's own kernel without its branches, so that the compiler can vectorise it.

use crate::contact::HerseySpeed;
use crate::reduced::{GROUP_LIMIT, Reduced};

impl Reduced<f32> {
    /// Preloads of many drag forces, bit for bit those of [`DragLaw::preload`](crate::reduced::DragLaw::preload).
    ///
    /// `forces_n`: drag without seals, N; `viscous_speeds`: ν·abs(V), cSt·m/s. Writes as many preloads, N, as the
    /// shortest of the three slices has room for; NaN where `preload` gives
    /// [`OutOfDomain`](crate::reduced::OutOfDomain).
    #[inline(always)]
    pub fn preloads(&self, forces_n: &[f32], viscous_speeds: &[f32], preloads_n: &mut [f32]) {
        // one loop per convention: the choice is made once, not per element
        match self.hersey_speed {
            HerseySpeed::Slip => self.run(HerseySpeed::Slip, forces_n, viscous_speeds, preloads_n),
            HerseySpeed::Carriage => self.run(HerseySpeed::Carriage, forces_n, viscous_speeds, preloads_n),
        }
    }

    #[inline(always)]
    fn run(&self, speed: HerseySpeed, forces_n: &[f32], viscous_speeds: &[f32], preloads_n: &mut [f32]) {
        for ((force, viscous_speed), preload) in forces_n.iter().zip(viscous_speeds).zip(preloads_n) {
            *preload = self.preload_or_nan(speed, *force, *viscous_speed);
        }
    }

    #[inline(always)]
    fn preload_or_nan(&self, speed: HerseySpeed, force_n: f32, viscous_speed: f32) -> f32 {
        let fc = force_n * self.loads_per_force;
        let root = self.root(speed, fc, self.film_per_viscous_speed * viscous_speed);
        let square = root.s * root.s;
        let q = square * root.s;
        let preload = self.preload_per_load * q / (1.0 + self.angle_per_load * square);
        // comparisons with NaN are false, so that a NaN anywhere is refused here
        let is_covered = (force_n > 1e-6)
            & (force_n < f32::INFINITY)
            & (0.0..f32::INFINITY).contains(&viscous_speed)
            & (root.x <= GROUP_LIMIT as f32)
            & (q <= self.load_limit_n);
        if is_covered { preload } else { f32::NAN }
    }
}

#[cfg(test)]
mod tests {
    use crate::reduced::{DragLaw, Reduced};
    use crate::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED};
    extern crate std;
    use std::vec::Vec;

    #[test]
    fn gives_the_bits_of_one_by_one_and_refuses_the_same() {
        for guide in [GUIDE, GUIDE_CARRIAGE_SPEED] {
            let law = Reduced::of(&guide, &FRICTION, 600.0).to_f32();
            let odd = [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE, 1e-6, 1e3, 1e30];
            let forces: Vec<f32> = (1..500).map(|n| 0.01 * n as f32 * n as f32).chain(odd).collect();
            for viscous_speed in [0.0, 1e-4, 0.3, 10.0, 40.0, 1e5, -1.0, f32::NAN, f32::INFINITY] {
                let mut got = std::vec![0.0; forces.len()];
                law.preloads(&forces, &std::vec![viscous_speed; forces.len()], &mut got);
                for (force, got) in forces.iter().zip(got) {
                    let want = law.preload(*force, viscous_speed).unwrap_or(f32::NAN);
                    assert!(
                        want.to_bits() == got.to_bits() || (want.is_nan() && got.is_nan()),
                        "{force} {viscous_speed}"
                    );
                }
            }
        }
    }
}
