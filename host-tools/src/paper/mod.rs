//! What the paper states, held against its own equations.
//!
//! ZHOU, WANG, FENG, OU, ZHOU: J. Mech. Eng. (CN) 2023, DOI 10.3901/JME.2023.03.208. The physics is that of
//! `model-core`; here is only what the comparison needs besides:
//!
//! - [`printed`]: Eq. 4, 14 and 21 to the letter
//! - [`convention`]: the eight ways to read the Hersey number, and how each fares on the measured grid
//! - [`one_curve`]: what one curve μ(H) allows a lubrication map to do, whatever the units
//! - [`conditioning`]: how errors of force, viscosity and speed become errors of the preload
//! - [`oh`]: the rival drag model, Eq. 22
//! - [`hertz`]: closed-form approximations of the contact against the exact integrals
//! - [`slip_series`]: the best short series of the sliding speed, a yardstick for the block's own
//! - [`claims`]: the lines stated, computed, difference, verdict
//! - [`grid`]: what the text says of the measured grid, under every reading
//! - [`report`]: those lines as text, JSON and a page

pub mod claims;
pub mod conditioning;
pub mod convention;
pub mod grid;
pub mod hertz;
pub mod oh;
pub mod one_curve;
pub mod printed;
pub mod report;
pub mod slip_series;
