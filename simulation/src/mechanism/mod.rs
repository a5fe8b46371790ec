//! The physics, and the faults of sensors, that a simulation may leave out: what each adds to the force.
//!
//! ```text
//! id          the names of the public contract
//! definition  how a mechanism is described: parametric forms, where it shows, what refutes it
//! context     all that a mechanism may depend on, row by row of one run
//! library     every mechanism, in the order of the contract
//! added       a mechanism with its numbers: an entry [[mechanism]] of an augmented simulation file
//! ```
//!
//! All others are families of forms. A form is linear in its amplitudes: `force = Σ amplitude_k · column_k(shape)`.
//! What changes the preload acts through `∂F/∂ln(preload)`, what changes the oil through `∂F/∂ln(viscosity)`, so that
//! one amplitude means the same at every speed and load.

mod added;
mod column;
mod context;
mod definition;
mod id;
mod library;

mod direction;
mod dynamics;
mod load;
mod oil;
mod presliding;
mod rail;
mod ripple;
mod seals;
mod sensor_dynamics;
mod sensor_level;
mod temperature;
mod travel;

pub use added::Added;
pub use context::{Context, Geometry};
pub use definition::{Amplitude, Columns, Definition, Form, Kind, ShapeParameter, Sign};
pub use id::Id;
pub use library::{definition, library};

#[cfg(test)]
mod tests;
