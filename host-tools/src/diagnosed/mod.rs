//! A diagnosis for people: the mismatch before and after over every axis, and a page that shows it.

mod axes;
mod page;

use diagnosis::report::Finding;

use crate::report::number::significant;

pub use axes::{AxisView, Bin, views};
pub use page::{of_no_interest, page};

/// Whether a cause carried over to the rows that were set aside, and how much of it.
pub fn carried_over(finding: &Finding) -> String {
    let Some(there) = &finding.on_holdout else { return "those rows tell nothing of it".to_owned() };
    let [share, low, high] = [there.share, there.ci95[0], there.ci95[1]].map(|x| significant(x, 2));
    match finding.carried_over {
        Some(true) => format!("yes, {share} of it is there ({low} to {high})"),
        Some(false) => format!("no, {share} of it is there ({low} to {high})"),
        None => format!("not to be told ({low} to {high} of it is there)"),
    }
}
