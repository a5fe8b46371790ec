//! Numbers on the wire: scaled, rounded, saturated, or not available.

/// A u16 that carries no number.
pub(crate) const NO_U16: u16 = 0xFFFF;

/// Largest u16 that is a number; the codes between it and [`NO_U16`] are never sent.
pub(crate) const MAX_U16: u16 = 0xFFFB;

/// An i16 that carries no number.
pub(crate) const NO_I16: i16 = i16::MIN;

/// Nearest whole number within `low..=high`, halves away from zero.
///
/// The limits are whole numbers below 2^24, so the cast only drops the fraction, which the subtraction gives exactly;
/// and the addition cannot overflow, so it needs no check.
fn round(x: f32, low: f32, high: f32) -> i32 {
    // not `clamp`: its check of the limits can format them, which costs the image 15 KiB; x is never NaN here
    let x = x.max(low).min(high);
    let whole = x as i32;
    let fraction = x - whole as f32;
    if fraction >= 0.5 {
        whole.wrapping_add(1)
    } else if fraction <= -0.5 {
        whole.wrapping_sub(1)
    } else {
        whole
    }
}

/// `value·per_unit` as u16; `None` and non-finite values are [`NO_U16`].
pub(crate) fn to_u16(value: Option<f32>, per_unit: f32) -> u16 {
    match value {
        Some(v) if v.is_finite() => u16::try_from(round(v * per_unit, 0.0, f32::from(MAX_U16))).unwrap_or(NO_U16),
        _ => NO_U16,
    }
}

/// `value·per_unit` as i16; `None` and non-finite values are [`NO_I16`].
pub(crate) fn to_i16(value: Option<f32>, per_unit: f32) -> i16 {
    let limit = f32::from(i16::MAX);
    match value {
        Some(v) if v.is_finite() => i16::try_from(round(v * per_unit, -limit, limit)).unwrap_or(NO_I16),
        _ => NO_I16,
    }
}

/// The number of a u16, nearest f32; `None` when not available.
///
/// # Errors
/// The code, when it is one of those never sent.
pub(crate) fn from_u16(code: u16, per_unit: f32) -> Result<Option<f32>, u16> {
    match code {
        NO_U16 => Ok(None),
        ..=MAX_U16 => Ok(Some(f32::from(code) / per_unit)),
        _ => Err(code),
    }
}

/// The number of an i16, nearest f32; `None` when not available.
pub(crate) fn from_i16(code: i16, per_unit: f32) -> Option<f32> {
    (code != NO_I16).then(|| f32::from(code) / per_unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_way_there_and_back() {
        for per_unit in [1.0, 100.0, 1000.0, 10_000.0, 1e6] {
            for code in 0..=u16::MAX {
                match from_u16(code, per_unit) {
                    Ok(value) => assert_eq!(to_u16(value, per_unit), code),
                    Err(refused) => assert!(refused == code && (0xFFFC..=0xFFFE).contains(&code)),
                }
            }
            for code in i16::MIN..=i16::MAX {
                assert_eq!(to_i16(from_i16(code, per_unit), per_unit), code);
            }
        }
        assert_eq!(from_u16(NO_U16, 1.0), Ok(None));
        assert_eq!(from_i16(NO_I16, 1.0), None);
    }

    #[test]
    fn rounds_to_the_nearest_halves_away_from_zero() {
        // for the number just below 0.5, adding 0.5 and cutting would give 1
        for (value, code) in
            [(0.0, 0), (0.499_999_97, 0), (0.5, 1), (1.5, 2), (2.5, 3), (2.499_999_8, 2), (1234.4, 1234)]
        {
            assert_eq!(to_i16(Some(value), 1.0), code);
            assert_eq!(to_i16(Some(-value), 1.0), -code);
            assert_eq!(to_u16(Some(value), 1.0), code.unsigned_abs());
        }
        assert_eq!(to_i16(Some(-7.654), 100.0), -765);
    }

    #[test]
    fn saturates_below_the_codes_without_number() {
        for value in [65531.0, 65531.4, 65531.5, 65535.0, 1e30, f32::MAX] {
            assert_eq!(to_u16(Some(value), 1.0), 0xFFFB);
        }
        assert_eq!(to_u16(Some(f32::MAX), 100.0), 0xFFFB);
        for value in [-0.6, -1.0, -1e30, f32::MIN] {
            assert_eq!(to_u16(Some(value), 1.0), 0);
        }
        for value in [32767.0, 32767.5, 32768.0, 1e30, f32::MAX] {
            assert_eq!(to_i16(Some(value), 1.0), 32767);
            assert_eq!(to_i16(Some(-value), 1.0), -32767);
        }
    }

    #[test]
    fn what_is_no_number_is_not_available() {
        for value in [None, Some(f32::NAN), Some(f32::INFINITY), Some(f32::NEG_INFINITY)] {
            assert_eq!(to_u16(value, 1.0), 0xFFFF);
            assert_eq!(to_i16(value, 1.0), -32768);
        }
    }
}
