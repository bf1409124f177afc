//! Text files as tokens that know their line, and numbers as text that reads back equal.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use crate::Error;

/// A place in the bytes of a text file. Lines end with `\n`, `\r\n` or `\r` and are counted from 1. A token ends at
/// white space and at `#` or `\`, which no number holds: the first opens a comment, the second continues a line.
/// The bytes need not be UTF-8.
#[derive(Clone)]
pub(super) struct Scanner<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        Scanner { path, bytes: bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), at: 0, line: 1 }
    }

    pub fn line(&self) -> usize {
        self.line
    }

    /// What is not read yet.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    pub fn at_end(&self) -> bool {
        self.at == self.bytes.len()
    }

    /// Whether the line holds no further token, once blanks are skipped.
    pub fn at_line_end(&self) -> bool {
        matches!(self.peek(), None | Some(b'\n' | b'\r' | b'#'))
    }

    pub fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    pub fn advance(&mut self, bytes: usize) {
        self.at += bytes;
    }

    /// Skips white space within the line.
    pub fn skip_blanks(&mut self) {
        while self.peek().is_some_and(is_blank) {
            self.at += 1;
        }
    }

    /// Skips white space, line ends and comments.
    pub fn skip_space(&mut self) {
        loop {
            self.skip_blanks();
            match self.peek() {
                Some(b'\n' | b'\r') => self.skip_line_break(),
                Some(b'#') => self.skip_to_line_end(),
                _ => return,
            }
        }
    }

    /// Skips what is left of the line, and its end.
    pub fn skip_line(&mut self) {
        self.skip_to_line_end();
        self.skip_line_break();
    }

    pub fn skip_to_line_end(&mut self) {
        let rest = self.rest();
        let length = rest.iter().position(|&b| matches!(b, b'\n' | b'\r'));
        self.at += length.unwrap_or(rest.len());
    }

    /// Skips one line end if the place is at one.
    pub fn skip_line_break(&mut self) {
        self.at += match self.rest() {
            [b'\r', b'\n', ..] => 2,
            [b'\r' | b'\n', ..] => 1,
            _ => return,
        };
        self.line += 1;
    }

    /// Whether the last line lacks its end, as in a file that was cut off.
    pub fn ends_within_a_line(&self) -> bool {
        !matches!(self.bytes.last(), None | Some(b'\n' | b'\r'))
    }

    /// The token here, possibly empty, without passing it.
    pub fn peek_token(&self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&b| is_separator(b));
        &rest[..length.unwrap_or(rest.len())]
    }

    pub fn token(&mut self) -> &'a [u8] {
        let token = self.peek_token();
        self.at += token.len();
        token
    }

    /// The floating-point number here, correctly rounded; `NaN` and `inf` are numbers. Otherwise `None`, and the
    /// place stays.
    pub fn number(&mut self) -> Option<f64> {
        if let Some((number, length)) = short_decimal(self.rest()) {
            self.at += length;
            return Some(number);
        }
        let token = self.peek_token();
        let number = std::str::from_utf8(token).ok()?.parse().ok()?;
        self.at += token.len();
        Some(number)
    }

    /// The next three numbers, over line ends and comments.
    pub fn point(&mut self) -> Option<DVec3> {
        let mut coordinate = || {
            self.skip_space();
            self.number()
        };
        Some(DVec3::new(coordinate()?, coordinate()?, coordinate()?))
    }

    /// The whole number here, if it fits `T`. Otherwise `None`, and the place stays.
    pub fn unsigned<T: TryFrom<u64>>(&mut self) -> Option<T> {
        let (value, length) = leading_digits(self.rest())?;
        if self.bytes.get(self.at + length).is_some_and(|&b| !is_separator(b)) {
            return None;
        }
        let value = T::try_from(value).ok()?;
        self.at += length;
        Some(value)
    }

    /// An error at this line.
    pub fn error(&self, what: impl Into<String>) -> Error {
        Error::parse(self.path, Some(self.line), what)
    }

    /// The error of finding something else here than `wanted`.
    pub fn unexpected(&self, wanted: impl Display) -> Error {
        if self.at_end() {
            let after_last = self.line > 1 && !self.ends_within_a_line();
            let line = self.line - usize::from(after_last);
            let what = format!("the file ends where {wanted} should be: is it complete?");
            return Error::parse(self.path, Some(line), what);
        }
        if self.at_line_end() {
            return self.error(format!("the line ends where {wanted} should be"));
        }
        let end = |&b: &u8| is_blank(b) || matches!(b, b'\n' | b'\r');
        let word = self.rest().split(end).next().unwrap_or_default();
        self.error(format!("{} is not {wanted}", quoted(word)))
    }
}

/// A decimal without exponent of at most 15 digits and its length, where a separator or the end follows; `None` for
/// all else. Digits and power of ten are exact doubles, so that their quotient is correctly rounded (Clinger 1990).
fn short_decimal(bytes: &[u8]) -> Option<(f64, usize)> {
    const MAX_DIGITS: usize = 15;
    const POWERS: [f64; MAX_DIGITS + 1] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let sign = usize::from(bytes.first() == Some(&b'-'));
    let mut digits = 0u64;
    let mut at = sign;
    let mut point = None;
    loop {
        match bytes.get(at) {
            Some(b @ b'0'..=b'9') => digits = digits.wrapping_mul(10).wrapping_add(u64::from(b - b'0')),
            Some(b'.') if point.is_none() => point = Some(at),
            Some(&b) if !is_separator(b) => return None,
            _ => break,
        }
        at += 1;
        if at > sign + 1 + MAX_DIGITS {
            return None;
        }
    }
    let length = at - sign - usize::from(point.is_some());
    if length == 0 || length > MAX_DIGITS {
        return None;
    }
    let decimals = point.map_or(0, |p| at - p - 1);
    let size = digits as f64 / POWERS[decimals];
    Some((if sign == 1 { -size } else { size }, at))
}

/// The number that the digits at the start of `bytes` form, and how many digits they are. `None` without digits, or
/// if the number does not fit.
pub(super) fn leading_digits(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut value = 0u64;
    let mut length = 0;
    while let Some(digit @ b'0'..=b'9') = bytes.get(length) {
        value = value.checked_mul(10)?.checked_add(u64::from(digit - b'0'))?;
        length += 1;
    }
    (length > 0).then_some((value, length))
}

/// A word of a file, fit for a message of one line.
pub(crate) fn quoted(word: &[u8]) -> String {
    const SHOWN: usize = 32;
    let text = String::from_utf8_lossy(&word[..word.len().min(SHOWN)]);
    let more = if word.len() > SHOWN { "…" } else { "" };
    format!("\"{}{more}\"", text.escape_debug())
}

fn is_blank(b: u8) -> bool {
    matches!(b, b' ' | b'\t' | b'\x0B' | b'\x0C')
}

fn is_separator(b: u8) -> bool {
    is_blank(b) || matches!(b, b'\n' | b'\r' | b'#' | b'\\')
}

/// Appends the shortest decimal that reads back equal, with an exponent where plain digits would be long.
pub(super) fn push_number(text: &mut Vec<u8>, x: f64) -> io::Result<()> {
    let size = x.abs();
    if (size < 1e-5 && size > 0.0) || (1e17..f64::INFINITY).contains(&size) {
        write!(text, "{x:e}")
    } else {
        write!(text, "{x}")
    }
}

/// Appends the three coordinates, separated by spaces.
pub(super) fn push_point(text: &mut Vec<u8>, p: DVec3) -> io::Result<()> {
    push_number(text, p.x)?;
    text.push(b' ');
    push_number(text, p.y)?;
    text.push(b' ');
    push_number(text, p.z)
}

/// Appends a whole number; the formatting machinery would take most of a writer's time.
pub(super) fn push_unsigned(text: &mut Vec<u8>, mut n: u64) {
    let mut digits = [0; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (n % 10) as u8;
        n /= 10;
        if n == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[start..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scanner(text: &str) -> Scanner<'_> {
        Scanner::new(text.as_bytes(), Path::new("t"))
    }

    #[test]
    fn lines_are_counted_over_all_three_line_ends_and_comments() {
        let mut s = scanner("a\nb\r\nc\rd # x\n\n  # y\r\n\te");
        let mut found = Vec::new();
        loop {
            s.skip_space();
            if s.at_end() {
                break;
            }
            let line = s.line();
            found.push((s.token(), line));
        }
        let expected: [(&[u8], usize); 5] = [(b"a", 1), (b"b", 2), (b"c", 3), (b"d", 4), (b"e", 7)];
        assert_eq!(found, expected);
    }

    #[test]
    fn unexpected_things_are_told_apart() {
        let told = |text: &str, skip: usize| {
            let mut s = scanner(text);
            s.skip_line();
            s.advance(skip);
            s.unexpected("a number").to_string()
        };
        let ends = "the file ends where a number should be: is it complete?";
        assert_eq!(told("x\n", 0), format!("t, line 1: {ends}"));
        assert_eq!(told("x\ny", 1), format!("t, line 2: {ends}"));
        assert_eq!(told("x\n# y", 0), "t, line 2: the line ends where a number should be");
        assert_eq!(told("x\ny\u{7}z 3", 0), "t, line 2: \"y\\u{7}z\" is not a number");
        assert_eq!(told("x\n\\", 0), "t, line 2: \"\\\\\" is not a number");
        assert_eq!(quoted(&[0xFF; 40]).chars().count(), 32 + 3);
    }

    #[test]
    fn whole_numbers_end_at_a_separator_and_fit() {
        assert_eq!(scanner("007 8").unsigned::<u64>(), Some(7));
        assert_eq!(scanner("12#").unsigned::<u32>(), Some(12));
        assert_eq!(scanner("18446744073709551615").unsigned(), Some(u64::MAX));
        for text in ["", "-1", "+1", "1.0", "1a", "18446744073709551616"] {
            assert_eq!(scanner(text).unsigned::<u64>(), None, "{text}");
        }
        assert_eq!(scanner("4294967296").unsigned::<u32>(), None);
    }

    #[test]
    fn numbers_are_written_short() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "-0"),
            (1.0, "1"),
            (-0.1, "-0.1"),
            (1e300, "1e300"),
            (5e-324, "5e-324"),
            (12345.678, "12345.678"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            let mut out = Vec::new();
            push_number(&mut out, x).unwrap();
            assert_eq!(String::from_utf8(out).unwrap(), text);
        }
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_the_standard_library(
            text in r"[+-]?[0-9]{0,18}(\.[0-9]{0,18})?([eE][+-]?[0-9]{1,3})?",
            end in r"[ \t\r\n#\\]?",
        ) {
            let expected = text.parse::<f64>().ok();
            let mut s = Scanner::new(text.as_bytes(), Path::new("t"));
            prop_assert_eq!(s.number().map(f64::to_bits), expected.map(f64::to_bits));
            let followed = format!("{text}{end}");
            let mut s = Scanner::new(followed.as_bytes(), Path::new("t"));
            prop_assert_eq!(s.number().map(f64::to_bits), expected.map(f64::to_bits));
            prop_assert_eq!(s.at, if expected.is_some() { text.len() } else { 0 });
        }

        #[test]
        fn short_decimals_are_those_of_the_standard_library(text in r"-?[0-9]{0,8}\.?[0-9]{0,8}") {
            let expected = text.parse::<f64>().ok().map(f64::to_bits);
            let digits = text.bytes().filter(u8::is_ascii_digit).count();
            let found = short_decimal(text.as_bytes());
            prop_assert_eq!(found.is_some(), (1..=15).contains(&digits));
            if let Some((number, length)) = found {
                prop_assert_eq!(Some(number.to_bits()), expected);
                prop_assert_eq!(length, text.len());
            }
        }

        #[test]
        fn every_double_reads_back_with_its_bits(bits: u64) {
            let x = f64::from_bits(bits);
            let mut text = Vec::new();
            push_number(&mut text, x).unwrap();
            prop_assert!(text.len() <= 24);
            let back = Scanner::new(&text, Path::new("t")).number().unwrap();
            prop_assert!(back.to_bits() == bits || (x.is_nan() && back.is_nan()));
        }

        #[test]
        fn every_whole_number_reads_back(n: u64) {
            let mut text = Vec::new();
            push_unsigned(&mut text, n);
            prop_assert_eq!(std::str::from_utf8(&text).unwrap(), n.to_string());
            prop_assert_eq!(Scanner::new(&text, Path::new("t")).unsigned(), Some(n));
        }
    }
}
