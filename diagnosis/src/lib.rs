//! Locates what a simulation leaves out, names it, models it and shows the fit improve.
#![forbid(unsafe_code)]
