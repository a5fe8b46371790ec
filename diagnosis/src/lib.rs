//! Locates what a simulation leaves out, names it, models it, and shows the fit improve on rows it has not seen.
//!
//! ```text
//! engine       the order of everything
//! side         runs with what follows from their motion; resolution: the time over which they are compared
//! edges        how late the force follows starts and stops
//! sanity       what is wrong with the recording; rows that cannot be compared; condense: averages of a fast one
//! speed        a recorded speed that is worse than that of the position
//! events       spots that no form of the library has a place for; pulses: what finds them; bursts: what brakes for tenths
//!              of a second
//! play         a coupling with a gap, told before what is beside it
//! nominal      the law as a function of what the simulation only assumes
//! calibration  how far its numbers may move
//! linear       algebra of small symmetric matrices; statistics: numbers that stand for many
//! noise        what makes the noise white; bridge: a line where rows are missing; rows: the one linear operation on every
//!              column
//! source       where a column comes from
//! bench        the mismatch and all that may explain it, whitened; every fit is algebra on inner products
//! locks        is an effect real? two tests that must agree
//! ringing      a structure that rings, taken for noise; spectra: what stands out at every speed
//! pool         all that may act; refine: its shapes; spectrum: wavelengths; peaks: the highest of them
//! case         what a search is about
//! search       which named causes act; leavings: what their forms may leave; story: curves without a name; open_set: what
//!              has no name here
//! clock        what repeats in time; adequacy: is what explains much what acts? load_law: does it feel the load as it must?
//! passes       the search, and again around where it has led; settle: the law beside what was found; rest: what is left
//! found        what they have led to; law_alone: the law's own numbers off, and nothing beside them; refit: with numbers that
//!              the simulation left out; saturation: what no curve follows
//! equivalents  what this recording cannot tell apart; considered: what else was thought of; experiment: the next run that would, by simulation
//! proof        rows set aside; scores: the three stages there, and what each cause does
//! balance      who has which share of the mismatch; shown: what shows without a fit; answer: what is said; finding, region
//! export       the simulation file that knows what was found
//! report       the public schema
//! ```
//!
//! No file is opened, nothing is printed, nothing is drawn at random but the bootstrap, and that from a seed.
#![forbid(unsafe_code)]
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "what is not a number must fall on the side of refusal")]
#![allow(clippy::needless_range_loop, reason = "indices of matrices read as the equations do")]

mod adequacy;
mod answer;
mod aside;
mod balance;
mod bench;
mod bridge;
mod bursts;
mod calibration;
mod case;
mod clock;
mod condense;
mod considered;
mod edges;
mod engine;
mod equivalents;
mod events;
mod experiment;
mod export;
mod finding;
mod found;
mod law_alone;
mod leavings;
mod linear;
mod load_law;
mod locks;
mod noise;
mod nominal;
mod open_set;
mod passes;
mod peaks;
mod play;
mod pool;
mod proof;
mod pulses;
mod refine;
mod refit;
mod region;
pub mod report;
mod resolution;
mod rest;
mod ringing;
mod rows;
mod sanity;
mod saturation;
mod scores;
mod search;
mod settle;
mod shown;
mod side;
mod source;
mod spectra;
mod spectrum;
mod speed;
mod statistics;
mod story;

pub use engine::{Options, Outcome, diagnose};
