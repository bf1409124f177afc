//! The one mesh of a scene: its properties among those of all prims, and what they make together.

use std::path::Path;

use glam::DVec3;

use super::super::attributes::Attributes;
use super::super::builder::few_corners;
use super::super::file_tags::{CornerTag, CreaseTag, FileTags, Subdivision, check_sharpness, not_there};
use super::super::io::{Lines, Loaded};
use super::super::validate::Boundary;
use super::super::{Faces, Mesh};
use super::StageMetadata;
use super::tokens::{List, Tokens};
use crate::error::one_of;
use crate::text::{Scanner, quoted};
use crate::{Error, Result};

/// What may stand before the type of a property.
const PREFIXES: [&[u8]; 9] =
    [b"custom", b"uniform", b"varying", b"config", b"prepend", b"append", b"add", b"delete", b"reorder"];

/// Lists of a mesh that must not change over time.
const LISTS: [&str; 8] = [
    "points",
    "faceVertexCounts",
    "faceVertexIndices",
    "creaseIndices",
    "creaseLengths",
    "creaseSharpnesses",
    "cornerIndices",
    "cornerSharpnesses",
];

/// A prim whose body is being read.
struct Prim<'a> {
    name: &'a [u8],
    line: usize,
    is_mesh: bool,
    /// Inside `over` or `class`, where no mesh is.
    is_abstract: bool,
    has_transform: bool,
    holds_mesh: bool,
}

/// What the mesh prim has.
#[derive(Default)]
struct Parts<'a> {
    name: &'a [u8],
    line: usize,
    points: Option<List<DVec3>>,
    counts: Option<List<u32>>,
    indices: Option<List<u32>>,
    normals: Option<List<DVec3>>,
    crease_indices: Option<List<u32>>,
    crease_lengths: Option<List<u32>>,
    crease_sharpnesses: Option<List<f64>>,
    corner_indices: Option<List<u32>>,
    corner_sharpnesses: Option<List<f64>>,
    subdivision: Option<Subdivision>,
    boundary: Option<Boundary>,
    /// What is not kept.
    primvars: usize,
    other_normals: bool,
    holes: bool,
    left_handed: bool,
    boundary_is_none: bool,
    has_transform: bool,
}

pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Loaded> {
    let mut tokens = Tokens { s: Scanner::new(bytes, path) };
    let mut found: Option<Parts> = None;
    let mut prims: Vec<Prim> = Vec::new();
    tokens.skip_space()?;
    let mut stage = StageMetadata::default();
    if tokens.peek() == Some(b'(') {
        stage = metadata(&mut tokens)?;
    }
    loop {
        tokens.skip_space()?;
        match tokens.peek() {
            None => break,
            Some(b';') => tokens.s.advance(1),
            Some(b'}') => {
                let prim = prims.pop().ok_or_else(|| tokens.unexpected("a prim: def Mesh \"name\" { … }"))?;
                tokens.s.advance(1);
                if let Some(parts) = &mut found {
                    parts.has_transform |= prim.holds_mesh && prim.has_transform;
                }
            }
            Some(_) => {
                let line = tokens.s.line();
                let wanted =
                    if prims.is_empty() { "a prim: def Mesh \"name\" { … }" } else { "a property or a prim" };
                match tokens.word(wanted)? {
                    specifier @ (b"def" | b"over" | b"class") => {
                        let prim = prim(&mut tokens, specifier, line, prims.last())?;
                        if prim.is_mesh {
                            if let Some(first) = &found {
                                let (first, at) = (quoted(first.name), first.line);
                                return Err(tokens.s.error_at(
                                    line,
                                    format!(
                                        "two meshes, {first} (line {at}) and {}: save them in a file each",
                                        quoted(prim.name)
                                    ),
                                ));
                            }
                            found = Some(Parts { name: prim.name, line, ..Parts::default() });
                            prims.iter_mut().for_each(|outer| outer.holds_mesh = true);
                        }
                        prims.push(prim);
                    }
                    b"variantSet" => {
                        tokens.skip_space()?;
                        tokens.string("the name of a set of variants, in quotes")?;
                        tokens.skip_space()?;
                        tokens.expect(b'=', "the = of a set of variants")?;
                        tokens.skip_space()?;
                        tokens.skip_value()?;
                    }
                    first => property(&mut tokens, first, prims.last_mut(), found.as_mut())?,
                }
            }
        }
    }
    if let Some(prim) = prims.last() {
        let wanted = format!("the }} that closes the prim {} of line {}", quoted(prim.name), prim.line);
        return Err(tokens.unexpected(wanted));
    }
    let none = || {
        let what =
            "no mesh in it (a prim `def Mesh`): variants are not looked into, and files that it refers to are not read";
        Error::parse(path, None, what)
    };
    found.ok_or_else(none)?.load(path, stage)
}

/// Reads the head of the file, which is in brackets. What USD does not know there is no fault of the mesh.
fn metadata(tokens: &mut Tokens) -> Result<StageMetadata> {
    let [axis, unit] = tokens.metadata([b"upAxis", b"metersPerUnit"])?;
    let meters = unit.and_then(|number| std::str::from_utf8(number).ok()?.parse::<f64>().ok());
    let is_z_up = match axis {
        Some(b"Z") => Some(true),
        Some(b"Y") => Some(false),
        _ => None,
    };
    Ok(StageMetadata { is_z_up, meters_per_unit: meters.filter(|&meters| meters > 0.0 && meters.is_finite()) })
}

/// Reads the head of a prim, up to its body.
fn prim<'a>(tokens: &mut Tokens<'a>, specifier: &[u8], line: usize, outer: Option<&Prim>) -> Result<Prim<'a>> {
    tokens.skip_space()?;
    let wanted = "the type or the name of a prim";
    let kind = if matches!(tokens.peek(), Some(b'"' | b'\'')) { b"" } else { tokens.word(wanted)? };
    tokens.skip_space()?;
    let name = tokens.string("the name of a prim, in quotes")?;
    tokens.skip_space()?;
    if tokens.peek() == Some(b'(') {
        tokens.skip_brackets()?;
        tokens.skip_space()?;
    }
    tokens.expect(b'{', format_args!("the {{ that opens the prim {}", quoted(name)))?;
    let is_abstract = specifier != b"def" || outer.is_some_and(|outer| outer.is_abstract);
    let is_mesh = kind == b"Mesh" && !is_abstract;
    Ok(Prim { name, line, is_mesh, is_abstract, has_transform: false, holds_mesh: is_mesh })
}

/// Reads a property, whose first word has been read.
fn property<'a>(
    tokens: &mut Tokens<'a>,
    first: &'a [u8],
    prim: Option<&mut Prim>,
    parts: Option<&mut Parts<'a>>,
) -> Result<()> {
    let mut word = first;
    while PREFIXES.contains(&word) {
        tokens.skip_space()?;
        word = tokens.word("the type of a property")?;
    }
    tokens.skip_space()?;
    if tokens.take(b'[') {
        tokens.skip_space()?;
        tokens.expect(b']', "the ] of a type")?;
        tokens.skip_space()?;
    }
    // `reorder nameChildren = […]` has no type.
    let name = if tokens.peek() == Some(b'=') { word } else { tokens.word("the name of a property")? };
    let mut in_mesh = false;
    if let Some(prim) = prim {
        prim.has_transform |= name.starts_with(b"xformOp:");
        in_mesh = prim.is_mesh;
    }
    tokens.skip_space()?;
    if tokens.take(b'=') {
        tokens.skip_space()?;
        let is_blocked = tokens.s.rest().starts_with(b"None");
        match parts {
            Some(parts) if in_mesh && !is_blocked => parts.property(tokens, name)?,
            _ => tokens.skip_value()?,
        }
        tokens.skip_space()?;
    }
    if tokens.peek() == Some(b'(') {
        tokens.skip_brackets()?;
    }
    Ok(())
}

impl<'a> Parts<'a> {
    /// Reads the value of a property of the mesh.
    fn property(&mut self, tokens: &mut Tokens<'a>, name: &[u8]) -> Result<()> {
        match name {
            b"points" => once(&mut self.points, tokens, "points", point),
            b"faceVertexCounts" => once(&mut self.counts, tokens, "faceVertexCounts", whole),
            b"faceVertexIndices" => once(&mut self.indices, tokens, "faceVertexIndices", whole),
            b"creaseIndices" => once(&mut self.crease_indices, tokens, "creaseIndices", whole),
            b"creaseLengths" => once(&mut self.crease_lengths, tokens, "creaseLengths", whole),
            b"creaseSharpnesses" => once(&mut self.crease_sharpnesses, tokens, "creaseSharpnesses", sharpness),
            b"cornerIndices" => once(&mut self.corner_indices, tokens, "cornerIndices", whole),
            b"cornerSharpnesses" => once(&mut self.corner_sharpnesses, tokens, "cornerSharpnesses", sharpness),
            b"normals" => self.normals(tokens),
            b"subdivisionScheme" => {
                let all = Subdivision::ALL.map(|s| (s.name(), Some(s)));
                self.subdivision = token(tokens, "subdivisionScheme", &all)?;
                Ok(())
            }
            b"interpolateBoundary" => {
                let all = [
                    ("edgeOnly", Some(Boundary::EdgeOnly)),
                    ("edgeAndCorner", Some(Boundary::EdgeAndCorner)),
                    ("none", None),
                ];
                self.boundary = token(tokens, "interpolateBoundary", &all)?;
                self.boundary_is_none = self.boundary.is_none();
                Ok(())
            }
            b"orientation" => {
                let all = [("rightHanded", false), ("leftHanded", true)];
                self.left_handed = token(tokens, "orientation", &all)?;
                Ok(())
            }
            b"holeIndices" => {
                self.holes = true;
                tokens.skip_value()
            }
            _ => {
                if let Some(of) = name.strip_suffix(b".timeSamples")
                    && let Some(list) = LISTS.iter().find(|list| list.as_bytes() == of)
                {
                    return Err(tokens.s.error(format!("{list} are given over time (timeSamples): save one frame")));
                }
                self.primvars += usize::from(name.starts_with(b"primvars:") && !name.ends_with(b":indices"));
                tokens.skip_value()
            }
        }
    }

    /// Reads normals if they are one a vertex, which their metadata tell after them.
    fn normals(&mut self, tokens: &mut Tokens<'a>) -> Result<()> {
        let mut place = tokens.clone();
        tokens.skip_value()?;
        tokens.skip_space()?;
        let [interpolation] = if tokens.peek() == Some(b'(') { tokens.metadata([b"interpolation"])? } else { [None] };
        match interpolation {
            None | Some(b"vertex" | b"varying") => once(&mut self.normals, &mut place, "normals", point),
            Some(_) => {
                self.other_normals = true;
                Ok(())
            }
        }
    }

    fn load(mut self, path: &Path, stage: StageMetadata) -> Result<Loaded> {
        let at = |line, what| Error::parse(path, Some(line), what);
        let line = self.line;
        let lacks = |what: &str| at(line, format!("the mesh {} has no {what}", quoted(self.name)));
        let points = self.points.take().ok_or_else(|| lacks("points"))?;
        let counts = self.counts.take().ok_or_else(|| lacks("faceVertexCounts"))?;
        let indices = self.indices.take().ok_or_else(|| lacks("faceVertexIndices"))?;
        let total: u64 = counts.values.iter().map(|&size| u64::from(size)).sum();
        if total != indices.values.len() as u64 {
            let what = format!(
                "faceVertexCounts add up to {total}, and faceVertexIndices (line {}) has {} values",
                indices.line,
                indices.values.len()
            );
            return Err(at(counts.line, what));
        }
        let mut offsets = Vec::with_capacity(counts.values.len() + 1);
        offsets.push(0u32);
        let mut end = 0;
        for (f, &size) in counts.values.iter().enumerate() {
            if size < 3 {
                return Err(at(counts.line_of(f), few_corners(f, size as usize)));
            }
            // Within the number of indices, which 32 bits hold.
            end += size;
            offsets.push(end);
        }
        let tags = FileTags {
            boundary: self.boundary,
            creases: self.creases(path, points.values.len())?,
            corners: self.corners(path, points.values.len())?,
        };
        let normals = self.normals.take().filter(|normals| {
            let fit = normals.values.len() == points.values.len();
            self.other_normals |= !fit;
            fit
        });
        let starts = offsets[..counts.values.len()].iter().map(|&start| start as usize);
        let lines = Lines { vertices: points.lines_of(0..points.values.len()), faces: indices.lines_of(starts) };
        let remarks = self.remarks();
        Ok(Loaded {
            name: path.display().to_string(),
            mesh: Mesh::new(points.values, Faces::from_parts(offsets, indices.values)),
            lines: Some(lines),
            normals: normals.map(|list| list.values),
            attributes: Attributes::default(),
            stage,
            tags,
            subdivision: self.subdivision,
            checksum: None,
            remarks,
        })
    }

    fn creases(&mut self, path: &Path, vertices: usize) -> Result<Vec<CreaseTag>> {
        let at = |line, what| Err(Error::parse(path, Some(line), what));
        let indices = self.crease_indices.take().unwrap_or_else(|| List::empty(self.line));
        let lengths = self.crease_lengths.take().unwrap_or_else(|| List::empty(indices.line));
        let sharpnesses = self.crease_sharpnesses.take().unwrap_or_else(|| List::empty(indices.line));
        if let Some(k) = lengths.values.iter().position(|&length| length < 2) {
            let what = format!("crease {k} has the length {}: an edge needs two vertices", lengths.values[k]);
            return at(lengths.line_of(k), what);
        }
        let total: u64 = lengths.values.iter().map(|&length| u64::from(length)).sum();
        if total != indices.values.len() as u64 {
            let what = format!(
                "creaseLengths add up to {total}, and creaseIndices (line {}) has {} values",
                indices.line,
                indices.values.len()
            );
            return at(lengths.line, what);
        }
        let (chains, edges) = (lengths.values.len(), indices.values.len() - lengths.values.len());
        let given = sharpnesses.values.len();
        if given != chains && given != edges {
            let what = format!(
                "creaseSharpnesses has {given} values: one for each of the {chains} creases, or of their {edges} edges, \
                 is needed"
            );
            return at(sharpnesses.line, what);
        }
        check_indices(&indices, "creaseIndices", path, vertices)?;
        let mut creases = Vec::with_capacity(edges);
        let mut start = 0;
        for (chain, &length) in lengths.values.iter().enumerate() {
            for k in start..start + length as usize - 1 {
                let ends = [indices.values[k], indices.values[k + 1]];
                let sharpness = sharpnesses.values[if given == chains { chain } else { creases.len() }];
                let line = u32::try_from(indices.line_of(k)).unwrap_or(u32::MAX);
                creases.push(CreaseTag { ends, sharpness, line });
            }
            start += length as usize;
        }
        Ok(creases)
    }

    fn corners(&mut self, path: &Path, vertices: usize) -> Result<Vec<CornerTag>> {
        let indices = self.corner_indices.take().unwrap_or_else(|| List::empty(self.line));
        let sharpnesses = self.corner_sharpnesses.take().unwrap_or_else(|| List::empty(indices.line));
        let (given, wanted) = (sharpnesses.values.len(), indices.values.len());
        if given != wanted {
            let what = format!("cornerSharpnesses has {given} values, and cornerIndices {wanted}: one each is needed");
            return Err(Error::parse(path, Some(sharpnesses.line), what));
        }
        check_indices(&indices, "cornerIndices", path, vertices)?;
        let lines = indices.lines_of(0..wanted);
        let corners = indices.values.iter().zip(&sharpnesses.values).zip(lines);
        Ok(corners.map(|((&vertex, &sharpness), line)| CornerTag { vertex, sharpness, line }).collect())
    }

    fn remarks(&self) -> Vec<String> {
        let mut not_kept = Vec::new();
        if self.primvars > 0 {
            not_kept.push(format!("{} primvars", self.primvars));
        }
        for (is_there, what) in [
            (self.other_normals, "normals that are not one a vertex"),
            (self.holes, "holes (holeIndices)"),
            (self.left_handed, "the left-handed orientation, in which faces run clockwise"),
        ] {
            if is_there {
                not_kept.push(what.into());
            }
        }
        let mut remarks = Vec::new();
        if !not_kept.is_empty() {
            remarks.push(format!("not kept: {}", not_kept.join(", ")));
        }
        if self.has_transform {
            remarks.push("transforms (xformOp) are not applied: the points are in the mesh's own coordinates".into());
        }
        if self.boundary_is_none {
            remarks.push(
                "interpolateBoundary is none, by which faces at a boundary have no surface: another rule is taken"
                    .into(),
            );
        }
        remarks
    }
}

/// Reads a list that may be given once.
fn once<'a, T>(
    slot: &mut Option<List<T>>,
    tokens: &mut Tokens<'a>,
    name: &str,
    item: fn(&mut Tokens<'a>, &str, usize) -> Result<T>,
) -> Result<()> {
    if slot.is_some() {
        return Err(tokens.s.error(format!("{name} are given twice: keep one of them")));
    }
    *slot = Some(tokens.list(name, |tokens, k| item(tokens, name, k))?);
    Ok(())
}

fn point(tokens: &mut Tokens, name: &str, k: usize) -> Result<DVec3> {
    let row = |tokens: &Tokens| tokens.unexpected(format_args!("the point (x, y, z) of {name} at place {k}"));
    let mut point = DVec3::ZERO;
    for (axis, before) in [(0, b'('), (1, b','), (2, b',')] {
        if !tokens.take(before) {
            return Err(row(tokens));
        }
        tokens.skip_space()?;
        point[axis] = tokens.s.number_in_list().ok_or_else(|| {
            tokens.unexpected(format_args!("the coordinate {} of {name} at place {k}", ["x", "y", "z"][axis]))
        })?;
        tokens.skip_space()?;
    }
    if tokens.take(b')') { Ok(point) } else { Err(row(tokens)) }
}

fn whole(tokens: &mut Tokens, name: &str, k: usize) -> Result<u32> {
    let refuse = |tokens: &Tokens| tokens.unexpected(format_args!("the whole number of {name} at place {k}"));
    tokens.s.unsigned_in_list().ok_or_else(|| refuse(tokens))
}

fn sharpness(tokens: &mut Tokens, name: &str, k: usize) -> Result<f64> {
    let number = tokens.s.clone().number_in_list();
    let number = number.ok_or_else(|| tokens.unexpected(format_args!("the number of {name} at place {k}")))?;
    check_sharpness(number).map_err(|what| tokens.s.error(format!("{name} has at place {k} {what}")))?;
    tokens.s.number_in_list();
    Ok(number)
}

/// Reads one of the names in quotes.
fn token<T: Copy>(tokens: &mut Tokens, property: &str, all: &[(&'static str, T)]) -> Result<T> {
    let line = tokens.s.line();
    let found = tokens.string(format_args!("the value of {property}, in quotes"))?;
    let known = all.iter().find(|(name, _)| name.as_bytes() == found);
    known.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|&(name, _)| name).collect();
        tokens.s.error_at(line, format!("{} is no {property}: use {}", quoted(found), one_of(&names)))
    })
}

fn check_indices(indices: &List<u32>, name: &str, path: &Path, vertices: usize) -> Result<()> {
    match indices.values.iter().position(|&v| v as usize >= vertices) {
        Some(k) => {
            let what = format!("{name}: {}", not_there(indices.values[k], vertices));
            Err(Error::parse(path, Some(indices.line_of(k)), what))
        }
        None => Ok(()),
    }
}
