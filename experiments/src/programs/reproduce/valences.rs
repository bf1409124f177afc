//! Spectrum against valence: one extraordinary vertex, and the vertices that slow each method.

use crate::report::series::{Band, Bars};
use crate::report::{Column, Columns, Figure, LinePlot, Rule};
use limitlab::Result;
use limitlab::analysis::valence_study::{ValenceRow, regular_band, valence_study};
use limitlab::schemes::Scheme;

use crate::programs::reproduce::context::{Context, Item, Question};

pub const VALENCES: Item = Item {
    id: "valences",
    title: "The spectrum against valence: which vertices slow which method",
    question: Some(Question {
        asks: "Which valences slow which method?",
        answer: "Small ones. The slowest modes of PIA, and those that limit the ω of Jacobi, have their peaks at \
                 valences 3 and 4 even beside vertices of valence 50.",
    }),
    run,
};

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
    let mut records = Vec::new();
    for scheme in SCHEMES {
        let rows = valence_study(scheme, STUDIED.into_iter())?;
        context.figure(&format!("{}--{scheme}", VALENCES.id), &histograms(scheme, &rows))?;
        records.extend(rows.into_iter().map(|row| (scheme, row)));
    }
    let mut table = Columns::<(Scheme, ValenceRow)>::new()
        .col(Column::key("scheme"), |(scheme, _)| scheme.name())
        .col(Column::key("valence"), |(_, row)| row.valence.to_string())
        .col(Column::text("vertices"), |(_, row)| row.vertices)
        .col(Column::number("lambda_min", 1e-8, 6), |(_, row)| row.a.first().copied())
        .col(Column::number("jacobi_lambda_min", 1e-8, 6), |(_, row)| row.jacobi.first().copied())
        .col(Column::number("jacobi_lambda_max", 1e-8, 6), |(_, row)| row.jacobi.last().copied())
        .col(Column::count("outside_band_a"), |(_, row)| row.separated_a)
        .col(Column::count("outside_band_jacobi"), |(_, row)| row.separated_jacobi)
        .col(Column::number("slow_mode_near_star", 1e-3, 3).floor(1e-6), |(_, row)| row.slow_pia.near_star)
        .col(Column::text("slow_mode_peak_valence"), |(_, row)| row.slow_pia.peak_valence)
        .col(Column::number("limiting_mode_near_star", 1e-3, 3).floor(1e-6), |(_, row)| row.limiting_jacobi.near_star)
        .col(Column::text("limiting_mode_peak_valence"), |(_, row)| row.limiting_jacobi.peak_valence)
        .table(VALENCES.id, VALENCES.title, &records);
    table.note(
        "Two vertices of the valence in a regular surrounding (on quads with the vertices of valence 3 that Euler's \
         formula asks for). `outside_band` counts eigenvalues beyond those of the infinite regular mesh; the slow mode \
         is that of λ_min(A), which slows PIA, the limiting mode that of λ_max(D⁻¹A), which limits ω; `near_star` is \
         the part of Σx² at the two vertices and on their faces.",
    );
    context.table(table)
}

fn histograms(scheme: Scheme, rows: &[ValenceRow]) -> Figure {
    let band = regular_band(scheme).a;
    // One legend serves all.
    let label = |valence: usize| if valence == DRAWN[0] { "of a regular mesh" } else { "" };
    let panels = rows.iter().filter(|r| DRAWN.contains(&r.valence)).map(|row| LinePlot {
        title: format!("valence {}, {} vertices", row.valence, row.vertices),
        x_label: "eigenvalue of A".into(),
        y_label: "eigenvalues".into(),
        // Beyond the upper end of the band.
        x_range: Some((0.0, 1.04)),
        bars: vec![Bars::histogram_over("", &row.a, BINS, (0.0, 1.0))],
        vertical_lines: [band.0, band.1].map(|end| Rule::new(end, "")).to_vec(),
        bands: vec![Band { from: band.0, to: band.1, label: label(row.valence).into() }],
        ..LinePlot::default()
    });
    let mut figure = Figure::stack(panels);
    figure.height = 640;
    figure.title(format!("Spectra of A under {scheme}"))
}
