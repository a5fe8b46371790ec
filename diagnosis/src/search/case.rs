//! The case of a search: what is given, the recording, and the rows that may be searched.

use simulation::Simulation;
use simulation::file::PositionReference;

use crate::calibration::saturation::Saturation;
use crate::calibration::settle::Valley;
use crate::calibration::{prior, room};
use crate::fit::bench::Bench;
use crate::fit::edges::Edges;
use crate::fit::member::Candidate;
use crate::fit::rest::noise_rms;
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::numbers::rounding::is_coarse;
use crate::recording::side::Side;

/// What no search changes: the simulation, and what the channels tell on their own.
#[derive(Clone, Copy)]
pub(crate) struct Given<'s> {
    pub(crate) simulation: &'s Simulation,
    pub(crate) nominal: &'s Nominal,
    /// Resonances that the spectrum points to; `None` where the speed is too noisy: the acceleration derived
    /// from it would seem to ring at any frequency.
    pub(crate) ringing: Option<&'s [Source]>,
    /// Mean square force of a structure that the spectrum shows to ring at every speed, N²; 0 where none does.
    pub(crate) heard_n2: f64,
    /// Mean square effect on the force of a recorded speed's noise, N², where that speed was discarded; 0 elsewhere.
    pub(crate) discarded_n2: f64,
    /// What starts and stops tell of the delay between motion and force.
    pub(crate) edges: Option<Edges>,
    /// Quantisation step of the force channel, N.
    pub(crate) step_n: Option<f64>,
}

/// See the module.
#[derive(Clone, Copy)]
pub(crate) struct Case<'s> {
    pub(crate) given: Given<'s>,
    pub(crate) side: &'s Side<'s>,
    /// Rows that may be searched; one entry per row of all runs.
    pub(crate) training: &'s [bool],
    pub(crate) saturation: &'s Saturation,
    /// Travel since the last reversal of the force from which on rows are compared, m; before it, play of the coupling
    /// hides the force.
    pub(crate) seen_from_m: f64,
}

impl<'s> Case<'s> {
    /// The bench for the mismatch around the law at the given parameter values.
    pub(crate) fn around(&self, rows: &Rows, values: &[f64]) -> Result<Bench<'s>, String> {
        let Case { given: Given { simulation, nominal, edges, .. }, side, training, .. } = *self;
        let mismatch = side.residual(nominal, values)?;
        let tangent = side.tangent(nominal, values)?;
        let mut bench =
            Bench::new(rows.clone(), &side.contexts, training.to_vec(), &mismatch, tangent, prior(nominal, values))
                .within(room(nominal, values));
        bench.is_relative = simulation.axis.position_reference == PositionReference::Relative;
        bench.seen_from_m = self.seen_from_m;
        bench.edges = edges;
        let square = |force: &[f64]| rows.white(force).iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>();
        bench.largest = square(&side.drag_n) + square(&mismatch);
        Ok(bench)
    }

    /// RMS of what neither the law at the given values nor any curve beside it follows, N.
    pub(crate) fn noise_n(&self, rows: &Rows, values: &[f64]) -> Result<f64, String> {
        let Case { given: Given { nominal, .. }, side, saturation, .. } = *self;
        let (mismatch, tangent) = (side.residual(nominal, values)?, side.tangent(nominal, values)?);
        let left = saturation.rest(rows, &side.contexts, &mismatch, &tangent, &[]);
        Ok(noise_rms(rows, &left, &mismatch))
    }

    /// The valley of the law's parameters beside the given causes: where the law settles.
    pub(crate) fn valley<'a>(&self, rows: &'a Rows, causes: impl IntoIterator<Item = &'a Candidate>) -> Valley<'a>
    where
        's: 'a,
    {
        let causes = causes.into_iter().collect();
        Valley { nominal: self.given.nominal, side: self.side, rows, training: self.training, causes }
    }

    /// Quantisation step of the force channel, N, where it is a considerable part of the noise of the compared rows.
    pub(crate) fn coarse_step_n(&self, rows: &Rows, noise_n: f64) -> Option<f64> {
        self.given.step_n.filter(|step| is_coarse(*step, rows.decimation(), noise_n))
    }
}
