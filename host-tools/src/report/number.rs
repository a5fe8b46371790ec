//! Numbers as a person reads them.

/// A number with `digits` significant digits: a plain decimal where that is short, otherwise with an exponent.
pub fn significant(x: f64, digits: u8) -> String {
    let (size, behind) = (x.abs(), usize::from(digits.max(1)) - 1);
    if size == 0.0 || !size.is_finite() {
        return format!("{x:.behind$}");
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{x:.behind$e}");
    }
    let exponent = libm::floor(libm::log10(size)) as i32;
    let places = usize::try_from(i32::from(digits.max(1)) - 1 - exponent).unwrap_or(0);
    format!("{x:.places$}")
}

/// The same without trailing zeros.
pub fn short(x: f64, digits: u8) -> String {
    let text = significant(x, digits);
    let (number, exponent) = text.split_once('e').map_or((text.as_str(), None), |(n, e)| (n, Some(e)));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    exponent.map_or_else(|| number.to_owned(), |exponent| format!("{number}e{exponent}"))
}

/// A unit with a space before it; nothing for what has none, which the schema writes as `1`.
pub fn with_space(unit: &str) -> String {
    if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_where_it_is_short_and_never_all_zeros() {
        for (x, long, brief) in [
            (1.5036, "1.504", "1.504"),
            (1.67e-5, "1.670e-5", "1.67e-5"),
            (-1.0, "-1.000", "-1"),
            (0.0, "0.000", "0"),
            (0.002, "0.002000", "0.002"),
            (91_234.0, "91234", "91234"),
            (-2.5e7, "-2.500e7", "-2.5e7"),
            (100.0, "100.0", "100"),
        ] {
            assert_eq!((significant(x, 4).as_str(), short(x, 4).as_str()), (long, brief));
        }
        assert_eq!(significant(f64::NAN, 4), "NaN");
        assert_eq!((with_space("1"), with_space("m")), (String::new(), " m".to_owned()));
    }
}
