//! Summary of a run: remarks on standard error, and the JSON object.

use crate::cli::{self, Input, advice, number};
use crate::report::Provenance;
use crate::studies::histories;
use glam::DVec3;
use limitlab::Result;
use limitlab::error::counted;
use limitlab::schemes::Scheme;
use limitlab::solvers::Recorded;
use serde_json::{Value, json};

use super::arguments::{Arguments, Choice};
use super::is_control;
use super::surfaces::Finished;
use super::vertex_options::VertexOptions;

pub fn print_summary(
    arguments: &Arguments,
    input: &Input,
    per_vertex: &VertexOptions,
    result: &Finished,
    provenance: &Provenance,
) -> Result<()> {
    let Finished { made, errors, seconds, .. } = result;
    let common = &arguments.common;
    if !made.not_flattened.is_empty() {
        common.remark(format_args!(
            "{}: the faces of {} have no average normal and were moved, not flattened (first: vertex {})",
            input.name,
            counted(made.not_flattened.len(), "vertex"),
            made.not_flattened[0]
        ));
    }
    let without = made.normals.iter().flatten().filter(|n| **n == DVec3::ZERO).count();
    if without > 0 {
        common.remark(format_args!(
            "{}: the surface has no normal at {}; (0, 0, 0) is written",
            input.name,
            counted(without, "vertex")
        ));
    }
    common.remark(format_args!(
        "{}: {} by {}, {}, max error {:.3e}, mean {:.3e} (mesh units)",
        arguments.output_name(),
        match arguments.method {
            Choice::Keeping(scheme) => scheme.name(),
            _ => input.scheme.name(),
        },
        result.method,
        counted(result.iterations, "iteration"),
        errors.max,
        errors.mean
    ));
    if let Some(shaped) = &result.shaped {
        common.remark(format_args!(
            "{}: shape handles of the fairest surface from {:.4} to {:.4}, by {}",
            arguments.output_name(),
            shaped.least,
            shaped.largest,
            counted(shaped.iterations, "iteration")
        ));
    }
    if is_control(arguments) {
        let shown_by = match arguments.method {
            // A mesh that is refined by Doo-Sabin alone, as Nasri's.
            Choice::FairRefinement => Scheme::Nasri,
            _ => input.scheme,
        };
        common.remark(format_args!("its surface: {}", advice::of_tools(shown_by)));
        // Of the vertices that are written, those of faces.
        let placed = input.origin.as_ref().map_or(0, |origin| origin.places().flatten().count());
        if placed > input.surface.len() {
            common.remark(format_args!(
                "{}: vertices that --weld made one lie on each other, as in the file: where it is subdivided join them first \
                 (Blender: Merge by Distance), or the surface has seams and misses the points there",
                arguments.output_name()
            ));
        }
    }
    common.remark(format_args!(
        "seconds: read {:.3}, assemble {:.3}, solve {:.3}, subdivide {:.3}, write {:.3}",
        input.read_seconds, seconds.assemble, seconds.solve, seconds.subdivide, seconds.write
    ));
    if !arguments.json {
        return Ok(());
    }
    let marked = |marks: &Vec<bool>| marks.iter().filter(|&&m| m).count();
    let given = |normals: &Vec<Option<DVec3>>| normals.iter().flatten().count();
    let mut object = input.json(json!({
        "method": result.method,
        "iterations": result.iterations,
        "status": result.status,
        "max_error": number(errors.max),
        "mean_error": number(errors.mean),
        "tolerance": number(result.tolerance),
        "history": history(arguments, result),
        "output": arguments.output.display().to_string(),
        "interpolated": per_vertex.interpolated.as_ref().map_or(input.surface.len(), marked),
        "subdivide": arguments.shape.subdivide,
        "limit": arguments.shape.limit,
        "surface": {
            "vertices": made.surface.len(),
            "faces": made.surface.faces().len(),
        },
        "normals": per_vertex.normals.as_ref().map_or(Value::Null, |n| json!({
            "given": given(n),
            "set": made.normals_set,
        })),
        "fairness": result.fairness.map_or(Value::Null, |e| json!({
            "thin_plate": number(e.thin_plate),
            "membrane": number(e.membrane),
        })),
        "shape_handles": result.shaped.as_ref().map_or(Value::Null, |shaped| json!({
            "least": number(shaped.least),
            "largest": number(shaped.largest),
            "iterations": shaped.iterations,
        })),
        "seconds": {
            "read": number(input.read_seconds),
            "assemble": number(seconds.assemble),
            "solve": number(seconds.solve),
            "subdivide": number(seconds.subdivide),
            "write": number(seconds.write),
        },
    }));
    if let Choice::Keeping(scheme) = arguments.method {
        object["scheme"] = json!(scheme.name());
    }
    cli::print_object(object, provenance)
}

/// The errors of the iterates, or what another method measures them by.
fn history(arguments: &Arguments, result: &Finished) -> Value {
    if !matches!(arguments.method, Choice::Halstead | Choice::FairRefinement) {
        return histories::json(&result.history);
    }
    let entry = |at: &Recorded| {
        json!({
            "iteration": at.iteration,
            "max_step": number(at.errors.max),
            "mean_step": number(at.errors.mean),
        })
    };
    result.history.iter().map(entry).collect()
}
