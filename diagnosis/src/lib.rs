//! Locates what a simulation leaves out, names it, models it, and shows the fit improve on rows it has not seen.
//!
//! ```text
//! engine        the order of all steps
//!
//! answer        shares of the mismatch, findings, and the score on held-out rows
//! experiment    the next run that would separate what this one cannot, by simulation
//! search        which causes act, unnamed effects, and what this recording cannot tell apart
//! beside        searches without a fit
//! calibration   how far the law's own parameters may move, and where they settle
//! fit           what may explain a mismatch, and how much of it
//! recording     runs, prepared for comparison with a simulation
//! noise         whitening, and whether an effect is real: two tests that must agree
//!
//! nominal       the law as a function of what the simulation only assumes
//! numbers       algebra and statistics
//! report        the public schema
//! ```
//!
//! Each module uses those below it and none above.
//!
//! Terms that all of them use:
//!
//! ```text
//! mismatch      recording less simulation; residual: what a fit leaves of it
//! cause         a mechanism of the library, a shift (parameter of the law that is off) or an unnamed curve
//! form          an equation of a mechanism, linear in its amplitudes, with a few shape parameters
//! column        force of one amplitude of 1, row by row; whitened: behind the noise filter
//! tangent       columns of the law's own parameters: derivatives of its force
//! member        a cause that the search has taken up; rival: one that does as well in its place
//! nats          evidence: gain in log likelihood; score: the same less the cost of the parameters
//! locks         two tests of an effect that must agree
//! leavings      what the form of a true cause may leave of its force
//! opened trial  a sealed trial (docs/trials) after its answers were read: thresholds are read off these
//! ```
//!
//! No file is opened, nothing is printed, and nothing is random but the bootstrap, which is seeded.
#![forbid(unsafe_code)]
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "what is not a number must fall on the side of refusal")]
#![allow(clippy::needless_range_loop, reason = "indices of matrices read as the equations do")]

mod answer;
mod beside;
mod calibration;
mod engine;
mod experiment;
mod fit;
mod noise;
mod nominal;
mod numbers;
mod recording;
pub mod report;
mod search;

pub use engine::{Options, Outcome, Refused, diagnose};
