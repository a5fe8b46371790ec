//! Batch inversion with the widest vector registers of this machine.

use model_core::reduced::Reduced;
use pulp::{Simd, WithSimd};

/// [`Reduced::preloads`], built for several instruction sets; the best available one is used. No operation is
/// contracted (no fused multiply-add), so the result has the same bits everywhere.
pub fn preloads(law: &Reduced<f32>, forces_n: &[f32], viscous_speeds: &[f32], preloads_n: &mut [f32]) {
    pulp::Arch::new().dispatch(Batch { law, forces_n, viscous_speeds, preloads_n });
}

struct Batch<'a> {
    law: &'a Reduced<f32>,
    forces_n: &'a [f32],
    viscous_speeds: &'a [f32],
    preloads_n: &'a mut [f32],
}

impl WithSimd for Batch<'_> {
    type Output = ();

    /// Inlined into a function that is built for the instruction set; the compiler does the rest.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.law.preloads(self.forces_n, self.viscous_speeds, self.preloads_n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED};

    #[test]
    fn the_machine_s_registers_do_not_show_in_the_result() {
        for guide in [GUIDE, GUIDE_CARRIAGE_SPEED] {
            let law = Reduced::of(&guide, &FRICTION, 600.0).to_f32();
            let forces: Vec<f32> = (0..10_007).map(|n| 0.01 * n as f32).collect();
            let viscous: Vec<f32> = (0..10_007).map(|n| 0.03 + 1e-3 * (n % 997) as f32).collect();
            let (mut narrow, mut wide) = (vec![0.0; forces.len()], vec![0.0; forces.len()]);
            law.preloads(&forces, &viscous, &mut narrow);
            preloads(&law, &forces, &viscous, &mut wide);
            assert!(narrow.iter().zip(&wide).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert!(wide.iter().filter(|p| p.is_finite()).count() > 5_000);
        }
    }
}
