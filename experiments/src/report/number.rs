//! Numbers as text: stable in CSV, readable in Markdown.

/// Significant digits of a number in CSV: enough for any comparison that a report makes, few enough
/// that the last bits of a sum do not show.
const CSV_DIGITS: usize = 10;

/// Numbers of at least this size are written as `1.235e6` in Markdown.
const LARGEST_PLAIN_EXPONENT: i32 = 5;

/// Numbers below 1e-3 are written as `8.138e-4` in Markdown.
const SMALLEST_PLAIN_EXPONENT: i32 = -3;

/// `value` with 10 significant digits and no trailing zeros.
pub(super) fn csv_number(value: f64) -> String {
    let rounded: f64 = match format!("{value:.*e}", CSV_DIGITS - 1).parse() {
        Ok(rounded) => rounded,
        Err(_) => value,
    };
    if rounded == 0.0 {
        "0".to_owned() // without the sign of -0
    } else if !rounded.is_finite() || (1e-4..1e15).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// `value` with so many significant digits, for reading: `0.1667`, `8.138e-4`, `1.235e6`.
pub fn readable(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "NaN".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    let scientific = format!("{value:.*e}", digits - 1);
    // The exponent after rounding: 0.99996 is 1.000.
    let exponent = scientific.rsplit('e').next().and_then(|e| e.parse().ok());
    match exponent {
        Some(e @ SMALLEST_PLAIN_EXPONENT..=LARGEST_PLAIN_EXPONENT) => {
            let decimals = (digits as i32 - 1 - e).max(0) as usize;
            format!("{value:.decimals$}")
        }
        _ => scientific,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_numbers_hide_the_last_bits() {
        for (value, text) in [
            (0.1 + 0.2, "0.3"),
            (-0.0, "0"),
            (57.0, "57"),
            (8.0 / 9.0, "0.8888888889"),
            (1.0 / 6.0 * 1e-7, "1.666666667e-8"),
            (1.5e300, "1.5e300"),
            (-123456.0, "-123456"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(csv_number(value), text);
        }
    }

    #[test]
    fn markdown_numbers_are_readable() {
        for (value, digits, text) in [
            (8.13812e-4, 4, "8.138e-4"),
            (1.0 / 6.0, 4, "0.1667"),
            (0.99996, 4, "1.000"),
            (9.9996e-4, 4, "0.001000"),
            (1.0, 3, "1.00"),
            (123456.7, 4, "123457"),
            (999_999.9, 4, "1.000e6"),
            (-2.5e-10, 2, "-2.5e-10"),
            (0.0, 4, "0"),
            (f64::INFINITY, 4, "∞"),
        ] {
            assert_eq!(readable(value, digits), text);
        }
    }
}
