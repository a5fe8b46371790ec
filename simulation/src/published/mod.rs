//! Published parameter sets: one file per paper, every value with its provenance.
//!
//! A set is a list of values under the keys of a simulation file, so that a file can override any of them, and so that
//! a table can state for each whether the paper gives it or it had to be assumed.

mod zhou_2023;

use std::fmt;

/// Provenance of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// Stated in the paper; where.
    Stated(&'static str),
    /// Not stated anywhere; why this value was chosen.
    Assumed(&'static str),
    /// Set by the simulation file.
    File,
}

impl fmt::Display for Provenance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Provenance::Stated(place) => write!(f, "stated by the paper, {place}"),
            Provenance::Assumed(why) => write!(f, "ASSUMED: {why}"),
            Provenance::File => f.write_str("set by the file"),
        }
    }
}

/// A value of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number in the unit that the key ends with.
    Number(f64),
    /// One of a few names.
    Name(&'static str),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(x) if *x != 0.0 && !(1e-4..1e6).contains(&x.abs()) => write!(f, "{x:e}"),
            Value::Number(x) => write!(f, "{x}"),
            Value::Name(name) => f.write_str(name),
        }
    }
}

/// A value and its provenance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Section of the file: `guide` or `lubricant`.
    pub section: &'static str,
    /// Key, with the unit.
    pub key: &'static str,
    /// Value.
    pub value: Value,
    /// Provenance.
    pub provenance: Provenance,
}

/// A published set.
#[derive(Clone, Copy, Debug)]
pub struct Published {
    /// Its name in `[guide] parameters`.
    pub name: &'static str,
    /// The publication.
    pub source: &'static str,
    entries: fn() -> Vec<Entry>,
}

impl Published {
    /// Every value, in the order of the file format.
    pub fn entries(&self) -> Vec<Entry> {
        (self.entries)()
    }
}

/// All sets; the first is the default of a file without `parameters`.
pub const SETS: [Published; 1] = [zhou_2023::SET];

/// The set of this name.
pub fn named(name: &str) -> Option<&'static Published> {
    const ALL: &[Published] = &SETS;
    ALL.iter().find(|set| set.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_gives_the_same_keys_once_under_its_name() {
        let keys = |set: &Published| set.entries().iter().map(|e| (e.section, e.key)).collect::<Vec<_>>();
        for set in &SETS {
            assert_eq!(named(set.name).map(|found| found.source), Some(set.source));
            assert_eq!(keys(set), keys(&SETS[0]));
            let mut unique = keys(set);
            unique.sort_unstable();
            unique.dedup();
            assert_eq!(unique.len(), keys(set).len());
            assert!(set.entries().iter().all(|e| e.provenance != Provenance::File));
        }
        assert!(named("zhou-2024").is_none());
    }
}
