//! Published parameter sets, one file each, named by first author and year.

pub mod zhou_2023;
