//! The bytes of a glTF file: its container, its buffers, and the elements that accessors see in these.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::document::{Buffer, Document};
use crate::memory::require;
use crate::text::quoted;
use crate::{Error, Result};

pub(super) const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

/// Types of the components of accessors.
pub(super) const UNSIGNED_BYTE: u64 = 5121;
pub(super) const UNSIGNED_SHORT: u64 = 5123;
pub(super) const UNSIGNED_INT: u64 = 5125;
pub(super) const FLOAT: u64 = 5126;

/// Files without the padding that the alphabet asks for are met, and mean one thing.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The parts of a file.
pub(super) struct Container<'a> {
    json: &'a [u8],
    is_text: bool,
    /// The buffer that a `.glb` may bring along.
    pub binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    pub fn of(bytes: &'a [u8], path: &Path) -> Result<Self> {
        if !bytes.starts_with(MAGIC) {
            return Ok(Container { json: bytes, is_text: true, binary: None });
        }
        let number = |at: usize| -> Result<u32> {
            let four = bytes.get(at..).and_then(|rest| rest.first_chunk());
            four.map(|&four| u32::from_le_bytes(four)).ok_or_else(|| ends_early(path, at))
        };
        let version = number(4)?;
        if version != 2 {
            return Err(Error::parse(path, None, format!("binary glTF of version {version} is not read: export 2.0")));
        }
        // What follows the announced length is nobody's.
        let end = number(8)? as usize;
        let (mut json, mut binary) = (None, None);
        let mut at = 12;
        while at < end {
            let (length, kind) = (number(at)? as usize, number(at + 4)?);
            let chunk = bytes.get(at + 8..at + 8 + length).ok_or_else(|| ends_early(path, at))?;
            match kind {
                JSON if json.is_none() => json = Some(chunk),
                BINARY if binary.is_none() => binary = Some(chunk),
                // Others are for extensions.
                _ => {}
            }
            at += 8 + length;
        }
        let json = json.ok_or_else(|| Error::parse(path, None, "the file has no chunk of JSON: is it complete?"))?;
        Ok(Container { json, is_text: false, binary })
    }

    pub fn document(&self, path: &Path) -> Result<Document> {
        serde_json::from_slice(self.json).map_err(|e| {
            let text = e.to_string();
            // The place is told as in other files.
            let what = text.rsplit_once(" at line ").map_or(&text[..], |(what, _)| what);
            let (line, column) = (e.line(), e.column());
            match self.is_text {
                true => Error::parse(path, Some(line), format!("column {column}: {what}: not glTF 2.0")),
                false => {
                    let what = format!("line {line}, column {column} of its JSON: {what}: not glTF 2.0");
                    Error::parse(path, None, what)
                }
            }
        })
    }
}

fn ends_early(path: &Path, at: usize) -> Error {
    Error::parse(path, None, format!("the file ends within the chunk at byte {at}: is it complete?"))
}

/// The bytes of all buffers.
pub(super) struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

/// What an accessor sees.
pub(super) struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: u64,
    pub count: usize,
}

impl<'a> Buffers<'a> {
    pub fn load(document: &Document, binary: Option<&'a [u8]>, path: &Path) -> Result<Self> {
        let load = |(b, buffer): (usize, &Buffer)| {
            let refused = |what: String| Error::parse(path, None, format!("buffers[{b}]: {what}"));
            let bytes = match &buffer.uri {
                None if b == 0 => {
                    Cow::Borrowed(binary.ok_or_else(|| refused("the file brings no bytes for it".into()))?)
                }
                None => return Err(refused("it has no uri".into())),
                Some(uri) => Cow::Owned(match uri.strip_prefix("data:") {
                    Some(data) => of_data(data).map_err(refused)?,
                    None => of_file(uri, path).map_err(refused)?,
                }),
            };
            if bytes.len() < buffer.byte_length {
                let what = format!("{} of its {} bytes are there: is it complete?", bytes.len(), buffer.byte_length);
                return Err(refused(what));
            }
            Ok(bytes)
        };
        document.buffers.iter().enumerate().map(load).collect::<Result<_>>().map(Buffers)
    }

    /// The elements of an accessor, of a shape such as `VEC3` and one of the types of components.
    pub fn elements(
        &self,
        document: &Document,
        index: usize,
        shape: &str,
        components: &[u64],
    ) -> std::result::Result<Elements<'_>, String> {
        let place = format!("accessors[{index}]");
        let accessor = document.accessors.get(index).ok_or_else(|| format!("{place} is not there"))?;
        if accessor.sparse.is_some() {
            return Err(format!("{place} is sparse, which is not read: export plain ones"));
        }
        if accessor.shape != shape || !components.contains(&accessor.component_type) {
            return Err(format!(
                "{place} is {} of components {}, where {shape} of {} is read",
                quoted(accessor.shape.as_bytes()),
                accessor.component_type,
                components.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")
            ));
        }
        let size = match accessor.component_type {
            UNSIGNED_BYTE => 1,
            UNSIGNED_SHORT => 2,
            _ => 4,
        } * if shape == "VEC3" { 3 } else { 1 };
        let v = accessor.buffer_view.ok_or_else(|| format!("{place} has no bufferView"))?;
        let view = document.buffer_views.get(v).ok_or_else(|| format!("bufferViews[{v}] is not there"))?;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(format!("bufferViews[{v}] has elements of {stride} bytes, and {place} of {size}"));
        }
        let buffer = self.0.get(view.buffer).ok_or_else(|| format!("buffers[{}] is not there", view.buffer))?;
        let end = view.byte_offset.checked_add(view.byte_length).filter(|&end| end <= buffer.len());
        let within = end.map(|end| &buffer[view.byte_offset..end]);
        let within = within.ok_or_else(|| format!("bufferViews[{v}] reaches beyond buffers[{}]", view.buffer))?;
        let needed = match accessor.count {
            0 => Some(0),
            count => (count - 1).checked_mul(stride).and_then(|before| before.checked_add(size)),
        };
        let needed = needed.and_then(|needed| needed.checked_add(accessor.byte_offset));
        if needed.is_none_or(|needed| needed > within.len()) {
            return Err(format!("{place} reaches beyond bufferViews[{v}]"));
        }
        Ok(Elements {
            bytes: &within[accessor.byte_offset..],
            stride,
            component: accessor.component_type,
            count: accessor.count,
        })
    }
}

impl Elements<'_> {
    /// Component `k` of element `i`.
    pub fn float(&self, i: usize, k: usize) -> f64 {
        f32::from_le_bytes(self.four(i * self.stride + 4 * k)).into()
    }

    /// Element `i`, a whole number.
    pub fn unsigned(&self, i: usize) -> u32 {
        let at = i * self.stride;
        match self.component {
            UNSIGNED_BYTE => self.bytes[at].into(),
            UNSIGNED_SHORT => u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]]).into(),
            _ => u32::from_le_bytes(self.four(at)),
        }
    }

    fn four(&self, at: usize) -> [u8; 4] {
        [0, 1, 2, 3].map(|byte| self.bytes[at + byte])
    }
}

/// The bytes in a URI after `data:`.
fn of_data(data: &str) -> std::result::Result<Vec<u8>, String> {
    let (_, text) = data.split_once(";base64,").ok_or("its data are not in base64")?;
    BASE64.decode(text).map_err(|e| format!("its data are not in base64: {e}"))
}

/// The bytes of a file beside `path`.
fn of_file(uri: &str, path: &Path) -> std::result::Result<Vec<u8>, String> {
    let name = percent_decode_str(uri).decode_utf8_lossy();
    let shown = quoted(name.as_bytes());
    if name.contains("://") || Path::new(&*name).is_absolute() {
        return Err(format!("{shown} is no file beside: save it there, and name it without a path"));
    }
    let file = path.parent().unwrap_or(Path::new("")).join(&*name);
    let cannot = |e: std::io::Error| format!("cannot read {shown}: {e}");
    let size = match file.metadata().map_err(cannot)? {
        found if found.is_file() => found.len(),
        _ => return Err(format!("{shown} is no file")),
    };
    require(size, || format!("the buffer {shown}"), "use a smaller one").map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    File::open(&file).and_then(|file| file.take(size).read_to_end(&mut bytes)).map_err(cannot)?;
    Ok(bytes)
}
