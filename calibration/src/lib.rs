//! From measured drag at known load to the friction law of that guide.
#![forbid(unsafe_code)]

pub mod staircase;
