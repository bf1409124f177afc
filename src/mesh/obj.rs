//! Wavefront OBJ: `v` and `f` in file order, so that a control mesh can replace its input vertex for vertex.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::Mesh;
use super::attributes::{Attributes, CornerLines, STATEMENTS};
use super::builder::Builder;
use super::features::Tags;
use super::file_tags::{CornerTag, CreaseTag, FileTags, check_sharpness};
use super::io::{Lines, Loaded, WriteOptions, check_normals, write_rows};
use super::magic::other_kind;
use super::validate::Boundary;
use crate::error::counted;
use crate::text::parts::{PART, at_once, write_in_parts};
use crate::text::{Scanner, continues_line, leading_digits, push_number, push_point, push_unsigned};
use crate::{Error, Result, parallel};

/// Statements that are read over, by what they are about.
const DROPPED: [(&str, &[&[u8]]); 4] = [
    ("lines (l)", &[b"l"]),
    ("points (p)", &[b"p"]),
    ("tags that are not of sharpness (t)", &[b"t"]),
    (
        "free-form and display statements",
        &[
            b"vp",
            b"cstype",
            b"deg",
            b"bmat",
            b"step",
            b"curv",
            b"curv2",
            b"surf",
            b"parm",
            b"trim",
            b"hole",
            b"scrv",
            b"sp",
            b"end",
            b"con",
            b"mg",
            b"bevel",
            b"c_interp",
            b"d_interp",
            b"lod",
            b"shadow_obj",
            b"trace_obj",
            b"ctech",
            b"stech",
        ],
    ),
];

/// Statements that end with a name.
const NAMES: [&[u8]; 6] = [b"g", b"o", b"usemtl", b"mtllib", b"usemap", b"maplib"];

/// Reads the bytes of an OBJ file; `path` is for messages.
///
/// Corners may be `v`, `v/vt`, `v//vn`, `v/vt/vn`, and negative to count back from the last vertex read so far; a
/// backslash continues a statement of numbers, but no name, for Windows paths may end with it. Kept are, as
/// [tags](FileTags), OpenSubdiv's of sharpness (vertices from 0 there), `t crease 2/1/0 a b sharpness`,
/// `t corner 1/1/0 v sharpness` and `t interpolateboundary 1/0/0 k` (k: 0 none, 1 edge and corner, 2 edge only), of which a
/// line may hold several edges or vertices, with a sharpness for all or one each; and, as [`Attributes`], `vt` and `vn` with
/// the corners that refer to them, `g`, `o`, `s`, `usemtl` and `mtllib`. One remark names with counts what the mesh does not
/// keep: all other statements; weights and colours after coordinates. Another tells if the last line has no end, for an OBJ
/// file announces no counts by which a cut could be noticed.
///
/// # Errors
/// [`Error::Parse`] with the line: another kind of file; a coordinate that is no number, a corner that is none or that reaches before the
/// first vertex, a face of fewer than three corners; a tag of sharpness of another form, of a vertex that there is not, or
/// a negative one; a file without any vertex.
///
/// ```
/// use limitlab::mesh::obj::read_bytes;
/// let loaded = read_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -1\n", "a.obj".as_ref())?;
/// assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
/// assert_eq!(loaded.lines.unwrap().faces, [4]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    read_in_parts(bytes, path, PART)
}

/// As [`read_bytes`], in parts of about `size` bytes.
pub(super) fn read_in_parts(bytes: &[u8], path: &Path, size: usize) -> Result<Loaded> {
    check_kind(bytes, path)?;
    let mut s = Scanner::new(bytes, path);
    let mut file = Part::default();
    let mut spare: Vec<Part> = Vec::new();
    while !s.at_end() {
        // All parts are read as if they were the first.
        let start = Place { line: s.line(), counts: file.counts() };
        let places = s.parts(size, at_once());
        let mut tasks = Vec::with_capacity(places.len());
        for s in &places {
            let mut part = spare.pop().unwrap_or_default();
            part.begin(start);
            tasks.push(Task { s: s.clone(), part, start, result: Ok(()) });
        }
        parallel::chunks(&mut tasks, 1, |_, task| task[0].read());
        // Where they start is known now, up to one that is refused, and it matters to some.
        let mut next = start;
        for task in &mut tasks {
            task.start = next;
            next.line += task.s.line() - start.line;
            let counts = task.part.counts();
            next.counts = [0, 1, 2, 3, 4].map(|k| next.counts[k] + counts[k] - start.counts[k]);
        }
        let last = tasks.iter().position(|task| task.result.is_err()).map_or(tasks.len(), |k| k + 1);
        tasks.truncate(last);
        let is_too_large = next.counts.iter().any(|&count| count > u32::MAX as usize);
        parallel::chunks(&mut tasks, 1, |k, task| {
            let task = &mut task[0];
            if task.start != start && (task.part.needs_place || task.result.is_err() || is_too_large) {
                task.s = places[k].clone().at_line(task.start.line);
                task.part.begin(task.start);
                task.read();
            }
        });
        for task in &mut tasks {
            std::mem::replace(&mut task.result, Ok(()))?;
        }
        let left = s.rest().len();
        if let Some(Task { s: end, part, start, .. }) = tasks.last() {
            let line = start.line + end.line() - part.start.line;
            s.follow(&end.clone().at_line(line));
        }
        file.append(&mut tasks, left as f64 / (left - s.rest().len()) as f64);
        spare.extend(tasks.into_iter().map(|task| task.part));
    }
    file.finish(&s, path)
}

/// A place in a file: its line, and of what comes before the vertices, faces, corners, texture coordinates and normals.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Place {
    line: usize,
    counts: [usize; 5],
}

/// The reading of a part.
struct Task<'a> {
    /// Where it has come to.
    s: Scanner<'a>,
    part: Part,
    /// Where the part starts, as far as that is known.
    start: Place,
    result: Result<()>,
}

impl Task<'_> {
    fn read(&mut self) {
        self.result = self.part.read(&mut self.s);
    }
}

/// What was read of a file, or of a part of it.
struct Part {
    /// Where it starts, or what was taken for that.
    start: Place,
    builder: Builder,
    oddities: Oddities,
    tags: TagLines,
    attributes: Attributes,
    /// Whether what was read depends on the place: numbers that count back, lines that are named.
    needs_place: bool,
}

impl Default for Part {
    fn default() -> Self {
        Part {
            start: Place { line: 1, counts: [0; 5] },
            builder: Builder::new(Some(Lines::default())),
            oddities: Oddities::default(),
            tags: TagLines::default(),
            attributes: Attributes::default(),
            needs_place: false,
        }
    }
}

impl Part {
    /// Forgets what was read, to read what starts there.
    fn begin(&mut self, start: Place) {
        let [vertices, faces, corners, texture, normals] = start.counts;
        self.builder.begin_part([vertices, faces, corners]);
        self.attributes.texture.begin_part(texture);
        self.attributes.normals.begin_part(normals);
        self.attributes.statements.clear();
        self.tags = TagLines::default();
        self.oddities = Oddities::default();
        self.needs_place = false;
        self.start = start;
    }

    /// Those of the [`Place`] after what was read.
    fn counts(&self) -> [usize; 5] {
        let [vertices, faces, corners] = self.builder.counts();
        let [_, _, _, texture, normals] = self.start.counts;
        [vertices, faces, corners, texture + self.attributes.texture.len(), normals + self.attributes.normals.len()]
    }

    /// Reads all statements.
    fn read(&mut self, s: &mut Scanner) -> Result<()> {
        loop {
            s.skip_space();
            skip_blanks(s);
            let line = s.line();
            let at = |s: &Scanner, what| s.error_at(line, what);
            let is_plain = match s.rest() {
                [b'v', b' ', ..] => self.plain_vertex(s),
                [b'f', b' ', ..] => self.plain_face(s),
                [b'v', b't', b' ', ..] => plain_line(s, &mut self.attributes.texture),
                [b'v', b'n', b' ', ..] => plain_line(s, &mut self.attributes.normals),
                _ => false,
            };
            if is_plain {
                continue;
            }
            if s.at_end() {
                return Ok(());
            }
            if s.at_line_end() {
                continue;
            }
            match s.peek_token() {
                b"v" => {
                    s.advance(1);
                    let vertex = self.builder.vertices();
                    let position = coordinates(s, vertex)?;
                    match more_numbers(s, vertex)? {
                        (0, _) => {}
                        (1, weight) => {
                            self.oddities.weighted += 1;
                            self.oddities.unequal += usize::from(weight != 1.0);
                        }
                        _ => self.oddities.coloured += 1,
                    }
                    self.builder.vertex(position, line).map_err(|what| at(s, what))?;
                }
                b"f" => {
                    s.advance(1);
                    loop {
                        skip_blanks(s);
                        if s.at_line_end() {
                            break;
                        }
                        self.corner(s)?;
                    }
                    self.builder.end_face(line).map_err(|what| at(s, what))?;
                }
                b"t" if is_sharpness(s) => {
                    s.advance(1);
                    self.tags.read(s, line)?;
                }
                keyword => self.other_statement(s, keyword),
            }
        }
    }

    /// Reads the vertex here if it is three plain numbers on one line, as nearly all are; otherwise the place stays.
    fn plain_vertex(&mut self, s: &mut Scanner) -> bool {
        let Some((point, length)) = s.plain_point(1) else { return false };
        let is_read = self.builder.vertex(point, s.line()).is_ok();
        s.advance(if is_read { length } else { 0 });
        is_read
    }

    /// Reads the face here if its corners are plain numbers on one line, as nearly all are; otherwise the place stays.
    fn plain_face(&mut self, s: &mut Scanner) -> bool {
        let first = self.builder.corners();
        if let Some(length) = self.plain_corners(s.rest(), s.line()) {
            s.advance(length);
            return true;
        }
        self.builder.forget_corners(first);
        self.attributes.texture.forget_corners(first);
        self.attributes.normals.forget_corners(first);
        false
    }

    /// Reads the corners of a face after its `f`, and gives the length of all. What is not plain gives `None`, in the midst
    /// of it.
    fn plain_corners(&mut self, face: &[u8], line: usize) -> Option<usize> {
        let mut at = 1;
        loop {
            while face.get(at) == Some(&b' ') {
                at += 1;
            }
            if matches!(face.get(at)?, b'\n' | b'\r') {
                return self.builder.end_face(line).is_ok().then_some(at);
            }
            let vertex = plain_index(face, &mut at)?;
            if face.get(at) == Some(&b'/') {
                at += 1;
                let corner = self.builder.corners();
                if face.get(at) != Some(&b'/') {
                    self.attributes.texture.refer(corner, plain_index(face, &mut at)?.into());
                }
                if face.get(at) == Some(&b'/') {
                    at += 1;
                    self.attributes.normals.refer(corner, plain_index(face, &mut at)?.into());
                }
            }
            if !matches!(face.get(at)?, b' ' | b'\n' | b'\r') {
                return None;
            }
            self.builder.corner(vertex - 1);
        }
    }

    /// Reads one corner of the present face.
    fn corner(&mut self, s: &mut Scanner) -> Result<()> {
        let is_back = s.peek() == Some(b'-');
        let (vertex, references) = corner(s, &self.builder)?;
        let corner = self.builder.corners();
        let references = if references.is_empty() { [None; 2] } else { parsed(references) };
        for (lines, reference) in
            [&mut self.attributes.texture, &mut self.attributes.normals].into_iter().zip(references)
        {
            if let Some(reference) = reference {
                lines.refer(corner, reference);
            }
        }
        self.needs_place |= is_back || references.iter().flatten().any(|&reference| reference < 0);
        self.builder.corner(vertex);
        Ok(())
    }

    fn other_statement(&mut self, s: &mut Scanner, keyword: &[u8]) {
        let unexpected = s.clone();
        let (statement, ends_with_backslash) = skip_statement(s, keyword);
        if ends_with_backslash {
            self.oddities.not_continued.get_or_insert(unexpected.line());
            self.needs_place = true;
        }
        match (keyword, kind_of(keyword)) {
            (b"vt", _) => self.attributes.texture.push(statement),
            (b"vn", _) => self.attributes.normals.push(statement),
            (_, Some(Kind::Kept)) => {
                self.attributes.statements.push((self.builder.faces() as u32, statement.into()));
            }
            (_, Some(Kind::Dropped(kind))) => self.oddities.dropped[kind] += 1,
            (_, None) => {
                match &mut self.oddities.unknown {
                    Some((count, _)) => *count += 1,
                    None => self.oddities.unknown = Some((1, unexpected.unexpected("an OBJ statement"))),
                }
                self.needs_place = true;
            }
        }
    }

    /// Adds the parts that follow, and makes room for `times` as much.
    fn append(&mut self, tasks: &mut [Task], times: f64) {
        let mut corners = self.builder.corners();
        for Task { part, start, .. } in &mut *tasks {
            let lines = (start.line - part.start.line) as u32;
            let faces = (start.counts[1] - part.start.counts[1]) as u32;
            self.attributes.append(&part.attributes, corners, faces);
            self.tags.append(&part.tags, lines);
            self.oddities.append(&mut part.oddities);
            corners += part.builder.corners();
        }
        let builders: Vec<&Builder> = tasks.iter().map(|task| &task.part.builder).collect();
        let lines: Vec<usize> = tasks.iter().map(|task| task.start.line - task.part.start.line).collect();
        assert!(self.builder.append(&builders, &lines, times), "the parts are within the limits");
    }

    /// The mesh of the file, at whose end `s` is.
    fn finish(mut self, s: &Scanner, path: &Path) -> Result<Loaded> {
        if self.builder.vertices() == 0 {
            let (_, none) = self.oddities.unknown.unwrap_or_else(|| (0, s.unexpected("a vertex (v x y z)")));
            return Err(none);
        }
        let corners = self.builder.corners();
        self.oddities.missing = self.attributes.texture.finish(corners) + self.attributes.normals.finish(corners);
        self.oddities.is_cut_off = s.ends_within_a_line();
        self.oddities.boundary_is_none = self.tags.rule == Some(None);
        self.tags.found.boundary = self.tags.rule.flatten();
        self.tags.found.check_vertices(path, self.builder.vertices())?;
        let loaded = self.builder.finish(path, None, self.oddities.remarks());
        Ok(Loaded { tags: self.tags.found, attributes: self.attributes, ..loaded })
    }
}

/// Keeps the line here if no backslash is in it; otherwise the place stays.
fn plain_line(s: &mut Scanner, lines: &mut CornerLines) -> bool {
    let rest = s.rest();
    let end = memchr::memchr3(b'\n', b'\r', b'\\', rest);
    let Some(length) = end.filter(|&end| rest[end] != b'\\') else { return false };
    lines.push(rest[..length].trim_ascii_end());
    s.advance(length);
    true
}

/// The whole number from 1 on here, of no more than nine digits, which is passed over.
fn plain_index(bytes: &[u8], at: &mut usize) -> Option<u32> {
    let start = *at;
    let mut number = 0u32;
    while let Some(digit @ b'0'..=b'9') = bytes.get(*at) {
        number = number.wrapping_mul(10).wrapping_add(u32::from(digit - b'0'));
        *at += 1;
    }
    (*at - start <= 9 && number > 0).then_some(number)
}

/// What a file holds that its mesh does not keep, or that is odd.
#[derive(Default)]
struct Oddities {
    dropped: [usize; DROPPED.len()],
    weighted: usize,
    /// Of the weights those that are not 1.
    unequal: usize,
    coloured: usize,
    /// How many statements are unknown, and the first of them.
    unknown: Option<(usize, Error)>,
    /// The first line with a backslash that continues nothing.
    not_continued: Option<usize>,
    boundary_is_none: bool,
    is_cut_off: bool,
    missing: usize,
}

impl Oddities {
    /// Adds those of the part that follows.
    fn append(&mut self, next: &mut Oddities) {
        self.dropped.iter_mut().zip(next.dropped).for_each(|(sum, count)| *sum += count);
        self.weighted += next.weighted;
        self.unequal += next.unequal;
        self.coloured += next.coloured;
        match (&mut self.unknown, next.unknown.take()) {
            (Some((sum, _)), Some((count, _))) => *sum += count,
            (None, first) => self.unknown = first,
            (Some(_), None) => {}
        }
        self.not_continued = self.not_continued.or(next.not_continued);
    }

    /// One for each kind that occurs.
    fn remarks(self) -> Vec<String> {
        let mut not_kept: Vec<String> = DROPPED
            .iter()
            .zip(self.dropped)
            .filter(|&(_, count)| count > 0)
            .map(|((what, _), count)| format!("{count} {what}"))
            .collect();
        if self.weighted > 0 {
            let unequal = if self.unequal > 0 {
                format!(" ({} not 1: the coordinates are not divided by them)", self.unequal)
            } else {
                String::new()
            };
            not_kept.push(format!("weights of {}{unequal}", counted(self.weighted, "vertex")));
        }
        if self.coloured > 0 {
            not_kept.push(format!("colours of {}", counted(self.coloured, "vertex")));
        }
        let mut remarks = Vec::new();
        if !not_kept.is_empty() {
            remarks.push(format!("not kept: {}", not_kept.join(", ")));
        }
        if let Some((count, first)) = self.unknown {
            remarks.push(format!("{} passed over, the first at {first}", counted(count, "unknown statement")));
        }
        if let Some(line) = self.not_continued {
            remarks.push(format!(
                "a backslash ends line {line}, whose statement is not one of numbers: the next line is read for itself"
            ));
        }
        if self.boundary_is_none {
            remarks.push(
                "the tag interpolateboundary is 0, by which faces at a boundary have no surface: another rule is taken"
                    .into(),
            );
        }
        if self.is_cut_off {
            remarks.push("the last line has no end: was the file cut off?".into());
        }
        if self.missing > 0 {
            remarks.push(format!(
                "{} of corners to texture coordinates or normals that the file lacks",
                counted(self.missing, "reference")
            ));
        }
        remarks
    }
}

/// Refuses the first bytes of a file, whole lines, if all that they hold is no OBJ.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    check_kind(head, path)?;
    let mut s = Scanner::of_head(head, path);
    s.skip_space();
    let first = s.unexpected("an OBJ statement");
    while !s.at_end() {
        let keyword = s.token();
        if is_known(keyword) {
            return Ok(());
        }
        s.skip_line();
        s.skip_space();
        if s.at_end() {
            return Err(first);
        }
    }
    Ok(())
}

fn check_kind(bytes: &[u8], path: &Path) -> Result<()> {
    match other_kind(bytes) {
        Some(what) => Err(Error::parse(path, None, format!("not an OBJ file: {what}"))),
        None => Ok(()),
    }
}

/// A statement that is not one of geometry.
enum Kind {
    /// By [`Attributes`].
    Kept,
    /// Which of [`DROPPED`] it is.
    Dropped(usize),
}

fn kind_of(keyword: &[u8]) -> Option<Kind> {
    let is_kept = matches!(keyword, b"vt" | b"vn") || STATEMENTS.iter().any(|(_, words)| words.contains(&keyword));
    if is_kept {
        return Some(Kind::Kept);
    }
    DROPPED.iter().position(|(_, words)| words.contains(&keyword)).map(Kind::Dropped)
}

fn is_known(keyword: &[u8]) -> bool {
    matches!(keyword, b"v" | b"f") || kind_of(keyword).is_some()
}

/// Skips blanks, over line ends that a backslash continues.
pub(super) fn skip_blanks(s: &mut Scanner) {
    s.skip_blanks();
    while continues_line(s.rest()) {
        s.advance(1);
        s.skip_line_break();
        s.skip_blanks();
    }
}

/// Skips what is left of a statement: its line, and those that continue it. Only statements of numbers are continued.
/// Gives the text without the end of its line, and whether a backslash ends it that continues nothing.
pub(super) fn skip_statement<'a>(s: &mut Scanner<'a>, keyword: &[u8]) -> (&'a [u8], bool) {
    let continues = is_known(keyword) && !NAMES.contains(&keyword);
    let whole = s.rest();
    loop {
        let start = s.rest();
        s.skip_to_line_end();
        let line = &start[..start.len() - s.rest().len()];
        let text = &whole[..whole.len() - s.rest().len()];
        s.skip_line_break();
        let has_backslash = line.last() == Some(&b'\\');
        // At the end of the file there is no line that it could continue with.
        if !continues || !has_backslash || s.at_end() {
            let text = if continues { text.strip_suffix(b"\\").unwrap_or(text) } else { text };
            return (text.trim_ascii_end(), has_backslash && !continues);
        }
    }
}

/// Whether the tag here is one of sharpness.
fn is_sharpness(s: &Scanner) -> bool {
    let mut place = s.clone();
    place.advance(1);
    skip_blanks(&mut place);
    matches!(place.peek_token(), b"crease" | b"corner" | b"interpolateboundary")
}

/// The tags of sharpness read so far, with the numbers of the present one.
#[derive(Default)]
struct TagLines {
    found: FileTags,
    /// The last rule of the boundary, `None` within for 0.
    rule: Option<Option<Boundary>>,
    whole: Vec<u32>,
    numbers: Vec<f64>,
}

impl TagLines {
    /// Adds the tags that follow, and `lines` to their lines.
    fn append(&mut self, next: &TagLines, lines: u32) {
        let shifted = |line: u32| line.saturating_add(lines);
        let FileTags { creases, corners, .. } = &mut self.found;
        creases.extend(next.found.creases.iter().map(|tag| CreaseTag { line: shifted(tag.line), ..*tag }));
        corners.extend(next.found.corners.iter().map(|tag| CornerTag { line: shifted(tag.line), ..*tag }));
        self.rule = next.rule.or(self.rule);
    }

    /// Reads a tag of sharpness from its name on.
    fn read(&mut self, s: &mut Scanner, line: usize) -> Result<()> {
        skip_blanks(s);
        let name = s.token();
        let of = String::from_utf8_lossy(name);
        skip_blanks(s);
        let refuse = || s.unexpected(format_args!("how many numbers the tag {of} has, such as 2/1/0"));
        let [whole, numbers, words] = tag_counts(s.peek_token()).ok_or_else(refuse)?;
        s.token();
        self.whole.clear();
        self.numbers.clear();
        for k in 0..whole {
            skip_blanks(s);
            let refuse = |s: &Scanner| s.unexpected(format_args!("whole number {} of {whole} of the tag {of}", k + 1));
            let number = s.unsigned();
            self.whole.push(number.ok_or_else(|| refuse(s))?);
        }
        for k in 0..numbers {
            skip_blanks(s);
            let number = s.number();
            let refuse = |s: &Scanner| s.unexpected(format_args!("sharpness {} of {numbers} of the tag {of}", k + 1));
            let number = number.ok_or_else(|| refuse(s))?;
            check_sharpness(number).map_err(|what| s.error(format!("the tag {of} has {what}")))?;
            self.numbers.push(number);
        }
        let mut skipped = 0;
        skip_blanks(s);
        while skipped < words && !s.at_line_end() {
            s.token();
            skip_blanks(s);
            skipped += 1;
        }
        if !s.at_line_end() {
            return Err(
                s.unexpected(format_args!("the end of the tag {of}, which has {whole}/{numbers}/{words} values"))
            );
        }
        let each = match name {
            b"crease" => 2,
            _ => 1,
        };
        let items = self.whole.len() / each;
        let is_rule = name == b"interpolateboundary";
        let fits = self.whole.len().is_multiple_of(each)
            && if is_rule { (items, self.numbers.len()) == (1, 0) } else { [1, items].contains(&self.numbers.len()) };
        if !fits || items == 0 {
            let form = match name {
                b"crease" => "`t crease 2/1/0 a b sharpness`, or 2n/n/0",
                b"corner" => "`t corner 1/1/0 vertex sharpness`, or n/n/0",
                _ => "`t interpolateboundary 1/0/0 rule`",
            };
            return Err(
                s.error_at(line, format!("the tag {of} has {whole}/{numbers}/{words} values: the form is {form}"))
            );
        }
        if is_rule {
            let rule = match self.whole[0] {
                0 => None,
                1 => Some(Boundary::EdgeAndCorner),
                2 => Some(Boundary::EdgeOnly),
                other => {
                    let what = "is no interpolateboundary: use 0 (none), 1 (edge and corner) or 2 (edge only)";
                    return Err(s.error_at(line, format!("{other} {what}")));
                }
            };
            self.rule = Some(rule);
            return Ok(());
        }
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        for (k, vertices) in self.whole.chunks_exact(each).enumerate() {
            let sharpness = self.numbers[if self.numbers.len() == 1 { 0 } else { k }];
            match *vertices {
                [a, b] => self.found.creases.push(CreaseTag { ends: [a, b], sharpness, line }),
                [vertex] => self.found.corners.push(CornerTag { vertex, sharpness, line }),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The three counts of a tag: whole numbers, numbers, words.
fn tag_counts(token: &[u8]) -> Option<[u32; 3]> {
    let mut parts = std::str::from_utf8(token).ok()?.split('/').map(|part| part.parse().ok());
    let counts = [parts.next()??, parts.next()??, parts.next()??];
    parts.next().is_none().then_some(counts)
}

fn coordinates(s: &mut Scanner, vertex: usize) -> Result<DVec3> {
    let mut position = DVec3::ZERO;
    for axis in 0..3 {
        skip_blanks(s);
        position[axis] = s.number().ok_or_else(|| {
            let name = ["x", "y", "z"][axis];
            s.unexpected(format_args!("coordinate {name} of vertex {vertex}"))
        })?;
    }
    Ok(position)
}

/// Passes over the numbers after the coordinates of a vertex: how many, and the first.
fn more_numbers(s: &mut Scanner, vertex: usize) -> Result<(usize, f64)> {
    let (mut count, mut first) = (0, 0.0);
    loop {
        skip_blanks(s);
        if s.at_line_end() {
            return Ok((count, first));
        }
        let number = s.number().ok_or_else(|| s.unexpected(format_args!("a weight or colour of vertex {vertex}")))?;
        if count == 0 {
            first = number;
        }
        count += 1;
    }
}

/// One corner of the face being read: the vertex it names, and what follows, `/vt/vn`.
fn corner<'a>(s: &mut Scanner<'a>, builder: &Builder) -> Result<(u32, &'a [u8])> {
    let token = s.peek_token();
    let refuse = || {
        let face = builder.faces();
        s.unexpected(format_args!(
            "a corner of face {face} (v, v/vt, v//vn or v/vt/vn, counted from 1 or back from -1)"
        ))
    };
    let negative = token.first() == Some(&b'-');
    let digits = &token[usize::from(negative)..];
    let (number, length) = leading_digits(digits).ok_or_else(refuse)?;
    let references = &digits[length..];
    let plain = references.is_empty()
        || references[0] == b'/' && references.iter().all(|b| matches!(b, b'0'..=b'9' | b'/' | b'-'));
    if number == 0 || !plain {
        return Err(refuse());
    }
    let vertex = if negative {
        (builder.vertices() as u64).checked_sub(number).ok_or_else(|| {
            s.error(format!(
                "corner -{number} of face {} reaches before the first of the {} vertices read so far",
                builder.faces(),
                builder.vertices()
            ))
        })?
    } else {
        number - 1
    };
    let vertex = u32::try_from(vertex).map_err(|_| refuse())?;
    s.advance(token.len());
    Ok((vertex, references))
}

/// The numbers of texture coordinates and normal in `/vt`, `//vn` or `/vt/vn`.
pub(super) fn parsed(references: &[u8]) -> [Option<i64>; 2] {
    let mut parts = references.split(|&b| b == b'/').skip(1);
    [(); 2].map(|()| std::str::from_utf8(parts.next()?).ok()?.parse().ok())
}

/// Writes `mesh` as OBJ: `v` lines, `vn` lines if there are `normals` (one a vertex), `f` lines.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_control_to(out, mesh, &WriteOptions { normals, ..WriteOptions::default() })
}

/// As [`write_to`], with tags of sharpness, and with attributes as their file had them; `normals` take the place of those at
/// its corners.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_control_to(out: &mut dyn Write, mesh: &Mesh, options: &WriteOptions) -> io::Result<()> {
    let &WriteOptions { normals, tags, attributes, .. } = options;
    check_normals(mesh, normals);
    let none = Attributes::default();
    let attributes = attributes.unwrap_or(&none);
    options.write_comments(out, "#")?;
    write_rows(out, mesh.len(), |text, v| {
        text.extend_from_slice(b"v ");
        push_point(text, mesh.positions[v]);
    })?;
    attributes.texture.write_to(out)?;
    if let Some(normals) = normals {
        write_rows(out, normals.len(), |text, v| {
            text.extend_from_slice(b"vn ");
            push_point(text, normals[v]);
        })?;
    } else {
        attributes.normals.write_to(out)?;
    }
    let statements = &attributes.statements[..];
    write_in_parts(out, mesh.faces.len(), &|range, text| {
        let mut next = statements.partition_point(|(face, _)| (*face as usize) < range.start);
        for f in range {
            while let Some((_, statement)) = statements.get(next).filter(|(face, _)| *face as usize <= f) {
                text.extend_from_slice(statement);
                text.push(b'\n');
                next += 1;
            }
            text.push(b'f');
            for c in mesh.faces.range(f) {
                let vertex = mesh.faces.corners()[c];
                text.push(b' ');
                push_unsigned(text, u64::from(vertex) + 1);
                let texture = attributes.texture.of_corner(c);
                let normal = if normals.is_some() { Some(vertex) } else { attributes.normals.of_corner(c) };
                if texture.is_some() || normal.is_some() {
                    text.push(b'/');
                    texture.into_iter().for_each(|t| push_unsigned(text, u64::from(t) + 1));
                }
                if let Some(normal) = normal {
                    text.push(b'/');
                    push_unsigned(text, u64::from(normal) + 1);
                }
            }
            text.push(b'\n');
        }
    })?;
    for (_, statement) in &statements[statements.partition_point(|(face, _)| (*face as usize) < mesh.faces.len())..] {
        out.write_all(statement)?;
        out.write_all(b"\n")?;
    }
    tags.map_or(Ok(()), |tags| write_tags_to(out, tags))
}

/// Writes the sharp edges and vertices and the rule of the boundary as OpenSubdiv's tags, a line each; a boundary that is
/// treated as interior is its rule 0.
fn write_tags_to(out: &mut dyn Write, tags: &Tags) -> io::Result<()> {
    let rule = match tags.boundary {
        Boundary::AsInterior => Some(0),
        Boundary::EdgeAndCorner => Some(1),
        Boundary::EdgeOnly => Some(2),
        Boundary::Refuse => None,
    };
    if let Some(rule) = rule {
        writeln!(out, "t interpolateboundary 1/0/0 {rule}")?;
    }
    write_rows(out, tags.creases.len(), |text, k| {
        let ([a, b], sharpness) = tags.creases[k];
        text.extend_from_slice(b"t crease 2/1/0 ");
        push_unsigned(text, a.into());
        text.push(b' ');
        push_unsigned(text, b.into());
        text.push(b' ');
        push_number(text, sharpness);
    })?;
    write_rows(out, tags.corners.len(), |text, k| {
        let (vertex, sharpness) = tags.corners[k];
        text.extend_from_slice(b"t corner 1/1/0 ");
        push_unsigned(text, vertex.into());
        text.push(b' ');
        push_number(text, sharpness);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Loaded> {
        read_bytes(text.as_bytes(), Path::new("a.obj"))
    }

    fn refusal(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    #[test]
    fn forms_of_corners_line_ends_comments_and_continued_lines() {
        let text = "# \u{e9}t\u{e9} \\\nv\t0 0 \\\r\n 0 # first\r\n\r\nv 1. .5 -1e-3\rv +2 0 0\nv 3 0 0\n\
                    \tf 1 2/7 3//8\nf 1/1/1 -3/-1/-1 -2//-1 4 # all\nf 1 2\\\n3\n\\\n\\\nv 4 0 0\nf -1 1 2\n\\\n\n\\\n# x";
        let loaded = parse(text).unwrap();
        let faces: Vec<_> = loaded.mesh.faces.iter().collect();
        assert_eq!(faces, [&[0, 1, 2][..], &[0, 1, 2, 3], &[0, 1, 2], &[4, 0, 1]]);
        assert_eq!(loaded.mesh.positions[1], DVec3::new(1.0, 0.5, -1e-3));
        let lines = loaded.lines.unwrap();
        assert_eq!(lines.vertices, [2, 5, 6, 7, 14]);
        assert_eq!(lines.faces, [8, 9, 10, 15]);
        let missing = "7 references of corners to texture coordinates or normals that the file lacks";
        assert_eq!(loaded.remarks, ["the last line has no end: was the file cut off?", missing]);
    }

    const KITCHEN_SINK: &str = "mtllib a.mtl\no thing\nv 0 0 0 1 0 0\nv 1 0 0 2\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\n\
                                g a b\ns 1\nusemtl c:\\m\\name\nvp 0 \\\n0\nf 1 2 3\nl 1 2\np 1\nblob 1\nblob 2\nend";

    #[test]
    fn what_is_not_kept_is_named_with_counts() {
        let loaded = parse(KITCHEN_SINK).unwrap();
        assert_eq!(loaded.mesh.len(), 3);
        assert_eq!(loaded.normals, None);
        assert_eq!(
            loaded.remarks,
            [
                "not kept: 1 lines (l), 1 points (p), 2 free-form and display statements, \
                 weights of 1 vertex (1 not 1: the coordinates are not divided by them), \
                 colours of 1 vertex",
                "2 unknown statements passed over, the first at a.obj, line 17: \"blob\" is not an OBJ statement",
                "the last line has no end: was the file cut off?",
            ]
        );
        assert_eq!(
            loaded.attributes.to_string(),
            "2 texture coordinates (vt), 1 normals (vn), 2 group names (g, o), 1 smoothing groups (s), \
             2 material statements"
        );
        assert!(Attributes::default().is_empty() && Attributes::default().to_string().is_empty());
    }

    fn written(loaded: &Loaded, normals: Option<&[DVec3]>) -> String {
        let mut text = Vec::new();
        let options = WriteOptions { normals, attributes: Some(&loaded.attributes), ..WriteOptions::default() };
        write_control_to(&mut text, &loaded.mesh, &options).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn attributes_are_written_as_the_file_had_them() {
        let values = "vt 0.250 1 # a\nvt 0\nvt 1 1 0.5\nvn 0 0 1\nvn 0 0 -1.#IND\n";
        let faces = "mtllib a b.mtl\no thing\ng left \\\nusemtl Wood\\Dark\\\ns 1\nf 1/1/1 2/2/1 3/3/2\ns off\n\
                     f 1/3 3/1 2/2\nf 1//2 3//2 2//1\nf 1 2/1 3//1\ng after\n";
        let text = format!("{TRIANGLE}{values}{faces}");
        let loaded = parse(&text).unwrap();
        assert_eq!(written(&loaded, None), text);
        // Normals of the surface take the place of those at the corners.
        let with_normals = written(&loaded, Some(&[DVec3::Z; 3]));
        assert!(with_normals.contains("f 1/1/1 2/2/2 3/3/3\ns off\nf 1/3/1 3/1/3 2/2/2\nf 1//1 3//3 2//2\n"));
        assert_eq!(with_normals.matches("vn ").count(), 3);
    }

    /// Of more faces than a thread writes at once, and all threads.
    #[test]
    fn statements_stay_before_their_faces_in_large_files() {
        let mut text = TRIANGLE.repeat(20_000);
        for f in 0..40_000 {
            if f % 2048 < 2 || f % 683 == 0 {
                text += &format!("g {f}\nusemtl m\n");
            }
            text += &format!("f {} 2 3\n", f + 1);
        }
        text += "g after\n";
        let loaded = parse(&text).unwrap();
        assert!(written(&loaded, None) == text);
    }

    #[test]
    fn references_of_all_forms_mean_lines_by_number() {
        // Back from what has been read, ahead of what has not, and to nothing.
        let text = "v 0 0 0\nv 1 0 0\nvt 1\nv 0 1 0\nf 1/-1/1 2/2/1 3/-2/9\nvt 2 \\\n 3\nvn 1 1 1 \\";
        let loaded = parse(text).unwrap();
        let texture: Vec<_> = (0..3).map(|c| loaded.attributes.texture.of_corner(c)).collect();
        assert_eq!(texture, [Some(0), Some(1), None]);
        let normals: Vec<_> = (0..3).map(|c| loaded.attributes.normals.of_corner(c)).collect();
        assert_eq!(normals, [Some(0), Some(0), None]);
        assert_eq!(loaded.remarks[0], "the last line has no end: was the file cut off?");
        assert_eq!(loaded.remarks[1], "2 references of corners to texture coordinates or normals that the file lacks");
        let again = written(&loaded, None);
        assert_eq!(again, format!("{TRIANGLE}vt 1\nvt 2 \\\n 3\nvn 1 1 1\nf 1/1/1 2/2/1 3\n"));
        assert_eq!(parse(&again).unwrap().attributes, loaded.attributes);
    }

    #[test]
    fn a_backslash_that_ends_a_name_takes_no_line() {
        for statement in ["usemtl Wood\\Dark\\", "mtllib C:\\a\\", "g left\\", "o x\\", "blob \\"] {
            let loaded = parse(&format!("{TRIANGLE}{statement}\nf 1 2 3\n")).unwrap();
            assert_eq!(loaded.mesh.faces.len(), 1);
            assert!(
                loaded.remarks.last().is_some_and(|remark| remark.starts_with("a backslash ends line 4")),
                "{:?}",
                loaded.remarks
            );
        }
        let loaded = parse("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 \\\r\n3\\").unwrap();
        assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
        assert_eq!(loaded.remarks[0], "not kept: weights of 3 vertices");
    }

    #[test]
    fn other_kinds_of_files_are_told() {
        for (start, what) in [("ply\nformat", "it is a PLY file"), ("\u{1f}\u{8b}", "is not an OBJ statement")] {
            let text = refusal(start);
            assert!(text.contains(what), "{text}");
        }
        let utf_16: Vec<u8> = TRIANGLE.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let text = read_bytes(&utf_16, Path::new("a.obj")).unwrap_err().to_string();
        assert_eq!(text, "a.obj: not an OBJ file: it is text in UTF-16 or UTF-32: save it as UTF-8 or ASCII");
    }

    #[test]
    fn indices_beyond_the_vertices_and_odd_coordinates_are_left_to_the_validation() {
        let loaded = parse("v nan 0 inf\nv 0 -Infinity 1e999\nf 1 2 4294967296\n").unwrap();
        assert_eq!(loaded.mesh.faces.face(0), [0, 1, u32::MAX]);
        assert!(loaded.mesh.positions[0].x.is_nan());
        assert_eq!(loaded.mesh.positions[1].z, f64::INFINITY);
    }

    #[test]
    fn errors_name_the_line_and_what_is_wrong() {
        let with = |statement: &str| refusal(&format!("{TRIANGLE}{statement}\n"));
        for (statement, start) in [
            ("v 1 2", "the line ends where coordinate z of vertex 3 should be"),
            ("v 1 2,5 3", "\"2,5\" is not coordinate y of vertex 3"),
            ("v 1 2 3 red", "\"red\" is not a weight or colour of vertex 3"),
            ("f 1 2", "face 0 has 2 corners"),
            ("f 1", "face 0 has 1 corner, a face needs at least 3"),
            ("f", "face 0 has 0 corners"),
            ("f 1 2 0", "\"0\" is not a corner of face 0 ("),
            ("f 1 2 -0", "\"-0\" is not a corner of face 0 ("),
            ("f 1 2 3.5", "\"3.5\" is not a corner of face 0 ("),
            ("f 1 2 3/x", "\"3/x\" is not a corner of face 0 ("),
            ("f 1 2 -4", "corner -4 of face 0 reaches before the first of the 3 vertices"),
            ("f 1 2 4294967297", "\"4294967297\" is not a corner of face 0 ("),
            ("f 1 2 99999999999999999999", "\"99999999999999999999\" is not a corner"),
        ] {
            let text = with(statement);
            assert!(text.starts_with(&format!("a.obj, line 4: {start}")), "{text}");
            assert!(!text.contains('\n'), "{text}");
        }
    }

    #[test]
    fn a_file_without_vertices_is_none() {
        for (text, message) in [
            ("", "a.obj, line 1: the file ends where a vertex (v x y z) should be: is it complete?"),
            ("# x\ng a\n", "a.obj, line 2: the file ends where a vertex (v x y z) should be: is it complete?"),
            ("g a\nPK\u{3}\u{4} x\ny\n", "a.obj, line 2: \"PK\\u{3}\\u{4}\" is not an OBJ statement"),
        ] {
            assert_eq!(refusal(text), message);
        }
    }

    #[test]
    fn tags_of_opensubdiv_are_read_at_their_lines_and_written() {
        let tags = "t crease 2/1/0 0 1 10\nt crease 4/2/0 1 2 2 \\\n0 3 inf # two\nt crease 4/1/0 0 1 1 2 2.5\n\
                    t corner 1/1/0 2 10\nt corner 2/1/1 0 1 4 word\nt interpolateboundary 1/0/0 2\nt hole 1/0/0 0\n";
        let loaded = parse(&format!("{tags}{TRIANGLE}f 1 2 3\n")).unwrap();
        let creases: Vec<_> = loaded.tags.creases.iter().map(|c| (c.ends, c.sharpness, c.line)).collect();
        let expected =
            [([0, 1], 10.0, 1), ([1, 2], 3.0, 2), ([2, 0], f64::INFINITY, 2), ([0, 1], 2.5, 4), ([1, 2], 2.5, 4)];
        assert_eq!(creases, expected);
        let corners: Vec<_> = loaded.tags.corners.iter().map(|c| (c.vertex, c.sharpness, c.line)).collect();
        assert_eq!(corners, [(2, 10.0, 5), (0, 4.0, 6), (1, 4.0, 6)]);
        assert_eq!(loaded.tags.boundary, Some(Boundary::EdgeOnly));
        assert_eq!(loaded.remarks, ["not kept: 1 tags that are not of sharpness (t)"]);

        let given = Tags {
            boundary: Boundary::EdgeAndCorner,
            creases: vec![([0, 1], 10.0), ([2, 1], f64::INFINITY)],
            corners: vec![(2, 0.1)],
        };
        let mut text = format!("{TRIANGLE}f 1 2 3\n").into_bytes();
        write_tags_to(&mut text, &given).unwrap();
        let loaded = read_bytes(&text, Path::new("a.obj")).unwrap();
        assert_eq!(loaded.tags.boundary, Some(Boundary::EdgeAndCorner));
        assert_eq!(loaded.tags.creases.iter().map(|c| (c.ends, c.sharpness)).collect::<Vec<_>>(), given.creases);
        assert_eq!(loaded.tags.corners.iter().map(|c| (c.vertex, c.sharpness)).collect::<Vec<_>>(), given.corners);
        let rule = |rule: u8| parse(&format!("{TRIANGLE}t interpolateboundary 1/0/0 {rule}\n")).unwrap();
        assert_eq!((rule(0).tags.boundary, rule(0).remarks.len()), (None, 1));
        assert_eq!((rule(1).tags.boundary, rule(1).remarks.len()), (Some(Boundary::EdgeAndCorner), 0));
    }

    #[test]
    fn tags_of_another_form_are_told_at_their_line() {
        for (tag, start) in [
            ("crease", "the line ends where how many numbers the tag crease has, such as 2/1/0 should be"),
            ("crease 2/1 0 1 10", "\"2/1\" is not how many numbers the tag crease has"),
            ("crease 2/1/0 0 1", "the line ends where sharpness 1 of 1 of the tag crease should be"),
            ("crease 2/1/0 0 -1 10", "\"-1\" is not whole number 2 of 2 of the tag crease"),
            ("crease 2/1/0 0 1 10 10", "\"10\" is not the end of the tag crease, which has 2/1/0 values"),
            ("crease 3/1/0 0 1 2 10", "the tag crease has 3/1/0 values: the form is `t crease 2/1/0 a b sharpness`"),
            ("crease 6/2/0 0 1 1 2 2 0 10 10", "the tag crease has 6/2/0 values"),
            ("crease 0/1/0 10", "the tag crease has 0/1/0 values"),
            ("crease 2/1/0 0 1 -3", "the tag crease has the sharpness -3: a number from 0 on is needed"),
            ("crease 4000000000/1/0 0 1", "the line ends where whole number 3 of 4000000000 of the tag crease"),
            ("crease 2/1/0 0 3 10", "vertex 3 is not in the mesh: it has 3, numbered from 0"),
            ("corner 1/1/0 0 nan", "the tag corner has the sharpness NaN"),
            ("corner 1/0/0 0", "the tag corner has 1/0/0 values: the form is `t corner 1/1/0 vertex sharpness`"),
            ("corner 1/1/0 9 10", "vertex 9 is not in the mesh"),
            ("interpolateboundary 1/0/0 3", "3 is no interpolateboundary: use 0 (none), 1 (edge and corner) or 2"),
            ("interpolateboundary 1/1/0 1 1", "the tag interpolateboundary has 1/1/0 values"),
        ] {
            let text = refusal(&format!("{TRIANGLE}t {tag}\n"));
            assert!(text.starts_with(&format!("a.obj, line 4: {start}")), "{text}");
        }
    }

    #[test]
    fn normals_are_written_beside_the_vertices() {
        let loaded = parse(&format!("{TRIANGLE}f 1 2 3\n")).unwrap();
        let mut text = Vec::new();
        write_to(&mut text, &loaded.mesh, Some(&[DVec3::Z; 3])).unwrap();
        let normals = "vn 0 0 1\n".repeat(3);
        let expected = format!("{TRIANGLE}{normals}f 1//1 2//2 3//3\n");
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }
}
