//! Locates what a simulation leaves out, names it, models it, and shows the fit improve on rows it has not seen.
//!
//! ```text
//! engine        the order of everything
//!
//! answer        who has which share of the mismatch, what is said of it, and the proof on rows that were set aside
//! experiment    the next run that would tell apart what this one cannot, by simulation
//! search        which causes act, what has no name here, and what this recording cannot tell apart
//! beside        what shows without a fit
//! calibration   how far the law's own numbers may move, and where they come to rest
//! fit           what may explain a mismatch, and how much it does
//! recording     runs, made ready to be held against a simulation
//! noise         what makes the noise white, and whether an effect is real: two tests that must agree
//!
//! nominal       the law as a function of what the simulation only assumes
//! numbers       algebra and statistics
//! report        the public schema
//! ```
//!
//! Each uses what stands below it and nothing above.
//!
//! No file is opened, nothing is printed, nothing is drawn at random but the bootstrap, and that from a seed.
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

pub use engine::{Options, Outcome, diagnose};
