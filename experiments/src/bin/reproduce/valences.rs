//! What one extraordinary vertex does to the spectrum, and which vertices slow which method.

use limitlab::Result;
use limitlab::analysis::valence_study::{Row, regular_band, valence_study};
use limitlab::schemes::Scheme;
use limitlab_experiments::report::series::Bars;
use limitlab_experiments::report::{Column, Figure, LinePlot, Rule, Table};

use crate::context::{Context, Item};

pub const VALENCES: Item =
    Item { id: "valences", title: "The spectrum against valence: which vertices slow which method", run };

const STUDIED: [usize; 10] = [3, 4, 5, 6, 7, 8, 12, 20, 30, 50];
const SCHEMES: [Scheme; 2] = [Scheme::CatmullClark, Scheme::Loop];
/// Valences with a histogram.
const DRAWN: [usize; 3] = [3, 8, 30];
const BINS: usize = 50;

/// The meshes are built in whatever `--meshes` says.
fn run(context: &mut Context) -> Result<()> {
    if context.real() || context.quick {
        return Ok(());
    }
    let mut table = Table::new(
        VALENCES.id,
        VALENCES.title,
        vec![
            Column::key("scheme"),
            Column::key("valence"),
            Column::text("vertices"),
            Column::number("lambda_min", 1e-8, 6),
            Column::number("jacobi_lambda_min", 1e-8, 6),
            Column::number("jacobi_lambda_max", 1e-8, 6),
            Column::count("outside_band_a"),
            Column::count("outside_band_jacobi"),
            Column::number("slow_mode_near_star", 1e-3, 3).floor(1e-6),
            Column::text("slow_mode_peak_valence"),
            Column::number("limiting_mode_near_star", 1e-3, 3).floor(1e-6),
            Column::text("limiting_mode_peak_valence"),
        ],
    );
    table.note(
        "Two vertices of the valence in a regular surrounding (on quads with the vertices of valence 3 that Euler's \
         formula asks for). `outside_band` counts eigenvalues beyond those of the infinite regular mesh; the slow mode \
         is that of λ_min(A), which slows PIA, the limiting mode that of λ_max(D⁻¹A), which limits ω; `near_star` is \
         the part of Σx² at the two vertices and on their faces.",
    );
    for scheme in SCHEMES {
        let rows = valence_study(scheme, STUDIED.into_iter())?;
        for row in &rows {
            table.push(vec![
                scheme.name().into(),
                row.valence.to_string().into(),
                row.vertices.to_string().into(),
                row.a.first().copied().into(),
                row.jacobi.first().copied().into(),
                row.jacobi.last().copied().into(),
                row.separated_a.into(),
                row.separated_jacobi.into(),
                row.slow_pia.near_star.into(),
                row.slow_pia.peak_valence.to_string().into(),
                row.limiting_jacobi.near_star.into(),
                row.limiting_jacobi.peak_valence.to_string().into(),
            ]);
        }
        context.figure(&format!("{}--{scheme}", VALENCES.id), &histograms(scheme, &rows))?;
    }
    context.table(table)
}

fn histograms(scheme: Scheme, rows: &[Row]) -> Figure {
    let band = regular_band(scheme);
    let panels = rows.iter().filter(|r| DRAWN.contains(&r.valence)).map(|row| LinePlot {
        title: format!("valence {}", row.valence),
        x_label: "eigenvalue of A".into(),
        y_label: "eigenvalues".into(),
        x_range: Some((0.0, 1.0)),
        bars: vec![Bars::histogram("", &row.a, BINS)],
        vertical_lines: vec![Rule::new(band.a.0, "regular band")],
        ..LinePlot::default()
    });
    let mut figure = Figure::stack(panels);
    figure.height = 640;
    figure.title(format!("Spectra of A under {scheme}"))
}
