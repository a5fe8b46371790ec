//! Findings without a fit: from a channel, its spectrum, or the residual of a search.

use simulation::mechanism::{Added, Id};

use crate::answer::aside::Aside;
use crate::answer::balance::Balance;
use crate::answer::finding::{
    comes_and_goes, contamination, encoder, quantisation, resonance, saturation, speed_noise,
};
use crate::answer::play::Play;
use crate::beside::events::Spots;
use crate::beside::ringing::Heard;
use crate::beside::speed::SetAside;
use crate::fit::member::Member;
use crate::fit::source::added;
use crate::noise::locks::least_of;
use crate::recording::side::Side;
use crate::report::{Finding, Region};
use crate::search::found::Found;

/// Findings without a fit, each with its share of the squared mismatch, 0 to 1.
pub(crate) struct Shown<'a> {
    /// Quantisation step of the force channel, N.
    rounding: Option<(f64, f64)>,
    /// Force at which the channel saturates, N.
    clipped: Option<(f64, f64)>,
    speed: Option<(SetAside, f64)>,
    heard: Option<(&'a Heard, f64)>,
    play: Option<(&'a Play, f64)>,
    spots: Option<(&'a Spots, f64)>,
    /// A residual that comes and goes.
    unsteady: Option<f64>,
    /// p-values of what was searched for.
    p: Vec<f64>,
}

impl<'a> Shown<'a> {
    pub(crate) fn of(side: &Side<'_>, found: &Found<'_>, aside: &Aside<'a>, balance: &Balance) -> Self {
        let Aside { spots, speed, heard, play } = *aside;
        let p = [spots.map(|spots| spots.p), heard.map(|heard| heard.p), play.map(|play| play.p)];
        let spots = spots.zip(balance.spots);
        Shown {
            rounding: found.coarse_step_n.zip(balance.rounding),
            clipped: side.limit_n.zip(balance.clipped),
            speed: speed.zip(balance.speed),
            heard: heard.zip(balance.heard),
            play: play.zip(balance.play),
            unsteady: balance.unsteady.filter(|_| spots.is_none()),
            spots,
            p: p.into_iter().flatten().chain([balance.p_steady]).collect(),
        }
    }

    /// p-value of all of it being chance, including that of a search. What a channel shows directly is certain.
    pub(crate) fn p_beside(&self, searched: f64) -> f64 {
        if self.rounding.is_some() || self.clipped.is_some() || self.speed.is_some() {
            return 0.0;
        }
        least_of(self.p.iter().copied().chain([searched]))
    }

    /// The findings beside the fitted ones. A resonance fitted from excitation by reversals is the same as the one heard
    /// in the spectrum, and is replaced by the better description; an encoder errs in place and speed alike.
    /// `fitted` are in the order of the `members`.
    pub(crate) fn findings(
        &self,
        fitted: &mut [(Finding, Option<Region>)],
        members: &[Member],
    ) -> Vec<(Finding, Option<Region>)> {
        let mut findings: Vec<(Finding, Option<Region>)> = Vec::new();
        let mut say = |finding: Option<Finding>| findings.extend(finding.map(|finding| (finding, None)));
        say(self.spots.map(|(spots, share)| contamination(spots, share)));
        say(self.unsteady.map(comes_and_goes));
        say(self.rounding.map(|(step_n, share)| quantisation(step_n, share)));
        say(self.clipped.map(|(limit_n, share)| saturation(limit_n, share)));
        let at = |id: Id| members.iter().position(|member| member.candidate.source.is(id));
        match (self.heard, at(Id::StructuralResonance).map(|at| &mut fitted[at].0)) {
            // heard although its fit from reversals is too damped to ring: rolling excites it harder
            (Some((heard, share)), Some(fitted)) => *fitted = resonance(heard, share + fitted.share_of_mismatch),
            (Some((heard, share)), None) => say(Some(resonance(heard, share))),
            (None, _) => {}
        }
        if let Some((speed, share)) = self.speed {
            match (speed.wave_m, at(Id::EncoderCyclicError).map(|at| &mut fitted[at].0)) {
                (Some(_), Some(fitted)) => fitted.share_of_mismatch += share,
                (Some(wave_m), None) => say(Some(encoder(wave_m, share))),
                (None, _) => say(Some(speed_noise(speed.variance_m2_s2, share))),
            }
        }
        findings.extend(self.play.map(|(play, share)| play.reported(share)));
        findings
    }

    /// Entries of a simulation file.
    pub(crate) fn added(&self, noise_n: f64, moved_mass_kg: f64) -> Vec<Added> {
        let one = |id, form, shape, amplitudes| Some(Added { id, form, shape, amplitudes });
        let speed = self.speed.and_then(|_| one(Id::SpeedNoise, 1, Vec::new(), vec![1.0, moved_mass_kg]));
        let struck = self.heard.and_then(|(heard, _)| heard.struck.as_ref());
        let struck = struck.and_then(|(source, amplitudes)| added(source, amplitudes));
        let play = self.play.and_then(|(play, _)| play.added());
        let rounding = self.rounding.and_then(|(step_n, _)| {
            one(Id::ForceQuantisation, 0, vec![(noise_n / step_n).clamp(0.02, 0.5)], vec![1.0])
        });
        let clipped = self.clipped.and_then(|(limit_n, _)| one(Id::ForceSaturation, 0, vec![limit_n], vec![1.0]));
        [speed, struck, play, rounding, clipped].into_iter().flatten().collect()
    }
}
