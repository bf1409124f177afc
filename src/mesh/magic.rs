//! Magic numbers: what a file is, by its first bytes, where it is no text of points and faces.

/// First bytes of what is met under the name of a mesh file, what it is, and what to do.
const KNOWN: [(&[u8], &str); 22] = [
    (b"\xFF\xFE", UTF_16),
    (b"\xFE\xFF", UTF_16),
    (b"\0", "it begins with zero bytes: it is binary, or was damaged when it was copied"),
    (b"\x1F\x8B", "it is compressed by gzip: unpack it first"),
    (b"BZh", "it is compressed by bzip2: unpack it first"),
    (b"\xFD7zXZ", "it is compressed by xz: unpack it first"),
    (b"\x28\xB5\x2F\xFD", "it is compressed by Zstandard: unpack it first"),
    (b"7z\xBC\xAF", "it is a 7-Zip archive: unpack it first"),
    (b"PK\x03\x04", "it is a zip archive: unpack it first"),
    (b"version https://git-lfs", "it is a pointer of Git LFS: fetch the file itself (git lfs pull)"),
    (b"ply", "it is a PLY file: let its name end in .ply"),
    (b"OFF", "it is an OFF file: let its name end in .off"),
    (b"#usda", "it is a USD file: let its name end in .usda"),
    (b"PXR-USDC", "it is binary USD: save it as text, .usda"),
    (b"solid", "it is an STL file: let its name end in .stl"),
    (b"glTF", "it is a binary glTF file: let its name end in .glb"),
    (b"Kaydara FBX", "it is an FBX file: convert it to .usda, .obj, .off or .ply"),
    (b"DRACO", "it is a Draco file: convert it to .usda, .obj, .off or .ply"),
    (b"# vtk DataFile", "it is a VTK file: convert it to .usda, .obj, .off or .ply"),
    (b"ISO-10303-21", "it is a STEP file: convert it to .usda, .obj, .off or .ply"),
    (b"<", "it is XML or HTML: if it was downloaded, this is the page and not the file"),
    (b"{", "it is JSON: if it is glTF, let its name end in .gltf, else convert the mesh in it"),
];

const UTF_16: &str = "it is text in UTF-16 or UTF-32: save it as UTF-8 or ASCII";

/// Says what `bytes` are, and what to do, if their start is that of another kind of file.
pub(crate) fn other_kind(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        // Without a byte order mark: two ASCII characters with a zero byte before or after each.
        [0, 1..=255, 0, 1..=255, ..] | [1..=255, 0, 1..=255, 0, ..] => Some(UTF_16),
        _ => KNOWN.iter().find(|(start, _)| bytes.starts_with(start)).map(|&(_, what)| what),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_in_utf_16_is_known_with_and_without_its_mark() {
        let units: Vec<u16> = "v 1 2 3\n".encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
        for bytes in [&little[..], &big, &[b"\xFF\xFE", &little[..]].concat(), &[b"\xFE\xFF", &big[..]].concat()] {
            assert_eq!(other_kind(bytes), Some(UTF_16));
        }
    }

    #[test]
    fn ordinary_starts_are_no_other_kind() {
        for text in ["", "#", "v 0 0 0", "# solid\n", "mtllib a.mtl", "o x", "\u{feff}v 1", "4 4 6", "NOFF"] {
            assert_eq!(other_kind(text.as_bytes()), None);
        }
    }
}
