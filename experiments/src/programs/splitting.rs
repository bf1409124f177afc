//! Splitting matrices of one extraordinary vertex: `splitting --valence A..B --scheme NAME`.

use std::ops::RangeInclusive;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use serde_json::{Value, json};

use crate::cli::{self, CommonFlags, OutputFlags, number};
use crate::report::Provenance;
use crate::studies::splitting as study;
use limitlab::analysis::splitting::{
    Condition, Crossing, LocalScheme, SharpRow, SharpVertex, StarRow, VALENCES, rows, sharp_rows,
};
use limitlab::{Error, Result, names};

/// In its help.
const EXAMPLES: [&str; 2] = ["splitting --valence 3..12 --scheme loop", "splitting --at crease --scheme catmull-clark"];

/// Local splitting matrices: eigenvalues, limit and tangent masks with closed forms beside them, characteristic maps.
///
/// They are read off from the refinement rules. For catmull-clark also what Thall prints, for sqrt3 also Lin and Luo's
/// eigenvalue condition over α. With --at, the same at vertices that are not smooth, under catmull-clark and loop: on a
/// boundary, on a crease with half of the faces on each side, at a corner of a boundary, at a dart.
#[derive(Parser)]
#[command(name = "splitting", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE, None))]
pub struct Arguments {
    /// Valences from A to B, both included, or a single one; within 3..100, on a boundary, where it is the number of faces,
    /// 1..100
    #[arg(long, value_name = "A..B", default_value = "3..12")]
    valence: String,
    /// The vertex: smooth, boundary, crease, corner or dart
    #[arg(long, value_name = "KIND", default_value = "smooth")]
    at: At,
    /// catmull-clark, loop, doo-sabin (at a face), sqrt3, labsik-greiner, kobbelt, blended-catmull-clark, blended-loop,
    /// pushed-back-catmull-clark or pushed-back-loop
    #[arg(long, value_name = "NAME", default_value = "catmull-clark")]
    scheme: String,
    /// The blend of sqrt3 (0 unless told) and of the blended schemes (1), or how far pushed-back schemes push (1), 0 to 2: 0
    /// approximating, 1 interpolating
    #[arg(long, value_name = "A")]
    alpha: Option<f64>,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What is at the middle of the star; `None` is a smooth vertex.
#[derive(Clone, Copy, Debug)]
struct At(Option<SharpVertex>);

impl std::str::FromStr for At {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let mut all = vec![("smooth", At(None))];
        all.extend(SharpVertex::ALL.map(|vertex| (vertex.name(), At(Some(vertex)))));
        names::find("kind of vertex", name, &all, &[])
    }
}

/// A range of valences with both ends.
fn valences(text: &str, all: &RangeInclusive<usize>) -> std::result::Result<Vec<usize>, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let valence = |text: &str| match text.parse::<usize>() {
        Ok(n) if all.contains(&n) => Ok(n),
        _ => Err(format!("valences are whole numbers in {}..{}, not {text:?}", all.start(), all.end())),
    };
    let (first, last) = (valence(first)?, valence(last)?);
    if first > last {
        return Err(format!("{first}..{last} is empty: the first valence is not above the last"));
    }
    Ok((first..=last).collect())
}

/// Runs the program.
pub fn main(arguments: Arguments, provenance: Provenance) -> ExitCode {
    let refuse = |what: String| -> ! { Arguments::command().error(ErrorKind::InvalidValue, what).exit() };
    let scheme = LocalScheme::new(&arguments.scheme, arguments.alpha).unwrap_or_else(|error| refuse(error.to_string()));
    let At(vertex) = arguments.at;
    if let Some(vertex) = vertex
        && let Err(error) = vertex.require_rules(scheme)
    {
        refuse(error.to_string());
    }
    let range = vertex.map_or(VALENCES, SharpVertex::valences);
    let valences = valences(&arguments.valence, &range).unwrap_or_else(|what| refuse(what));
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        arguments.output.prepare()?;
        match vertex {
            None => run(&arguments, scheme, &valences, &provenance),
            Some(vertex) => run_sharp(&arguments, (scheme, vertex), &valences, &provenance),
        }
    })
}

/// At a vertex that is not smooth.
fn run_sharp(
    arguments: &Arguments,
    (scheme, vertex): (LocalScheme, SharpVertex),
    valences: &[usize],
    provenance: &Provenance,
) -> Result<()> {
    let rows = sharp_rows(scheme, vertex, valences)?;
    let tables = study::sharp_tables(scheme, vertex, &rows);
    arguments.output.settle(tables.iter().map(|table| &table.id))?;
    for table in &tables {
        table.write(&arguments.output.out, provenance)?;
    }
    if !arguments.output.json {
        cli::print_table(&tables[0])?;
    }
    let object = json!({
        "scheme": scheme.name(),
        "at": vertex.name(),
        "rows": rows.iter().map(sharp_json).collect::<Vec<_>>(),
    });
    cli::finish(vec![object], &arguments.output, &arguments.common, provenance)
}

fn sharp_json(row: &SharpRow) -> Value {
    let numbers = |v: &[f64]| v.iter().map(|&x| number(x)).collect::<Vec<_>>();
    json!({
        "valence": row.valence,
        "positions": row.positions,
        "eigenvalues": row.eigenvalues.iter().map(|z| number(z.re)).collect::<Vec<_>>(),
        "eigenvalues_imaginary": row.eigenvalues.iter().map(|z| number(z.im)).collect::<Vec<_>>(),
        "eigenvalue_error": row.eigenvalue_error.map(number),
        "limit_mask": numbers(&row.masks[0].weights),
        "limit_mask_error": number(row.limit_mask_error),
        "tangent_masks": row.masks[1..]
            .iter()
            .map(|mask| json!({
                "name": mask.name,
                "eigenvalue": number(mask.eigenvalue),
                "weights": numbers(&mask.weights),
                "residual": number(mask.residual),
            }))
            .collect::<Vec<_>>(),
        "sectors": row
            .sectors
            .iter()
            .map(|sector| json!({
                "faces": sector.faces,
                "modes": numbers(&sector.modes),
                "tangent_plane": sector.tangent_plane,
            }))
            .collect::<Vec<_>>(),
    })
}

fn run(arguments: &Arguments, scheme: LocalScheme, valences: &[usize], provenance: &Provenance) -> Result<()> {
    let out = &arguments.output.out;
    let rows = rows(scheme, valences)?;
    let sampled = study::sampled(scheme, valences)?;
    let tables = study::tables(scheme, valences, &rows, sampled.as_ref())?;
    let figures = study::figures(scheme, valences, sampled.as_ref())?;
    arguments.output.settle(tables.iter().map(|table| &table.id).chain(figures.iter().map(|(stem, _)| stem)))?;
    let mut object = json!({
        "scheme": scheme.name(),
        "alpha": match scheme {
            LocalScheme::Sqrt3 { alpha } | LocalScheme::Blend { alpha, .. } | LocalScheme::PushBack { beta: alpha, .. } => {
                number(alpha)
            }
            LocalScheme::CatmullClark
            | LocalScheme::Loop
            | LocalScheme::DooSabin
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => Value::Null,
        },
        "rows": rows.iter().map(row_json).collect::<Vec<_>>(),
    });
    if let Some(sampled) = &sampled {
        object["condition"] = condition_json(valences, &sampled.crossings, &sampled.conditions);
    }
    if figures.is_empty() {
        arguments.common.remark("no characteristic map to draw: the leading pairs are complex");
    }
    for (stem, figure) in &figures {
        arguments.output.figure(stem, figure, provenance)?;
    }
    for table in &tables {
        table.write(out, provenance)?;
    }
    if !arguments.output.json {
        cli::print_table(&tables[0])?;
    }
    cli::finish(vec![object], &arguments.output, &arguments.common, provenance)
}

fn row_json(row: &StarRow) -> Value {
    let numbers = |v: &[f64]| v.iter().map(|&x| number(x)).collect::<Vec<_>>();
    json!({
        "valence": row.valence,
        "rings": row.rings,
        "positions": (0..row.limit_mask.len())
            .map(|i| row.scheme.layout().label(row.valence, i))
            .collect::<Vec<_>>(),
        "eigenvalues": row.eigenvalues.iter().map(|z| number(z.re)).collect::<Vec<_>>(),
        "eigenvalues_imaginary": row.eigenvalues.iter().map(|z| number(z.im)).collect::<Vec<_>>(),
        "lambda_subdominant": number(row.lambda_subdominant.re),
        "lambda_subdominant_imaginary": number(row.lambda_subdominant.im.abs()),
        "lambda_subdominant_formula": row.lambda_subdominant_formula.map(number),
        "eigenvalue_error": row.eigenvalue_error.map(number),
        "limit_mask": numbers(&row.limit_mask),
        "limit_mask_error": row.limit_mask_error.map(number),
        "tangent_masks": row.tangent_masks.as_ref().map(|m| m.each_ref().map(|v| numbers(v))),
        "tangent_mask_distance": row.tangent_mask_distance.map(number),
        "pair_leads": row.pair_leads,
        "residual_right": number(row.residual_right),
        "residual_left": number(row.residual_left),
        "characteristic_map": row.map.as_ref().map(|m| json!({
            "regular": m.regular,
            "injective": m.injective,
            "least_sine": number(m.least_sine),
            "folded_corners": m.folded_corners,
            "winding": number(m.winding),
            "samples": m.samples,
        })),
    })
}

fn condition_json(valences: &[usize], crossings: &[Vec<Crossing>], sampled: &[Condition]) -> Value {
    let entry = |(&n, found): (&usize, &Vec<Crossing>)| {
        let crossing =
            |c: &Crossing| json!({ "alpha": number(c.alpha), "holds_above": c.holds_above, "frequency": c.frequency });
        let samples = || sampled.iter().filter(|c| c.valence == n);
        json!({
            "valence": n,
            "crossings": found.iter().map(crossing).collect::<Vec<_>>(),
            "alpha": samples().map(|c| number(c.alpha)).collect::<Vec<_>>(),
            "margin": samples().map(|c| number(c.margin)).collect::<Vec<_>>(),
            "third_equals_fourth": samples().map(|c| c.third_equals_fourth).collect::<Vec<_>>(),
        })
    };
    valences.iter().zip(crossings).map(entry).collect()
}
