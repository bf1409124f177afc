//! The text of USD as tokens: space and comments, words, strings, numbers in lists, and values that are passed over.

use std::fmt::Display;

use crate::text::{Scanner, quoted, word_in_list};
use crate::{Error, Result};

/// A place in the text.
#[derive(Clone)]
pub(super) struct Tokens<'a> {
    pub s: Scanner<'a>,
}

/// A list of a file, and where it stands.
pub(super) struct List<T> {
    pub values: Vec<T>,
    /// The line on which it opens.
    pub line: usize,
    /// The first value of each line that has values, and the line.
    starts: Vec<(u32, u32)>,
}

impl<T> List<T> {
    /// One that the file lacks, as if it stood empty on a line.
    pub fn empty(line: usize) -> Self {
        List { values: Vec::new(), line, starts: Vec::new() }
    }

    fn push(&mut self, value: T, line: usize) {
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        if self.starts.last().is_none_or(|&(_, last)| last != line) {
            self.starts.push((self.values.len() as u32, line));
        }
        self.values.push(value);
    }

    /// The line of a value. O(log lines).
    pub fn line_of(&self, k: usize) -> usize {
        let after = self.starts.partition_point(|&(start, _)| start as usize <= k);
        after.checked_sub(1).map_or(self.line, |at| self.starts[at].1 as usize)
    }

    /// The lines of the values at ascending places. O(places + lines).
    pub fn lines_of(&self, places: impl Iterator<Item = usize>) -> Vec<u32> {
        let mut rest = self.starts.iter().peekable();
        let mut line = 0;
        let line_of = |k: usize| {
            while let Some(&(_, next)) = rest.next_if(|&&(start, _)| start as usize <= k) {
                line = next;
            }
            line
        };
        places.map(line_of).collect()
    }
}

impl<'a> Tokens<'a> {
    pub fn peek(&self) -> Option<u8> {
        self.s.peek()
    }

    /// Whether this character is here, which is passed then.
    pub fn take(&mut self, mark: u8) -> bool {
        let is_here = self.peek() == Some(mark);
        self.s.advance(usize::from(is_here));
        is_here
    }

    /// Passes a character that must be here.
    pub fn expect(&mut self, mark: u8, wanted: impl Display) -> Result<()> {
        if self.take(mark) { Ok(()) } else { Err(self.unexpected(wanted)) }
    }

    /// Skips white space and comments: from `#` or `//` to the end of the line, and from `/*` to `*/`.
    pub fn skip_space(&mut self) -> Result<()> {
        loop {
            match self.peek() {
                Some(b' ' | b'\t' | b'\n' | b'\r' | b'#' | b'\x0B' | b'\x0C') => self.s.skip_space(),
                Some(b'/') if self.s.rest().starts_with(b"//") => self.s.skip_to_line_end(),
                Some(b'/') if self.s.rest().starts_with(b"/*") => {
                    let opening = self.s.line();
                    self.s.advance(2);
                    self.skip_until(b"*/", opening, "comment", true)?;
                }
                _ => return Ok(()),
            }
        }
    }

    /// Passes all up to `mark` and it, which must come, on the same line unless more may be passed.
    fn skip_until(&mut self, mark: &[u8], opening: usize, what: &str, over_lines: bool) -> Result<&'a [u8]> {
        let start = self.s.rest();
        let end = |tokens: &Self| &start[..start.len() - tokens.s.rest().len()];
        loop {
            match self.s.rest() {
                rest if rest.starts_with(mark) => {
                    let passed = end(self);
                    self.s.advance(mark.len());
                    return Ok(passed);
                }
                [b'\n' | b'\r', ..] if over_lines => self.s.skip_line_break(),
                [] | [b'\n' | b'\r', ..] => {
                    return Err(self.s.error_at(opening, format!("the {what} that begins here has no end")));
                }
                [b'\\', next, ..] if what == STRING && !matches!(next, b'\n' | b'\r') => self.s.advance(2),
                _ => self.s.advance(1),
            }
        }
    }

    /// The string here, as it is written: in single or double quotes, or three of them, which may go over lines.
    pub fn string(&mut self, wanted: impl Display) -> Result<&'a [u8]> {
        let Some(quote @ (b'"' | b'\'')) = self.peek() else { return Err(self.unexpected(wanted)) };
        let three = [quote; 3];
        let mark = if self.s.rest().starts_with(&three) { &three[..] } else { &three[..1] };
        let opening = self.s.line();
        self.s.advance(mark.len());
        self.skip_until(mark, opening, STRING, mark.len() == 3)
    }

    /// The word here: letters, digits, `_`, and what joins names.
    pub fn word(&mut self, wanted: impl Display) -> Result<&'a [u8]> {
        let rest = self.s.rest();
        let in_word = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b':' | b'.' | b'|') || !b.is_ascii();
        let length = rest.iter().position(|&b| !in_word(b)).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.unexpected(wanted));
        }
        self.s.advance(length);
        Ok(&rest[..length])
    }

    /// The error of finding something else here than `wanted`.
    pub fn unexpected(&self, wanted: impl Display) -> Error {
        if self.s.at_end() {
            return self.s.unexpected(wanted);
        }
        let rest = self.s.rest();
        let word = &rest[..word_in_list(rest).max(1)];
        self.s.error(format!("{} is not {wanted}", quoted(word)))
    }

    /// The list of what `item` reads, `[…]`.
    pub fn list<T>(&mut self, name: &str, mut item: impl FnMut(&mut Self, usize) -> Result<T>) -> Result<List<T>> {
        let mut list = List::empty(self.s.line());
        self.expect(b'[', format_args!("the list of {name}, in brackets"))?;
        loop {
            self.skip_space()?;
            if self.take(b']') {
                return Ok(list);
            }
            if list.values.len() == u32::MAX as usize {
                return Err(self.s.error(format!("{name} has more values than 32-bit indices can name")));
            }
            let line = self.s.line();
            let value = item(self, list.values.len())?;
            list.push(value, line);
            self.skip_space()?;
            if !self.take(b',') && self.peek() != Some(b']') {
                return Err(self.unexpected(format_args!("a comma, or the bracket that closes {name}")));
            }
        }
    }

    /// Passes a value of any kind.
    pub fn skip_value(&mut self) -> Result<()> {
        match self.peek() {
            Some(b'(' | b'[' | b'{') => self.skip_brackets(),
            Some(b'"' | b'\'') => self.string("a string").map(drop),
            Some(b'@') => self.asset(),
            Some(b'<') => self.target(),
            _ => self.skip_word("a value"),
        }
    }

    /// The value here as it is written, of a string what is in the quotes.
    fn value(&mut self) -> Result<&'a [u8]> {
        if let Some(b'"' | b'\'') = self.peek() {
            return self.string("a string");
        }
        let rest = self.s.rest();
        self.skip_value()?;
        Ok(&rest[..rest.len() - self.s.rest().len()])
    }

    fn skip_word(&mut self, wanted: &str) -> Result<()> {
        match word_in_list(self.s.rest()) {
            0 => Err(self.unexpected(wanted)),
            length => {
                self.s.advance(length);
                Ok(())
            }
        }
    }

    fn asset(&mut self) -> Result<()> {
        let mark: &[u8] = if self.s.rest().starts_with(b"@@@") { b"@@@" } else { b"@" };
        let opening = self.s.line();
        self.s.advance(mark.len());
        self.skip_until(mark, opening, "asset path", false).map(drop)
    }

    fn target(&mut self) -> Result<()> {
        let opening = self.s.line();
        self.skip_until(b">", opening, "path", false).map(drop)
    }

    /// Passes what stands in brackets here, with all brackets, strings and comments inside.
    pub fn skip_brackets(&mut self) -> Result<()> {
        let mut open: Vec<(u8, usize)> = Vec::new();
        loop {
            self.skip_space()?;
            let rest = self.s.rest();
            match rest.first() {
                Some(b @ (b'(' | b'[' | b'{')) => {
                    let closing = match b {
                        b'(' => b')',
                        b'[' => b']',
                        _ => b'}',
                    };
                    open.push((closing, self.s.line()));
                    self.s.advance(1);
                }
                Some(b'"' | b'\'') => drop(self.string("a string")?),
                Some(b'@') => self.asset()?,
                Some(b'<') => self.target()?,
                Some(b'/') => self.s.advance(1),
                Some(&b) if !matches!(b, b')' | b']' | b'}') => {
                    // A run of what means nothing here.
                    let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b',' | b' ' | b'.' | b'-');
                    let length = rest.iter().position(|&b| !plain(b)).unwrap_or(rest.len());
                    self.s.advance(length.max(1));
                }
                closing => {
                    let Some((wanted, line)) = open.pop() else { return Ok(()) };
                    if closing != Some(&wanted) {
                        let wanted = wanted as char;
                        return Err(
                            self.unexpected(format_args!("the {wanted} that closes the bracket of line {line}"))
                        );
                    }
                    self.s.advance(1);
                    if open.is_empty() {
                        return Ok(());
                    }
                }
            }
        }
    }

    /// Passes metadata `(…)`, and gives what it has for each of `keys`: of a string what is in the quotes.
    pub fn metadata<const N: usize>(&mut self, keys: [&[u8]; N]) -> Result<[Option<&'a [u8]>; N]> {
        self.expect(b'(', "metadata, in brackets")?;
        let mut found = [None; N];
        loop {
            self.skip_space()?;
            match self.peek() {
                Some(b')') => {
                    self.s.advance(1);
                    return Ok(found);
                }
                Some(b';' | b',' | b'=') => self.s.advance(1),
                Some(b'"' | b'\'' | b'(' | b'[' | b'{' | b'@' | b'<') => self.skip_value()?,
                _ => {
                    let rest = self.s.rest();
                    self.skip_word("the ) that closes metadata")?;
                    let word = &rest[..rest.len() - self.s.rest().len()];
                    self.skip_space()?;
                    if let Some(key) = keys.iter().position(|&key| key == word)
                        && self.take(b'=')
                    {
                        self.skip_space()?;
                        found[key] = Some(self.value()?);
                    }
                }
            }
        }
    }
}

const STRING: &str = "string";
