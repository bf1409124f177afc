//! JSON on standard output, with exponents as in all other results: `1e145`, not serde_json's `1e+145`.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::ser::{Formatter, PrettyFormatter, Serializer};

use super::print;
use limitlab::error::{Error, Result};

/// Prints one value, indented.
///
/// # Errors
/// As [`print()`](super::print).
pub fn print_json(value: &impl Serialize) -> Result<()> {
    print(&String::from_utf8_lossy(&json_text(value)?))
}

/// One value, indented.
///
/// # Errors
/// If the value has no JSON.
pub(super) fn json_text(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    value
        .serialize(&mut Serializer::with_formatter(&mut bytes, Plain(PrettyFormatter::new())))
        .map_err(|e| Error::Computation(format!("JSON: {e}")))?;
    Ok(bytes)
}

/// serde_json's layout, without the sign of positive exponents.
struct Plain(PrettyFormatter<'static>);

impl Formatter for Plain {
    fn write_f64<W: ?Sized + Write>(&mut self, out: &mut W, value: f64) -> io::Result<()> {
        let mut digits = Vec::new();
        self.0.write_f64(&mut digits, value)?;
        digits.retain(|&c| c != b'+');
        out.write_all(&digits)
    }

    fn begin_array<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.begin_array(out)
    }

    fn end_array<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.end_array(out)
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        self.0.begin_array_value(out, first)
    }

    fn end_array_value<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.end_array_value(out)
    }

    fn begin_object<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.begin_object(out)
    }

    fn end_object<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.end_object(out)
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        self.0.begin_object_key(out, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.begin_object_value(out)
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.0.end_object_value(out)
    }
}
