//! A diagnosis for people: the mismatch before and after over every axis, and a page that shows it.

mod axes;
mod page;

use diagnosis::report::Finding;

pub use axes::{AxisView, Bin, views};
pub use page::{of_no_interest, page, probability};

/// How much of a cause is there on the rows that were set aside, and whether that bears it out.
pub fn carried_over(finding: &Finding) -> String {
    let Some(there) = &finding.on_holdout else { return "they tell nothing of it".to_owned() };
    let [share, low, high] = [there.share, there.ci95[0], there.ci95[1]].map(|x| 100.0 * x);
    let size = format!("{share:.0} % of its size ({low:.0} to {high:.0} %)");
    match finding.carried_over {
        Some(true) => size,
        Some(false) => format!("{size}: it does not carry over"),
        None => format!("{size}: too uncertain to tell"),
    }
}
