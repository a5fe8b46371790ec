//! A diagnosis for people: the mismatch before and after over every axis, and a page that shows it.

mod axes;
mod page;

pub use axes::{AxisView, Bin, views};
pub use page::{of_no_interest, page};
