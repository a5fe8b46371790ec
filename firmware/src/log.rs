//! Log lines: `defmt` on the chip, nothing on the desk, where no one provides its transport.

/// One line about ordinary operation.
macro_rules! info {
    ($text:literal $(, $value:expr)* $(,)?) => {{
        #[cfg(target_os = "none")]
        defmt::info!($text $(, $value)*);
        #[cfg(not(target_os = "none"))]
        let _ = ($(&$value,)*);
    }};
}

/// One line about something that should not happen.
macro_rules! warning {
    ($text:literal $(, $value:expr)* $(,)?) => {{
        #[cfg(target_os = "none")]
        defmt::warn!($text $(, $value)*);
        #[cfg(not(target_os = "none"))]
        let _ = ($(&$value,)*);
    }};
}

pub(crate) use {info, warning};
