//! Text files as tokens that know their line, and numbers as text that reads back equal.

use std::fmt::Display;
use std::path::Path;

use glam::DVec3;

use crate::{Error, Result};

pub(crate) mod parts;

/// A place in the bytes of a text file. Lines end with `\n`, `\r\n` or `\r`, in a file whose first line does so with
/// `\n\r`, and are counted from 1. A token ends at white space and at a `\` that ends its line, which continues it;
/// `#`, or
/// another character that is chosen, opens a comment where a token would start, and else belongs to the token
/// (`1.#INF`). Zero bytes and DOS's sign
/// for the end of a file are no text at its end. The bytes need not be UTF-8.
///
/// Tables have a row a line where their first row has: then no row takes a value from the next line, or leaves one.
#[derive(Clone)]
pub(crate) struct Scanner<'a> {
    path: &'a Path,
    /// The length of a byte order mark.
    start: usize,
    bytes: &'a [u8],
    at: usize,
    line: usize,
    feed_before_return: bool,
    comment: u8,
    rows: Rows,
    /// The line on which the present row starts.
    row_line: usize,
    /// The line that a table's first row shares with more.
    shared_line: Option<usize>,
}

#[derive(Clone, Copy)]
enum Rows {
    None,
    /// The first row of a table, or of one after another table.
    First {
        of_first_table: bool,
    },
    OneALine,
    Free,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        Self::of_head(&bytes[..text_length(bytes)], path)
    }

    /// Over the first bytes of a file.
    pub fn of_head(bytes: &'a [u8], path: &'a Path) -> Self {
        let start = if bytes.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
        let bytes = &bytes[start..];
        let first_end = bytes.iter().position(|&b| is_line_end(b)).map_or(&[][..], |at| &bytes[at..]);
        // `\n\r\n` is an empty line among lines of mixed ends, unless another `\r` follows.
        let feed_before_return = match first_end {
            [b'\n', b'\r', b'\n', next, ..] => *next == b'\r',
            [b'\n', b'\r', b'\n'] => false,
            [b'\n', b'\r', ..] => true,
            _ => false,
        };
        Scanner {
            path,
            start,
            bytes,
            at: 0,
            line: 1,
            feed_before_return,
            comment: b'#',
            rows: Rows::None,
            row_line: 0,
            shared_line: None,
        }
    }

    /// With another character that opens comments.
    pub fn with_comment(self, comment: u8) -> Self {
        Scanner { comment, ..self }
    }

    pub fn line(&self) -> usize {
        self.line
    }

    /// The place in the bytes that were given.
    pub fn offset(&self) -> usize {
        self.start + self.at
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
        self.peek().is_none_or(|b| is_line_end(b) || b == self.comment)
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
                Some(b) if b == self.comment => self.skip_to_line_end(),
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
        self.at += memchr::memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
    }

    /// Skips one line end if the place is at one.
    pub fn skip_line_break(&mut self) {
        self.at += match self.rest() {
            [b'\n', b'\r', ..] if self.feed_before_return => 2,
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

    /// The token here without passing it; empty only before white space and at the end.
    pub fn peek_token(&self) -> &'a [u8] {
        let rest = self.rest();
        let mut length = 0;
        loop {
            let next = rest[length..].iter().position(|&b| is_separator(b));
            length = next.map_or(rest.len(), |n| length + n);
            match rest[length..] {
                [b'\\', ..] if length == 0 || !continues_line(&rest[length..]) => length += 1,
                _ => return &rest[..length],
            }
        }
    }

    pub fn token(&mut self) -> &'a [u8] {
        let token = self.peek_token();
        self.at += token.len();
        token
    }

    /// The floating-point number here, correctly rounded; `NaN` and `inf` are numbers. Otherwise `None`, and the
    /// place stays.
    pub fn number(&mut self) -> Option<f64> {
        if let Some((number, length)) = decimal(self.rest(), is_separator) {
            self.at += length;
            return Some(number);
        }
        let token = self.peek_token();
        let number = std::str::from_utf8(token).ok()?.parse().ok()?;
        self.at += token.len();
        Some(number)
    }

    /// The floating-point number here among marks: it ends at white space, a comma, a bracket, a `;` or a `#` too.
    /// Otherwise `None`, and the place stays.
    pub fn number_in_list(&mut self) -> Option<f64> {
        let rest = self.rest();
        if let Some((number, length)) = decimal(rest, ends_word_in_list) {
            self.at += length;
            return Some(number);
        }
        let word = &rest[..word_in_list(rest)];
        let number = std::str::from_utf8(word).ok()?.parse().ok()?;
        self.at += word.len();
        Some(number)
    }

    /// The whole number here among marks, if it fits 32 bits. Otherwise `None`, and the place stays.
    pub fn unsigned_in_list(&mut self) -> Option<u32> {
        let rest = self.rest();
        let (value, length) = leading_digits(rest)?;
        if rest.get(length).is_some_and(|&b| !ends_word_in_list(b)) {
            return None;
        }
        let value = u32::try_from(value).ok()?;
        self.at += length;
        Some(value)
    }

    /// Begins a table of rows.
    pub fn begin_rows(&mut self) {
        self.rows = Rows::First { of_first_table: matches!(self.rows, Rows::None) };
    }

    /// Goes to the start of the next row and gives its line.
    pub fn begin_row(&mut self) -> usize {
        self.skip_space();
        self.row_line = self.line;
        self.line
    }

    /// Goes to the next value of the row; it may stand on another line only where rows do not have one each.
    pub fn next_in_row(&mut self) {
        match self.rows {
            Rows::OneALine => self.skip_blanks(),
            _ => self.skip_space(),
        }
    }

    /// Ends `row`, all of whose values have been read.
    ///
    /// # Errors
    /// Values left on the line of a row where each row has its own, and a first row that ends within another line.
    pub fn end_row(&mut self, row: impl Display) -> Result<()> {
        self.skip_blanks();
        let ends = self.at_line_end();
        let stays = self.line == self.row_line;
        match (self.rows, ends) {
            (Rows::OneALine, false) => {
                let word = quoted(self.word());
                return Err(self.error(format!(
                    "{word} is one value too many for {row}: correct the line, or what the header announces"
                )));
            }
            (Rows::First { .. }, false) if !stays => {
                return Err(self.error_at(
                    self.row_line,
                    format!("{row} has fewer values on its line than the header announces: correct one of them"),
                ));
            }
            (Rows::First { .. }, _) => {
                self.rows = if ends && stays { Rows::OneALine } else { Rows::Free };
                if !ends {
                    self.shared_line = Some(self.line);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The next three numbers of the row.
    pub fn point(&mut self) -> Option<DVec3> {
        let mut coordinate = || {
            self.next_in_row();
            self.number()
        };
        Some(DVec3::new(coordinate()?, coordinate()?, coordinate()?))
    }

    /// The three numbers after `keyword` bytes, and the length of all, if each is a decimal and they have spaces and the end
    /// of a line around them. The place stays.
    pub fn plain_point(&self, keyword: usize) -> Option<(DVec3, usize)> {
        let rest = self.rest();
        let mut at = keyword;
        let mut point = DVec3::ZERO;
        for axis in 0..3 {
            at += spaces(&rest[at..]);
            let (number, length) = decimal(&rest[at..], |b| b == b' ' || is_line_end(b))?;
            point[axis] = number;
            at += length;
        }
        at += spaces(&rest[at..]);
        rest.get(at).is_some_and(|&b| is_line_end(b)).then_some((point, at))
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
        self.error_at(self.line, what)
    }

    /// An error at `line`, with a doubt about the header where the rows give reason to one.
    pub fn error_at(&self, line: usize, what: impl Into<String>) -> Error {
        let mut what = what.into();
        if let Some(shared) = self.shared_line {
            what += &format!(
                " (line {shared} goes on after the first row: does the header announce all that a row holds, such as \
                 colours?)"
            );
        } else if let Rows::First { of_first_table: false } = self.rows {
            what += " (if the line belongs to the rows before, correct the counts in the header)";
        }
        Error::parse(self.path, Some(line), what)
    }

    /// The error of finding something else here than `wanted`.
    pub fn unexpected(&self, wanted: impl Display) -> Error {
        if self.at_end() {
            let after_last = self.line > 1 && !self.ends_within_a_line();
            let line = self.line - usize::from(after_last);
            return self.error_at(line, format!("the file ends where {wanted} should be: is it complete?"));
        }
        if self.at_line_end() {
            return self.error(format!("the line ends where {wanted} should be"));
        }
        let word = self.word();
        let hint = hint(word).map_or_else(String::new, |hint| format!(": {hint}"));
        self.error(format!("{} is not {wanted}{hint}", quoted(word)))
    }

    /// What stands here up to white space.
    fn word(&self) -> &'a [u8] {
        let end = |&b: &u8| is_blank(b) || is_line_end(b);
        self.rest().split(end).next().unwrap_or_default()
    }
}

/// Where the text in `bytes` ends, before the zeros and the Ctrl-Z that disks and DOS leave behind it.
fn text_length(bytes: &[u8]) -> usize {
    let is_padding = |b: u8| matches!(b, b'\0' | b'\x1A');
    let last = bytes.iter().rposition(|&b| !is_padding(b) && !is_blank(b) && !is_line_end(b));
    let Some(last) = last else { return bytes.len() };
    let padding = bytes[last..].iter().position(|&b| is_padding(b));
    padding.map_or(bytes.len(), |p| last + p)
}

/// What a word that is no number may have been meant as, and what to do.
fn hint(word: &[u8]) -> Option<&'static str> {
    let has = |part: &[u8]| word.windows(part.len()).any(|w| w.eq_ignore_ascii_case(part));
    let has_digit = word.iter().any(u8::is_ascii_digit);
    let exponent_d = word.windows(2).any(|w| w[0].is_ascii_digit() && matches!(w[1], b'd' | b'D'));
    Some(if has(b"#IND") || has(b"#INF") || has(b"#QNAN") || has(b"#SNAN") || has(b"nan(") {
        "it stands for a number that is not finite, as some programs write it; repair it where it comes from"
    } else if word.contains(&0) {
        "zero bytes are no text: is the file binary, or damaged?"
    } else if word.first() == Some(&b'\\') {
        "a backslash continues a line only as the last character of it"
    } else if word.contains(&b'#') {
        "a comment needs a blank before its #"
    } else if word.contains(&b',') && has_digit {
        "write numbers with a decimal point, and blanks between them, not commas"
    } else if !word.is_ascii() && has_digit {
        "signs and blanks beside digits must be ASCII"
    } else if exponent_d && has_digit {
        "write exponents with e"
    } else {
        return None;
    })
}

/// The decimal here, correctly rounded, and its length, where it starts with a digit or with `-` and a digit, and what
/// `ends` it or the end follows; `None` for all else, which may be a number too.
#[inline]
fn decimal(bytes: &[u8], ends: fn(u8) -> bool) -> Option<(f64, usize)> {
    let first = if bytes.first() == Some(&b'-') { 1 } else { 0 };
    if !bytes.get(first)?.is_ascii_digit() {
        return None;
    }
    let (number, length) = fast_float2::parse_partial(bytes).ok()?;
    bytes.get(length).is_none_or(|&b| ends(b)).then_some((number, length))
}

/// The number that the digits at the start of `bytes` form, and how many digits they are. `None` without digits, or
/// if the number does not fit.
pub(crate) fn leading_digits(bytes: &[u8]) -> Option<(u64, usize)> {
    /// So many digits always fit.
    const FITTING: usize = 19;
    let mut value = 0u64;
    let mut length = 0;
    while let Some(digit @ b'0'..=b'9') = bytes.get(length) {
        let digit = u64::from(digit - b'0');
        value = if length < FITTING { value * 10 + digit } else { value.checked_mul(10)?.checked_add(digit)? };
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

fn is_line_end(b: u8) -> bool {
    matches!(b, b'\n' | b'\r')
}

fn is_separator(b: u8) -> bool {
    is_blank(b) || is_line_end(b) || b == b'\\'
}

/// How many spaces are here.
fn spaces(bytes: &[u8]) -> usize {
    bytes.iter().take_while(|&&b| b == b' ').count()
}

/// How long the word here is, among marks.
pub(crate) fn word_in_list(rest: &[u8]) -> usize {
    rest.iter().position(|&b| ends_word_in_list(b)).unwrap_or(rest.len())
}

fn ends_word_in_list(b: u8) -> bool {
    is_separator(b) || matches!(b, b',' | b'(' | b')' | b'[' | b']' | b'{' | b'}' | b';' | b'=' | b'#' | b'"')
}

/// Whether a line is continued here: at a backslash that is the last character of it or of the file.
pub(crate) fn continues_line(rest: &[u8]) -> bool {
    matches!(rest, [b'\\'] | [b'\\', b'\n' | b'\r', ..])
}

/// Appends the shortest decimal that reads back equal, with an exponent where plain digits would be long.
pub(crate) fn push_number(text: &mut Vec<u8>, x: f64) {
    let size = x.abs();
    if (1e-5..1e16).contains(&size) || size == 0.0 {
        // Plain digits here too, but for the decimal of whole numbers.
        let mut buffer = zmij::Buffer::new();
        let digits = buffer.format_finite(x);
        text.extend_from_slice(digits.strip_suffix(".0").unwrap_or(digits).as_bytes());
    } else if (size < 1e-5 && size > 0.0) || (1e17..f64::INFINITY).contains(&size) {
        text.extend_from_slice(format!("{x:e}").as_bytes());
    } else {
        text.extend_from_slice(format!("{x}").as_bytes());
    }
}

/// Appends a number of at most nine significant digits, which hold every number in single precision; `nan` and `inf` for
/// what is not finite.
pub(crate) fn push_nine_digits(text: &mut Vec<u8>, x: f64) {
    const LEAST: i32 = -4;
    const TENS: [f64; 13] = [1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8];
    const POWERS: [f64; 13] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12];
    let size = x.abs();
    if x.is_nan() {
        text.extend_from_slice(b"nan");
        return;
    }
    if !(TENS[0]..1e9).contains(&size) {
        let rounded = if size == 0.0 || !x.is_finite() { x } else { format!("{x:.8e}").parse().unwrap_or(x) };
        return push_number(text, rounded);
    }
    // Nine digits as a whole number, of which so many are decimals. The formatting machinery would take most of a
    // writer's time.
    let above = TENS.iter().take_while(|&&ten| ten <= size).count();
    let mut decimals = (9 - LEAST) as usize - above;
    let mut digits = (size * POWERS[decimals]).round() as u64;
    while decimals > 0 && digits.is_multiple_of(10) {
        digits /= 10;
        decimals -= 1;
    }
    if x < 0.0 {
        text.push(b'-');
    }
    let unit = POWERS[decimals] as u64;
    push_unsigned(text, digits / unit);
    if decimals > 0 {
        text.push(b'.');
        let start = text.len();
        // A leading 1 keeps the zeros behind the point.
        push_unsigned(text, unit + digits % unit);
        text.remove(start);
    }
}

/// Appends the three coordinates, separated by spaces.
pub(crate) fn push_point(text: &mut Vec<u8>, p: DVec3) {
    push_number(text, p.x);
    text.push(b' ');
    push_number(text, p.y);
    text.push(b' ');
    push_number(text, p.z);
}

/// Appends a whole number; the formatting machinery would take most of a writer's time.
pub(crate) fn push_unsigned(text: &mut Vec<u8>, mut n: u64) {
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
        assert_eq!(told("x\n\\", 0), format!("t, line 2: \"\\\\\" is not a number: {}", hint(b"\\").unwrap()));
        assert_eq!(quoted(&[0xFF; 40]).chars().count(), 32 + 3);
    }

    #[test]
    fn words_that_some_programs_write_for_numbers_are_refused_with_a_way_out() {
        for (word, way_out) in [
            ("-1.#IND", "not finite"),
            ("1.#INF", "not finite"),
            ("1.#QNAN000", "not finite"),
            ("-nan(snan)", "not finite"),
            ("NaN(ind)", "not finite"),
            ("1.5#x", "a blank before its #"),
            ("1,5", "decimal point"),
            ("1.5,", "blanks between them"),
            ("1.0D+05", "exponents with e"),
            ("\u{2212}1", "must be ASCII"),
            ("1\u{a0}2", "must be ASCII"),
            ("0\0\0x", "zero bytes"),
        ] {
            for text in [word.to_string(), format!("{word} 1\n")] {
                let mut s = scanner(&text);
                assert_eq!(s.number(), None, "{text}");
                let told = s.unexpected("a number").to_string();
                assert!(told.contains("is not a number: ") && told.contains(way_out), "{told}");
            }
        }
        assert_eq!(hint(b"red"), None);
    }

    #[test]
    fn padding_and_the_end_of_dos_files_are_no_text() {
        for end in ["\x1A", "\n\x1A\r\n", "\0\0\0", "\n\x1A\0\0\n"] {
            let text = format!("1{end}");
            let mut s = scanner(&text);
            assert_eq!(s.number(), Some(1.0));
            s.skip_space();
            assert!(s.at_end(), "{text:?}");
        }
        assert_eq!(scanner("\0\0").rest(), b"\0\0");
        assert_eq!(scanner("1\0\n2").rest(), b"1\0\n2");
    }

    #[test]
    fn a_line_feed_and_a_return_are_one_end_where_the_first_line_has_them() {
        let lines = |text: &str| {
            let mut s = scanner(text);
            s.skip_space();
            while !s.at_end() {
                s.token();
                s.skip_space();
            }
            s.line()
        };
        assert_eq!(lines("a\n\rb\n\r\n\rc"), 4);
        assert_eq!(lines("a\n\r\n\rb"), 3);
        assert_eq!(lines("a\n\r\nb"), 3);
        assert_eq!(lines("a\r\nb\r\n\r\nc"), 4);
    }

    #[test]
    fn tokens_are_never_empty_before_the_end_of_a_line() {
        for (text, token) in [("\\x 1", "\\x"), ("\\\n1", "\\"), ("a\\\n1", "a"), ("a\\b\\", "a\\b"), ("\\", "\\")] {
            assert_eq!(scanner(text).peek_token(), token.as_bytes(), "{text:?}");
        }
    }

    #[test]
    fn rows_have_a_line_each_where_the_first_has() {
        let read = |text: &str| -> Result<u8> {
            let mut s = scanner(text);
            s.begin_rows();
            for row in 0..3 {
                s.begin_row();
                s.point().ok_or_else(|| s.unexpected("a number"))?;
                s.end_row(format_args!("row {row}"))?;
            }
            s.begin_rows();
            s.begin_row();
            s.unsigned().ok_or_else(|| s.unexpected("a count"))
        };
        let told = |text: &str| read(text).unwrap_err().to_string();
        for text in ["0 0 0\n\n1 1 1 # x\n2 2 2\n7", "0 0 0 1 1 1\n2 2 2\n7", "0\n0\n0\n1 1\n1 2 2 2 7"] {
            assert_eq!(read(text).unwrap(), 7, "{text}");
        }
        assert!(told("0 0 0\n1 1\n1 2 2\n7").starts_with("t, line 2: the line ends where a number should be"));
        assert!(told("0 0 0\n1 1 1 1\n2 2 2\n").starts_with("t, line 2: \"1\" is one value too many for row 1"));
        assert!(told("0 0\n1 1 1\n2 2 2\n7").starts_with("t, line 1: row 0 has fewer values on its line"));
        let shared = told("0 0 0 .9 9 9\n1 1 1 .9 9 9\n");
        assert!(shared.contains("(line 1 goes on after the first row"), "{shared}");
        let miscounted = told("0 0 0\n1 1 1\n2 2 2\n-3 3 3\n");
        assert!(miscounted.ends_with("correct the counts in the header)"), "{miscounted}");
    }

    #[test]
    fn whole_numbers_end_at_a_separator_and_fit() {
        assert_eq!(scanner("007 8").unsigned::<u64>(), Some(7));
        assert_eq!(scanner("12\\").unsigned::<u32>(), Some(12));
        assert_eq!(scanner("12#").unsigned::<u32>(), None);
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
            push_number(&mut out, x);
            assert_eq!(String::from_utf8(out).unwrap(), text);
        }
    }

    /// Whether `x` lies in the middle between two decimals of as many digits, which are as near then.
    fn is_halfway(x: f64, one: &str, other: &str) -> bool {
        let decimals = one.len() - one.find('.').map_or(one.len(), |point| point + 1);
        let exact = format!("{x:.800}");
        let (kept, rest) = exact.split_at(exact.find('.').unwrap() + 1 + decimals);
        let middle = rest.trim_end_matches('0') == "5" && !one.contains('e') && one.len() == other.len();
        middle && [one, other].contains(&kept) && [one, other].iter().all(|text| text.parse() == Ok(x))
    }

    #[test]
    fn in_the_middle_of_two_decimals_either_is_right() {
        let x = -766_633_452_956_028.0 - 0.25;
        let mut text = Vec::new();
        push_number(&mut text, x);
        let text = String::from_utf8(text).unwrap();
        assert!(is_halfway(x, &text, "-766633452956028.3"), "{text}");
        assert!(!is_halfway(x, &text, "-766633452956028.4"));
        assert!(!is_halfway(0.3, "0.3", "0.4") && !is_halfway(5e-324, "5e-324", "4e-324"));
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_the_standard_library(
            text in r"[+-]?[0-9]{0,18}(\.[0-9]{0,18})?([eE][+-]?[0-9]{1,3})?",
            end in r"[ \t\r\n\\]?",
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
        fn every_double_reads_back_with_its_bits(bits: u64) {
            let x = f64::from_bits(bits);
            let mut text = Vec::new();
            push_number(&mut text, x);
            prop_assert!(text.len() <= 24);
            let back = Scanner::new(&text, Path::new("t")).number().unwrap();
            prop_assert!(back.to_bits() == bits || (x.is_nan() && back.is_nan()));
        }

        #[test]
        fn numbers_are_written_as_the_standard_library_has_them(bits: u64, small in -1e6..1e6f64, whole: i64) {
            for x in [f64::from_bits(bits), small, small.round(), small / 1e9, whole as f64, (small * 1e3).round() / 1e3] {
                let size = x.abs();
                let long = (size < 1e-5 && size > 0.0) || (1e17..f64::INFINITY).contains(&size);
                let mut text = Vec::new();
                push_number(&mut text, x);
                let text = String::from_utf8(text).unwrap();
                let expected = if long { format!("{x:e}") } else { x.to_string() };
                prop_assert!(text == expected || is_halfway(x, &text, &expected), "{}: {} {}", bits, text, expected);
            }
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
