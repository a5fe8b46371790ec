//! Judgement of a run: estimates against the truth, and the bus against the replay.

use can_wire::{Kind, RawFrame};
use model_core::sample::Reason;
use serde::{Serialize, Serializer};

use crate::decode::Reading;

/// A reading with the truth beside it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Time from the first row of the run, s.
    pub time_s: f64,
    /// Preload, N, when the block gave one.
    pub preload_n: Option<f32>,
    /// Its standard deviation, N.
    pub sigma_n: Option<f32>,
    /// Preload the rig measured at that time, N.
    pub truth_n: Option<f64>,
    /// Why the block gave none.
    #[serde(serialize_with = "by_name")]
    pub reason: Option<Reason>,
    /// Drag force, N, positive against the motion.
    pub drag_force_n: Option<f32>,
    /// Carriage speed, m/s, signed.
    pub speed_m_s: Option<f32>,
    /// Temperature of the block, °C.
    pub temperature_degc: Option<f32>,
}

fn by_name<S: Serializer>(reason: &Option<Reason>, serializer: S) -> Result<S::Ok, S::Error> {
    reason.map(Reason::name).serialize(serializer)
}

impl Point {
    /// A reading at a time of the run.
    pub fn new(time_s: f64, reading: &Reading, truth_n: Option<f64>) -> Self {
        Point {
            time_s,
            preload_n: reading.estimate.preload_n,
            sigma_n: reading.estimate.sigma_n,
            truth_n,
            reason: reading.estimate.quality,
            drag_force_n: reading.estimate.drag_force_n,
            speed_m_s: reading.motion.and_then(|m| m.speed_m_s),
            temperature_degc: reading.motion.and_then(|m| m.temperature_degc),
        }
    }
}

/// Accuracy of the estimates against the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// Readings in all.
    pub readings: usize,
    /// Readings with a preload and a truth to hold it against.
    pub judged: usize,
    /// Those of them whose truth lies within two standard deviations.
    pub covered: usize,
    /// Largest difference to the truth over the truth, signed.
    pub largest_error: f64,
    /// Root mean square of that difference.
    pub rms_error: f64,
    /// Mean of two standard deviations over the truth.
    pub mean_band: f64,
}

/// Holds the estimates against the truth. A truth that is not positive judges nothing.
pub fn accuracy(points: &[Point]) -> Accuracy {
    let mut all = Accuracy { readings: points.len(), ..Accuracy::default() };
    let (mut square, mut band) = (0.0, 0.0);
    for point in points {
        let (Some(preload), Some(sigma), Some(truth)) = (point.preload_n, point.sigma_n, point.truth_n) else {
            continue;
        };
        if truth <= 0.0 {
            continue;
        }
        let error = f64::from(preload) - truth;
        let width = 2.0 * f64::from(sigma);
        all.judged += 1;
        all.covered += usize::from(error.abs() <= width);
        if error.abs() / truth > all.largest_error.abs() {
            all.largest_error = error / truth;
        }
        square += (error / truth) * (error / truth);
        band += width / truth;
    }
    if all.judged > 0 {
        all.rms_error = (square / all.judged as f64).sqrt();
        all.mean_band = band / all.judged as f64;
    }
    all
}

/// How long the block was silent, and for which first reason.
///
/// Returns the reasons that occurred with the number of readings, most frequent first.
pub fn silence(points: &[Point]) -> Vec<(Reason, usize)> {
    let mut counts: Vec<_> = Reason::ALL
        .into_iter()
        .map(|reason| (reason, points.iter().filter(|p| p.reason == Some(reason)).count()))
        .filter(|(_, count)| *count > 0)
        .collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    counts
}

/// Whether the bus carried what the replay says it should have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// Every estimate and motion frame is the same, bit for bit.
    Identical {
        /// So many frames were compared.
        frames: usize,
    },
    /// The first frame that is not.
    Different {
        /// Its number among the estimate and motion frames, from 0.
        at: usize,
        /// What the bus carried; `None` after its last frame.
        bus: Option<RawFrame>,
        /// What the replay gave; `None` after its last frame.
        replay: Option<RawFrame>,
    },
}

/// Frames the board may still have had in its mailboxes when the run ended.
const UNDER_WAY: usize = 2;

/// Compares estimate and motion frames in their order. The last two frames of the replay may be missing at
/// the end of the bus, none in between; no frame at all is no agreement.
pub fn compare(bus: impl Iterator<Item = RawFrame>, replay: impl Iterator<Item = RawFrame>) -> Agreement {
    let cyclic = |frame: &RawFrame| matches!(Kind::of(frame.id), Ok((Kind::Estimate | Kind::Motion, _)));
    let bus: Vec<_> = bus.filter(cyclic).collect();
    let replay: Vec<_> = replay.filter(cyclic).collect();
    let same = bus.iter().zip(&replay).take_while(|(a, b)| a == b).count();
    if same == bus.len() && same > 0 && replay.len() - same <= UNDER_WAY {
        return Agreement::Identical { frames: same };
    }
    Agreement::Different { at: same, bus: bus.get(same).copied(), replay: replay.get(same).copied() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(preload_n: f32, sigma_n: f32, truth_n: f64) -> Point {
        Point {
            time_s: 0.0,
            preload_n: Some(preload_n),
            sigma_n: Some(sigma_n),
            truth_n: Some(truth_n),
            reason: None,
            drag_force_n: None,
            speed_m_s: None,
            temperature_degc: None,
        }
    }

    #[test]
    fn counts_what_lies_in_the_band() {
        let silent =
            Point { preload_n: None, sigma_n: None, reason: Some(Reason::NoMotion), ..point(0.0, 0.0, 1000.0) };
        let unknown = Point { truth_n: None, ..point(1000.0, 10.0, 0.0) };
        let points = [point(1020.0, 10.0, 1000.0), point(979.0, 10.0, 1000.0), silent, silent, unknown];
        let got = accuracy(&points);
        assert_eq!((got.readings, got.judged, got.covered), (5, 2, 1));
        assert!((got.largest_error + 0.021).abs() < 1e-12);
        assert!((got.rms_error - 0.0205).abs() < 1e-4);
        assert!((got.mean_band - 0.02).abs() < 1e-12);
        assert_eq!(silence(&points), [(Reason::NoMotion, 2)]);
        assert_eq!(accuracy(&[]), Accuracy::default());
    }

    #[test]
    fn one_bit_or_one_frame_is_a_difference() {
        let frame = |id, n| RawFrame { id, data: [n; 8] };
        let replay: Vec<_> = (0..10).flat_map(|n| [frame(0x181, n), frame(0x281, n)]).collect();
        let judge = |bus: Vec<RawFrame>| compare(bus.into_iter(), replay.iter().copied());
        let mut bus = replay.clone();
        bus.insert(3, frame(0x701, 0));
        assert_eq!(judge(bus.clone()), Agreement::Identical { frames: 20 });
        bus.truncate(19);
        assert_eq!(judge(bus.clone()), Agreement::Identical { frames: 18 });
        bus.truncate(18);
        assert!(matches!(judge(bus.clone()), Agreement::Different { at: 17, bus: None, .. }));
        let mut bus = replay.clone();
        bus[7].data[3] ^= 1;
        assert!(matches!(judge(bus), Agreement::Different { at: 7, .. }));
        let mut bus = replay.clone();
        bus.remove(0);
        assert!(matches!(judge(bus), Agreement::Different { at: 0, .. }));
        let mut bus = replay.clone();
        bus.push(frame(0x181, 11));
        assert!(matches!(judge(bus), Agreement::Different { at: 20, replay: None, .. }));
        assert!(matches!(compare(std::iter::empty(), std::iter::empty()), Agreement::Different { at: 0, .. }));
    }
}
