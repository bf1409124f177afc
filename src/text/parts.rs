//! Parts of a text file, of whole lines, which all threads read or make at once.

use std::io::{self, Write};
use std::ops::Range;

use super::Scanner;
use crate::{Result, parallel};

/// Bytes of a part: few enough that what is read stays in the cache until it is appended to what was read before.
pub(crate) const PART: usize = 1 << 18;

/// Rows of a part that is written, for the same reason.
const ROWS: usize = 2048;

/// Parts for each thread between two times at which they are appended, or written.
const PER_THREAD: usize = 8;

/// How many parts are read before they are appended.
pub(crate) fn at_once() -> usize {
    PER_THREAD * parallel::threads()
}

impl<'a> Scanner<'a> {
    /// What follows in parts of `size` bytes or a little more, at most `count` of them: whole lines, without an end
    /// that a backslash continues. Each has the offsets of the file, and all have the line of the first.
    pub fn parts(&self, size: usize, count: usize) -> Vec<Self> {
        let mut parts = Vec::new();
        let mut at = self.at;
        while at < self.bytes.len() && parts.len() < count {
            let end = self.cut(at.saturating_add(size.max(1) - 1));
            parts.push(Scanner { bytes: &self.bytes[..end], at, ..self.clone() });
            at = end;
        }
        parts
    }

    /// The end of the first line that ends at `from` or later and is not continued.
    fn cut(&self, mut from: usize) -> usize {
        // Of two characters that end a line neither is the last of it.
        while !self.feed_before_return && from < self.bytes.len() {
            let Some(feed) = memchr::memchr(b'\n', &self.bytes[from..]) else { break };
            from += feed + 1;
            match self.bytes[..from - 1] {
                [.., b'\\'] | [.., b'\\', b'\r'] => {}
                _ => return from,
            }
        }
        self.bytes.len()
    }

    /// The same place and line, at the start of a file.
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = line;
        self
    }

    /// Goes on where `part`, one of the [`parts`](Self::parts) of this file, has come to.
    pub fn follow(&mut self, part: &Self) {
        (self.at, self.line) = (part.at, part.line);
    }

    /// Parts of about `size` bytes of what follows in a table that has a row a line, each at its line, with the number of
    /// its rows, which are no more than `wanted` in all. None where rows are not told by lines.
    pub fn rows_in_parts(&self, wanted: u64, size: usize) -> Vec<(Self, u64)> {
        if !matches!(self.rows, super::Rows::OneALine) {
            return Vec::new();
        }
        let parts = self.parts(size, at_once());
        let counts = parallel::map(parts.len(), 1, |k| parts[k.start].rows_and_lines());
        let (mut line, mut left) = (self.line, wanted);
        let mut counted = Vec::with_capacity(parts.len());
        for (part, (rows, lines)) in parts.into_iter().zip(counts) {
            // What follows the last row that is wanted belongs to another table.
            if left == 0 {
                break;
            }
            let rows = rows.min(left);
            counted.push((part.at_line(line), rows));
            line += lines;
            left -= rows;
        }
        counted
    }

    /// How many lines hold a word, and how many line ends there are.
    fn rows_and_lines(&self) -> (u64, usize) {
        let text = self.rest();
        // Nearly all files: every line starts with a word, and ends alike.
        let is_early = |a: u8, b: u8| u8::from(a == b'\n') & u8::from(b <= b' ');
        let early = text.iter().zip(text.iter().skip(1)).fold(0, |early, (&a, &b)| early | is_early(a, b));
        if early == 0 && text.first().is_some_and(|&b| b > b' ') && memchr::memchr2(b'\r', self.comment, text).is_none()
        {
            let lines = memchr::memchr_iter(b'\n', text).count();
            return (lines as u64 + u64::from(self.ends_within_a_line()), lines);
        }
        let mut s = self.clone();
        let mut rows = 0;
        loop {
            s.skip_space();
            if s.at_end() {
                return (rows, s.line - self.line);
            }
            rows += 1;
            s.skip_to_line_end();
        }
    }
}

/// [`Scanner::rows_in_parts`] for parts of `size` bytes.
pub(crate) fn rows_in_parts<'a>(size: usize) -> impl Fn(&Scanner<'a>, u64) -> Vec<(Scanner<'a>, u64)> {
    move |s, wanted| s.rows_in_parts(wanted, size)
}

/// What rows become.
pub(crate) trait Output: Send + Sync + Sized {
    /// Another of the kind, with nothing read yet.
    fn empty(&self) -> Self;

    /// Forgets what was read.
    fn clear(&mut self);

    /// Adds what was read of the parts that come next, or says that there is no place for it, and stays.
    fn append(&mut self, parts: &[&Self]) -> bool;
}

/// Finds where the parts of as many rows as are wanted start, and how many rows each has.
pub(crate) type Places<'a, S> = dyn Fn(&S, u64) -> Vec<(S, u64)> + 'a;

/// Reads `count` rows, each by `read(source, row, out)`: the first alone; then as many as there are parts of by all
/// threads, where `parts(source, wanted)` gives places with the number of rows from there on, and `follow` goes to a
/// place; and the rest again one by one. What `read` refuses, it refuses as if it had read all rows one by one.
pub(crate) fn read_rows<S: Clone + Send + Sync, O: Output>(
    source: &mut S,
    count: u64,
    out: &mut O,
    parts: &Places<S>,
    follow: &dyn Fn(&mut S, &S),
    read: &(dyn Fn(&mut S, u64, &mut O) -> Result<()> + Sync),
) -> Result<()> {
    struct Task<S, O> {
        source: S,
        rows: Range<u64>,
        out: O,
        is_good: bool,
    }
    let mut row = 0;
    if row < count {
        read(source, row, out)?;
        row += 1;
    }
    let mut spare: Vec<O> = Vec::new();
    while row < count {
        let parts = parts(source, count - row);
        if parts.len() < 2 {
            break;
        }
        let first = row;
        let place = |(source, rows): (S, u64)| {
            let rows = row..row + rows;
            row = rows.end;
            let mut out = spare.pop().unwrap_or_else(|| out.empty());
            out.clear();
            Task { source, rows, out, is_good: false }
        };
        let mut tasks: Vec<Task<S, O>> = parts.into_iter().map(place).collect();
        parallel::chunks(&mut tasks, 1, |_, task| {
            let Task { source, rows, out, is_good } = &mut task[0];
            *is_good = rows.clone().all(|row| read(source, row, out).is_ok());
        });
        let outs: Vec<&O> = tasks.iter().map(|task| &task.out).collect();
        let is_good = row > first && tasks.iter().all(|task| task.is_good) && out.append(&outs);
        if !is_good {
            // Read one by one, to say what is wrong as it is said of small files.
            row = first;
            break;
        }
        if let Some(last) = tasks.last() {
            follow(source, &last.source);
        }
        spare.extend(tasks.into_iter().map(|task| task.out));
    }
    for row in row..count {
        read(source, row, out)?;
    }
    Ok(())
}

/// Writes `rows` rows, where `fill` appends the text of a range of them: all threads make some while those before are
/// written.
pub(crate) fn write_in_parts(
    out: &mut dyn Write,
    rows: usize,
    fill: &(dyn Fn(Range<usize>, &mut Vec<u8>) + Sync),
) -> io::Result<()> {
    let make = |parts: &mut Vec<Vec<u8>>, first: usize| {
        parts.resize_with((rows - first).div_ceil(ROWS).min(at_once()), Vec::new);
        parallel::chunks(parts, 1, |k, part| {
            let start = first + k * ROWS;
            part[0].clear();
            fill(start..rows.min(start + ROWS), &mut part[0]);
        });
    };
    let (mut made, mut next) = (Vec::new(), Vec::new());
    make(&mut made, 0);
    let mut first = 0;
    while !made.is_empty() {
        first += ROWS * made.len();
        let mut write = || made.iter().try_for_each(|text| out.write_all(text));
        if first < rows {
            parallel::beside(|| make(&mut next, first), write)?;
        } else {
            write()?;
            next.clear();
        }
        std::mem::swap(&mut made, &mut next);
    }
    Ok(())
}
