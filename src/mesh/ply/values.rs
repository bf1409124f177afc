//! The values after the header of a PLY file, as text or as bytes.

use std::fmt::Display;
use std::path::Path;

use super::header::{Element, Scalar};
use crate::text::Scanner;
use crate::text::parts::at_once;
use crate::{Error, Result};

/// Values in file order. A method that gives `None` leaves the place for [`unexpected`](Values::unexpected).
pub(super) trait Values: Clone + Send + Sync {
    /// Parts of about `size` bytes of what follows, with the number of rows of `element` in each, no more than `wanted` in
    /// all. None where they cannot be told without reading.
    fn parts(&self, element: &Element, wanted: u64, size: usize) -> Vec<(Self, u64)>;

    /// Goes on where `part` has come to.
    fn follow(&mut self, part: &Self);

    /// The least number of bytes that a value takes.
    fn least_bytes(&self, scalar: Scalar) -> usize;

    /// The number of bytes not read yet.
    fn bytes_left(&self) -> usize;

    /// Begins the rows of an element.
    fn begin_rows(&mut self);

    /// Where the next row starts: its line in text, its byte otherwise.
    fn place(&mut self) -> usize;

    /// Ends a row, all of whose values have been read.
    fn end_row(&mut self, row: impl Display) -> Result<()>;

    fn number(&mut self, scalar: Scalar) -> Option<f64>;

    /// A whole number, not negative, that fits `T`.
    fn unsigned<T: TryFrom<u64>>(&mut self, scalar: Scalar) -> Option<T>;

    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()>;

    /// Whether only white space follows.
    fn at_end(&mut self) -> bool;

    /// The error of finding something else than `wanted`.
    fn unexpected(&self, wanted: impl Display) -> Error;

    /// An error about what starts at `place`.
    fn error(&self, place: usize, what: String) -> Error;
}

#[derive(Clone)]
pub(super) struct Text<'a> {
    pub scanner: Scanner<'a>,
}

impl Values for Text<'_> {
    fn parts(&self, _: &Element, wanted: u64, size: usize) -> Vec<(Self, u64)> {
        let parts = self.scanner.rows_in_parts(wanted, size);
        parts.into_iter().map(|(scanner, rows)| (Text { scanner }, rows)).collect()
    }

    fn follow(&mut self, part: &Self) {
        self.scanner.follow(&part.scanner);
    }

    fn least_bytes(&self, _: Scalar) -> usize {
        2 // a digit and a separator
    }

    fn bytes_left(&self) -> usize {
        self.scanner.rest().len()
    }

    fn begin_rows(&mut self) {
        self.scanner.begin_rows();
    }

    fn place(&mut self) -> usize {
        self.scanner.begin_row()
    }

    fn end_row(&mut self, row: impl Display) -> Result<()> {
        self.scanner.end_row(row)
    }

    fn number(&mut self, _: Scalar) -> Option<f64> {
        self.scanner.next_in_row();
        self.scanner.number()
    }

    fn unsigned<T: TryFrom<u64>>(&mut self, _: Scalar) -> Option<T> {
        self.scanner.next_in_row();
        self.scanner.unsigned()
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()> {
        for _ in 0..count {
            self.number(scalar)?;
        }
        Some(())
    }

    fn at_end(&mut self) -> bool {
        self.scanner.skip_space();
        self.scanner.at_end()
    }

    fn unexpected(&self, wanted: impl Display) -> Error {
        self.scanner.unexpected(wanted)
    }

    fn error(&self, place: usize, what: String) -> Error {
        self.scanner.error_at(place, what)
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

#[derive(Clone)]
pub(super) struct Binary<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    pub at: usize,
    pub order: ByteOrder,
}

impl Binary<'_> {
    /// Passes over whole rows, until they take `size` bytes, and says how many: at most `wanted`.
    fn pass_rows(&mut self, element: &Element, wanted: u64, size: usize) -> u64 {
        if element.properties.iter().all(|p| p.length.is_none()) {
            let row: usize = element.properties.iter().map(|p| p.scalar.bytes()).sum();
            let rows = size.div_ceil(row).min(self.bytes_left() / row);
            let rows = usize::try_from(wanted).map_or(rows, |wanted| rows.min(wanted));
            self.at += rows * row;
            return rows as u64;
        }
        // Where the length of the only list stands in a row. As far as it stays what it is, all rows take the same room.
        let mut lists = element.properties.iter().enumerate().filter_map(|(k, p)| Some((k, p.length?)));
        let only_list = lists.next().filter(|_| lists.next().is_none());
        let before = |k: usize| element.properties[..k].iter().map(|p| p.scalar.bytes()).sum::<usize>();
        let length_at = only_list.map(|(k, length)| before(k)..before(k) + length.bytes());

        let end = self.at.saturating_add(size);
        let mut rows = 0;
        while rows < wanted && self.at < end {
            let start = self.at;
            for property in &element.properties {
                let items = match property.length {
                    None => Some(1),
                    Some(length) => self.unsigned(length),
                };
                if items.and_then(|items| self.skip(property.scalar, items)).is_none() {
                    self.at = start;
                    return rows;
                }
            }
            rows += 1;
            if let Some(length_at) = &length_at {
                let (first, others) = self.bytes[start..].split_at(self.at - start);
                let most = (wanted - rows).min((end.saturating_sub(self.at).div_ceil(first.len())) as u64);
                let others = others.chunks_exact(first.len()).take(usize::try_from(most).unwrap_or(usize::MAX));
                let alike = others.take_while(|row| length_at.clone().all(|k| row[k] == first[k])).count();
                self.at += alike * first.len();
                rows += alike as u64;
            }
        }
        rows
    }

    /// The bytes of one value, the least significant first; moves to the end if there are too few.
    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let Some(&(mut value)) = self.bytes[self.at..].first_chunk::<N>() else {
            self.at = self.bytes.len();
            return None;
        };
        self.at += N;
        if self.order == ByteOrder::Big {
            value.reverse();
        }
        Some(value)
    }
}

impl Values for Binary<'_> {
    fn parts(&self, element: &Element, wanted: u64, size: usize) -> Vec<(Self, u64)> {
        let mut parts = Vec::new();
        let mut ahead = self.clone();
        let mut left = wanted;
        while left > 0 && parts.len() < at_once() {
            let start = ahead.clone();
            let rows = ahead.pass_rows(element, left, size);
            if rows == 0 {
                break;
            }
            left -= rows;
            parts.push((start, rows));
        }
        parts
    }

    fn follow(&mut self, part: &Self) {
        self.at = part.at;
    }

    fn least_bytes(&self, scalar: Scalar) -> usize {
        scalar.bytes()
    }

    fn bytes_left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn begin_rows(&mut self) {}

    fn place(&mut self) -> usize {
        self.at
    }

    fn end_row(&mut self, _: impl Display) -> Result<()> {
        Ok(())
    }

    #[inline]
    fn number(&mut self, scalar: Scalar) -> Option<f64> {
        Some(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    #[inline]
    fn unsigned<T: TryFrom<u64>>(&mut self, scalar: Scalar) -> Option<T> {
        let start = self.at;
        let value = match scalar {
            Scalar::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            // The header refuses them where whole numbers are needed.
            Scalar::F32 | Scalar::F64 => return None,
        };
        let fitting = u64::try_from(value).ok().and_then(|value| T::try_from(value).ok());
        if fitting.is_none() {
            self.at = start;
        }
        fitting
    }

    #[inline]
    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()> {
        let length =
            usize::try_from(count).ok().and_then(|n| n.checked_mul(scalar.bytes())).filter(|&n| n <= self.bytes_left());
        self.at += length.unwrap_or(self.bytes_left());
        length.map(|_| ())
    }

    fn at_end(&mut self) -> bool {
        self.bytes[self.at..].trim_ascii().is_empty()
    }

    fn unexpected(&self, wanted: impl Display) -> Error {
        let what = if self.bytes_left() == 0 {
            format!("the file ends where {wanted} should be: is it complete?")
        } else {
            format!("byte {}: the value is not {wanted}", self.at)
        };
        Error::parse(self.path, None, what)
    }

    fn error(&self, place: usize, what: String) -> Error {
        Error::parse(self.path, None, format!("byte {place}: {what}"))
    }
}
