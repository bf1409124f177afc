//! The control mesh, or the surface, that passes through the vertices of a mesh: `interpolate MESH -o OUT`.

mod arguments;
mod control;
mod summary;
mod surfaces;
mod vertex_options;

use std::borrow::Cow;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use crate::cli::{self, Input, STANDARD_STREAM};
use crate::report::{self, Provenance};
use crate::studies::pictures;

use limitlab::Result;
use limitlab::error::Error;
use limitlab::interpolate::fair_refinement::FirstFairness;
use limitlab::interpolate::surface::check;
use limitlab::mesh::Mesh;
use limitlab::mesh::features::Tags;
use limitlab::mesh::file_tags::Subdivision;
use limitlab::mesh::io::{self, Format, WriteOptions, left_out};
use limitlab::output::{allow_replacing, check_target};
use limitlab::schemes::Scheme;

pub use arguments::Arguments;
use arguments::{Choice, conflict};
use control::control_mesh;
use summary::print_summary;
use surfaces::{fair_refinement, fairest, keeping, leave, refine, request, require_finite, shaped, unified};
use vertex_options::VertexOptions;

/// Runs the program.
pub fn main(mut arguments: Arguments, provenance: Provenance) -> ExitCode {
    if arguments.shape.alpha.is_some() {
        if *arguments.mesh.scheme.get_or_insert(Scheme::Sqrt3) != Scheme::Sqrt3 {
            conflict("--alpha belongs to the unified √3 scheme: use it with --scheme sqrt3");
        }
        if arguments.method != Choice::Auto {
            conflict("--alpha solves no system: leave --method out");
        }
    }
    if arguments.method == Choice::TwoPhase
        && *arguments.mesh.scheme.get_or_insert(Scheme::ZhengCai) != Scheme::ZhengCai
    {
        conflict("--method two-phase belongs to --scheme zheng-cai");
    }
    if arguments.method == Choice::Halstead {
        if *arguments.mesh.scheme.get_or_insert(Scheme::CatmullClark) != Scheme::CatmullClark {
            conflict("--method halstead belongs to --scheme catmull-clark");
        }
        if arguments.shape.shape_handle.is_some() {
            conflict("--method halstead has no type-V faces for shape handles: use --scheme zheng-cai or nasri");
        }
        if arguments.shape.subdivide == 1 {
            conflict("--method halstead gives a mesh two refinements down: use --subdivide 2 or more, or leave it out");
        }
    }
    if arguments.method == Choice::FairRefinement {
        if *arguments.mesh.scheme.get_or_insert(Scheme::ZhengCai) != Scheme::ZhengCai {
            conflict("--method fair-refinement belongs to --scheme zheng-cai");
        }
        if arguments.shape.shape_handle.is_some() {
            conflict(
                "--method fair-refinement chooses the whole of the faces that shape handles scale: leave --shape-handle out",
            );
        }
    }
    if let Choice::Keeping(scheme) = arguments.method {
        let shape = &arguments.shape;
        if arguments.mesh.scheme.is_some() {
            conflict(&format!("--method {scheme} is a scheme of its own: leave --scheme out"));
        }
        if shape.vertices.is_some() || shape.normals.is_some() || shape.shape_handle.is_some() {
            conflict(&format!("--method {scheme} passes through all vertices and takes no normals or shape handles"));
        }
        if shape.subdivide == 0 {
            conflict(&format!(
                "--method {scheme} leaves the control mesh as it is: ask for the surface with --subdivide"
            ));
        }
        // Its topology is that of the scheme which is named where none is.
        arguments.mesh.scheme = Some(Scheme::Loop);
    }
    if arguments.picture.is_some()
        && matches!(arguments.method, Choice::Halstead | Choice::FairRefinement | Choice::Keeping(_))
    {
        conflict(
            "--picture shows the control mesh of a system: leave it out with halstead, fair-refinement, butterfly and \
             labsik-greiner",
        );
    }
    if arguments.output.as_os_str() == STANDARD_STREAM {
        if arguments.json {
            conflict("--json and the mesh would both go to standard output: name a file for one (-o FILE)");
        }
        if arguments.mesh.format.is_none() {
            conflict("-o - has no name that tells the format: give --format obj, off, ply or usda");
        }
    }
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        run(&arguments, &provenance)
    })
}

/// Whether the output is the input: who names one file twice wants it replaced, read-only or not (as by `sed -i`).
fn is_file_of(input: &str, output: &Path) -> bool {
    let [input, output] = [Path::new(input), output].map(|path| path.canonicalize().ok());
    input.is_some_and(|input| output.is_some_and(|output| input == output && input.is_file()))
}

/// Says which flags have no part in what is asked for.
fn remark_on_idle(arguments: &Arguments) {
    let Arguments { shape, mesh, method, .. } = arguments;
    let idle = |flags: &[(&str, bool)], what: &str| {
        let given: Vec<&str> = flags.iter().filter(|flag| flag.1).map(|flag| flag.0).collect();
        if !given.is_empty() {
            arguments.common.remark(format_args!("{} without {what}: not used", given.join(", ")));
        }
    };
    if *method != Choice::TwoPhase {
        let flags = [("--ite-max", shape.ite_max.is_some()), ("--eps", shape.eps.is_some())];
        idle(&flags, "--method two-phase");
    }
    if !matches!(*method, Choice::Halstead | Choice::FairRefinement) && !shape.has_fair_handles() {
        let flags = [("--thin-plate", shape.thin_plate.is_some()), ("--membrane", shape.membrane.is_some())];
        idle(&flags, "--method halstead or fair-refinement, or --shape-handle fair");
    }
    if arguments.input != STANDARD_STREAM && arguments.output.as_os_str() != STANDARD_STREAM {
        idle(
            &[("--format", mesh.format.is_some())],
            "a mesh on standard input or output (-), for names tell their formats",
        );
    }
}

/// Whether the output is a control mesh that is not refined, as tools take it.
fn is_control(arguments: &Arguments) -> bool {
    !arguments.shape.limit && arguments.shape.subdivide == 0
}

/// Where the mesh is written: standard output, or a file.
struct Target<'a> {
    file: Option<&'a Path>,
    format: Format,
}

impl<'a> Target<'a> {
    fn of(arguments: &'a Arguments) -> Result<Self> {
        let path = &arguments.output;
        Ok(match arguments.mesh.format.filter(|_| path.as_os_str() == STANDARD_STREAM) {
            Some(format) => Target { file: None, format: format.written(Path::new("standard output"))? },
            None => Target { file: Some(path), format: Format::of_output(path)? },
        })
    }

    /// Whether the mesh goes to another program or a device, which gets nothing else: no file is there to say later what
    /// made it.
    fn is_stream(&self) -> bool {
        self.file.is_none_or(|path| path.exists() && !path.is_file())
    }

    fn write(&self, mesh: &Mesh, options: &WriteOptions) -> Result<()> {
        match self.file {
            Some(path) => io::write_control(path, mesh, options),
            None => cli::write_standard(|out| io::write_control_to(out, self.format, mesh, options)),
        }
    }
}

/// Says what the file that was read holds and the one that was written does not, or holds as it was.
fn remark_on_output(arguments: &Arguments, input: &Input, target: &Target, options: &WriteOptions) {
    let mut remarks = left_out(target.format, options);
    match options.attributes {
        None if !input.attributes.is_empty() => {
            remarks.push(format!("not written, for they are about the faces of the file: {}", input.attributes));
        }
        Some(attributes) if target.format == Format::Obj && options.normals.is_none() => {
            let count = attributes.normals.len();
            if count > 0 {
                remarks.push(format!(
                    "its {count} normals (vn) are those of the file, not of the surface (--write-normals)"
                ));
            }
        }
        _ => {}
    }
    if options.ascii && target.format != Format::Ply {
        remarks.push("--ascii is about .ply: this format is text in any case".into());
    }
    for remark in remarks {
        arguments.common.remark(format_args!("{}: {remark}", arguments.output_name()));
    }
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.mesh.print_defects(&[&arguments.input], &arguments.common, provenance)? {
        return Ok(());
    }
    remark_on_idle(arguments);
    let target = Target::of(arguments)?;
    let in_place = target.file.is_some_and(|file| is_file_of(&arguments.input, file));
    if let Some(file) = target.file {
        arguments.replace.settle(file)?;
        if !in_place {
            check_target(file)?;
        }
    }
    if let Some(path) = &arguments.picture {
        report::Format::of(path)?;
        arguments.replace.settle(path)?;
        check_target(path)?;
    }
    let input = arguments.mesh.input(&arguments.input, &arguments.common)?;
    let refinement = match arguments.method {
        Choice::Keeping(scheme) => scheme,
        _ => input.scheme.refinement(),
    };
    refinement.check_size(&input.surface, arguments.shape.subdivide.into()).map_err(|e| input.named(e))?;
    let mut per_vertex = VertexOptions::read(&arguments.shape, &input)?;
    let named = |e: Error| match e {
        Error::Io { .. } | Error::Parse { .. } | Error::Memory { .. } => e,
        other => input.named(other),
    };
    let mut picture = None;
    let mut result = match (&per_vertex.alpha, arguments.method) {
        (Some(alpha), _) => unified(arguments, &input, alpha).map_err(named)?,
        (None, Choice::Halstead) => fairest(arguments, &input, &per_vertex).map_err(named)?,
        (None, Choice::FairRefinement) => fair_refinement(arguments, &input, &per_vertex).map_err(named)?,
        (None, Choice::Keeping(scheme)) => keeping(arguments, &input, scheme).map_err(named)?,
        (None, _) => {
            check(&input.surface, input.scheme, &request(arguments, &per_vertex)).map_err(named)?;
            let fairness = match arguments.shape.has_fair_handles() {
                true => Some(FirstFairness::new(&input.surface).map_err(named)?),
                false => None,
            };
            let control = control_mesh(arguments, &input, &per_vertex)?;
            let shaped = match &fairness {
                Some(fairness) => Some(shaped(arguments, &input, fairness, &mut per_vertex, &control).map_err(named)?),
                None => None,
            };
            let request = request(arguments, &per_vertex);
            if let Some(path) = &arguments.picture {
                let (given, cage) = (&input.surface, input.surface.with_positions(control.points.clone()));
                let title = input.subject().caption();
                let figure = pictures::interpolation(title, given, cage, input.scheme, &request).map_err(named)?;
                picture = Some((path, figure));
            }
            refine(&input, &request, control, shaped).map_err(named)?
        }
    };
    leave(&input.frame, &mut result);
    require_finite(&input, &result.made)?;

    let start = Instant::now();
    if let Some(file) = target.file.filter(|_| in_place) {
        allow_replacing(file)?;
    }
    let made = &result.made;
    // The surface itself is its faces; the fairest control mesh is refined, and has other edges than the file.
    let is_control = is_control(arguments);
    let keeps_faces = arguments.shape.subdivide == 0 && made.surface.len() == input.surface.len();
    let tags = match (is_control, keeps_faces) {
        (true, true) => input.file_tags(),
        (true, false) => Cow::Owned(made.surface.tags()),
        (false, _) => Cow::Owned(Tags::default()),
    };
    let comments = if target.is_stream() { Vec::new() } else { provenance.about(&input.source()).lines() };
    let options = WriteOptions {
        normals: made.normals.as_deref(),
        subdivision: if is_control { input.scheme.subdivision() } else { Subdivision::None },
        tags: Some(&tags),
        attributes: keeps_faces.then_some(&input.attributes),
        stage: input.stage,
        ascii: arguments.ascii,
        comments: &comments,
    };
    match input.origin.as_ref().filter(|_| keeps_faces) {
        None => target.write(made.surface.mesh(), &options)?,
        // In the numbering of the file.
        Some(origin) => {
            let normals = options.normals.map(|normals| origin.spread(normals));
            let mesh = origin.written(made.surface.positions());
            target.write(&mesh, &WriteOptions { normals: normals.as_deref(), ..options })?;
        }
    }
    remark_on_output(arguments, &input, &target, &options);
    result.seconds.write = start.elapsed().as_secs_f64();
    if let Some((path, figure)) = picture {
        figure.save(path, &provenance.about(&input.source()))?;
    }
    if !in_place {
        arguments.common.remark_on_replaced();
    }
    print_summary(arguments, &input, &per_vertex, &result, provenance)
}
