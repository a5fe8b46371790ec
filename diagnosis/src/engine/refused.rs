//! Why runs allow no judgement.

/// Why runs allow no judgement, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The files are sound, but too few rows of such a motion can be compared: another run may do.
    Motion(String),
    /// Nothing of a file can be used: a channel is stuck or in another unit, or the law lacks an input that neither the
    /// recording nor the simulation states.
    File(String),
}

impl Refused {
    /// The reason in words.
    pub fn reason(&self) -> &str {
        match self {
            Refused::Motion(reason) | Refused::File(reason) => reason,
        }
    }
}

/// What keeps a law from being evaluated is an input that the files lack.
impl From<String> for Refused {
    fn from(reason: String) -> Self {
        Refused::File(reason)
    }
}
