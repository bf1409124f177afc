//! Tables and pictures of splitting matrices.

use crate::report::{Column, Columns, Figure, LinePlot, Marker, Rule, Series, Table, palette};
use limitlab::Result;
use limitlab::analysis::splitting::row::MAP_ROUNDS;
use limitlab::analysis::splitting::thall::{MaskOrientation, Membership, PrintedNumber};
use limitlab::analysis::splitting::{
    Condition, Crossing, LocalScheme, SharpMask, SharpRow, SharpVertex, SplittingMatrix, StarRow, ThallTables,
    characteristic_map, condition_over_alpha, crossings, thall_tables,
};

/// Those of Lin and Luo's Fig. 8, and 6; where none of them is asked for, the first few are drawn.
const DRAWN: [usize; 6] = [3, 4, 5, 6, 7, 8];
const MOST_DRAWN: usize = 6;
/// Isoparametric lines from the middle to the edge of a map.
const LINES: usize = 8;
/// α of the condition's table, and of its plot.
const TABLE_STEP: f64 = 0.125;
const PLOT_STEP: f64 = 0.01;
/// Curves in the plot of the condition.
const PLOTTED: [usize; 8] = [3, 4, 5, 6, 8, 12, 20, 50];

/// Lin and Luo's condition: where it ceases to hold, a list a valence, and samples over α.
pub struct Sampled {
    pub crossings: Vec<Vec<Crossing>>,
    pub conditions: Vec<Condition>,
}

/// The condition, for √3 only.
///
/// # Errors
/// If eigenvalues do not converge.
pub fn sampled(scheme: LocalScheme, valences: &[usize]) -> Result<Option<Sampled>> {
    let LocalScheme::Sqrt3 { .. } = scheme else {
        return Ok(None);
    };
    Ok(Some(Sampled {
        crossings: valences.iter().map(|&n| crossings(n)).collect::<Result<_>>()?,
        conditions: condition_over_alpha(valences, &grid(TABLE_STEP))?,
    }))
}

/// All tables about one scheme's local matrices, the summary first.
///
/// # Errors
/// If eigenvalues do not converge.
pub fn tables(
    scheme: LocalScheme,
    valences: &[usize],
    rows: &[StarRow],
    sampled: Option<&Sampled>,
) -> Result<Vec<Table>> {
    let mut tables = vec![summary(scheme, rows), eigenvalue_table(scheme, rows), mask_table(scheme, rows)];
    if scheme == LocalScheme::CatmullClark {
        tables.extend(thall_report(&thall_tables()?));
    }
    if let Some(sampled) = sampled {
        tables.push(condition_table(&sampled.conditions));
        tables.push(crossing_table(valences, &sampled.crossings));
    }
    Ok(tables)
}

/// The tables about one scheme's local matrices at vertices that are not smooth, the summary first.
pub fn sharp_tables(scheme: LocalScheme, vertex: SharpVertex, rows: &[SharpRow]) -> [Table; 3] {
    let stem = format!("{}-{vertex}", stem(scheme));
    let modulus = |k: usize| move |row: &SharpRow| row.eigenvalues.get(k).map(|z| z.norm());
    let mode = |k: usize| {
        move |row: &SharpRow| {
            let all = row.sectors.iter().filter_map(|sector| sector.modes.get(k));
            all.copied().max_by(f64::total_cmp)
        }
    };
    let faces = |row: &SharpRow| row.sectors.iter().map(|s| s.faces.to_string()).collect::<Vec<_>>().join("+");
    let planes = |row: &SharpRow| row.sectors.iter().map(|s| yes(s.tangent_plane)).collect::<Vec<_>>().join(", ");
    let residual = |row: &SharpRow| row.masks.iter().map(|mask| mask.residual).fold(0.0, f64::max);
    let columns = Columns::<SharpRow>::new()
        .col(Column::key("valence"), |r| r.valence)
        .col(Column::text("faces"), faces)
        .col(Column::text("size"), |r| r.eigenvalues.len())
        .col(Column::number("lambda_1_modulus", 1e-9, 10), modulus(1))
        .col(Column::number("lambda_2_modulus", 1e-9, 10), modulus(2))
        .col(Column::number("lambda_3_modulus", 1e-9, 10), modulus(3))
        .col(Column::number("across_1", 1e-9, 10), mode(0))
        .col(Column::number("across_2", 1e-9, 10), mode(1))
        .col(Column::number("eigenvalue_error", 1e-2, 2).floor(1e-12), |r| r.eigenvalue_error)
        .col(Column::number("limit_mask_vertex", 1e-9, 6), |r| r.masks[0].weights[0])
        .col(Column::number("limit_mask_error", 1e-2, 2).floor(1e-12), |r| r.limit_mask_error)
        .col(Column::number("residual_left", 1e-2, 2).floor(1e-12), residual)
        .col(Column::text("tangent_plane"), planes);
    let title = format!("Splitting matrices of {scheme} at a {vertex} vertex");
    let mut summary = columns.table(stem.clone(), title, rows);
    summary.note(
        "Each matrix is read off from the refinement of unit vectors on a star with sharp edges. `faces` are those of each sector \
         between two sharp edges, `across_1` and `across_2` the largest eigenvalues of the inside of a sector: a crease or boundary \
         has a tangent plane on that side if the second is below ½, a corner if it is a single face, a dart if two real \
         eigenvalues lead. Errors are the largest deviations from the closed forms (at a dart the limit mask is held against the row \
         of A), `residual_left` is the largest entry of Sᵀw − λw over all masks w.",
    );
    let columns = Columns::<(&SharpRow, usize)>::new()
        .col(Column::key("valence"), |&(row, _)| row.valence)
        .col(Column::key("index"), |&(_, i)| i)
        .col(Column::number("real", 1e-7, 10), |&(row, i)| row.eigenvalues[i].re)
        .col(Column::number("imaginary", 1e-7, 10), |&(row, i)| row.eigenvalues[i].im);
    let title = format!("Eigenvalues of the splitting matrices of {scheme} at a {vertex} vertex");
    let indices: Vec<_> = rows.iter().flat_map(|row| (0..row.eigenvalues.len()).map(move |i| (row, i))).collect();
    let mut eigenvalues = columns.table(format!("{stem}-eigenvalues"), title, &indices);
    eigenvalues.note("All of them with their multiplicities, by falling modulus.");
    let columns = Columns::<(&SharpRow, &SharpMask, usize)>::new()
        .col(Column::key("valence"), |&(row, ..)| row.valence)
        .col(Column::key("mask"), |&(_, mask, _)| mask.name)
        .col(Column::key("position"), |&(row, _, i)| row.positions[i].clone())
        .col(Column::number("eigenvalue", 1e-9, 8), |&(_, mask, _)| mask.eigenvalue)
        .col(Column::number("weight", 1e-9, 8).floor(1e-12), |&(_, mask, i)| mask.weights[i]);
    let title = format!("Limit and tangent masks of {scheme} at a {vertex} vertex");
    let weights: Vec<_> = rows
        .iter()
        .flat_map(|row| row.masks.iter().flat_map(move |mask| (0..mask.weights.len()).map(move |i| (row, mask, i))))
        .collect();
    let mut masks = columns.table(format!("{stem}-masks"), title, &weights);
    masks.note(
        "Positions: v the vertex, e_j the ends of its edges counter-clockwise from the sharp one e0, f_j the opposite corner of the \
         quad between e_j and e_{j+1}. Limit masks have sum 1, tangent masks ±1 as their \
         largest weight.",
    );
    [summary, eigenvalues, masks]
}

/// All pictures with the stems of their files.
///
/// # Errors
/// If eigenvalues do not converge.
pub fn figures(scheme: LocalScheme, valences: &[usize], sampled: Option<&Sampled>) -> Result<Vec<(String, Figure)>> {
    let mut figures = Vec::new();
    if let Some(figure) = maps(scheme, valences)? {
        figures.push((format!("{}-maps", stem(scheme)), figure));
    }
    if let Some(sampled) = sampled {
        figures.push(("splitting-sqrt3-condition".into(), condition_plot(valences, &sampled.crossings)?));
    }
    Ok(figures)
}

/// From 0 to 2, both included.
fn grid(step: f64) -> Vec<f64> {
    let steps = (2.0 / step).round() as usize;
    (0..=steps).map(|k| 2.0 * k as f64 / steps as f64).collect()
}

fn stem(scheme: LocalScheme) -> String {
    match scheme {
        LocalScheme::Sqrt3 { alpha } | LocalScheme::Blend { alpha, .. } if alpha != 0.0 => {
            format!("splitting-{}-alpha-{alpha}", scheme.name())
        }
        LocalScheme::PushBack { beta, .. } if beta != 0.0 => format!("splitting-{}-beta-{beta}", scheme.name()),
        _ => format!("splitting-{}", scheme.name()),
    }
}

fn yes(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}

fn summary(scheme: LocalScheme, rows: &[StarRow]) -> Table {
    let columns = Columns::<StarRow>::new()
        .col(Column::key("valence"), |r| r.valence)
        .col(Column::text("rings"), |r| r.rings)
        .col(Column::text("size"), |r| r.eigenvalues.len())
        .col(Column::number("lambda_1", 1e-9, 10), |r| r.lambda_subdominant.re)
        .col(Column::number("lambda_1_imaginary", 1e-9, 4), |r| r.lambda_subdominant.im.abs())
        .col(Column::number("lambda_1_formula", 1e-9, 10), |r| r.lambda_subdominant_formula)
        .col(Column::number("lambda_3_modulus", 1e-9, 6), |r| r.eigenvalues.get(3).map(|z| z.norm()))
        .col(Column::number("eigenvalue_error", 1e-2, 2), |r| r.eigenvalue_error)
        .col(Column::number("limit_mask_vertex", 1e-9, 6), |r| r.limit_mask[0])
        .col(Column::number("limit_mask_error", 1e-2, 2), |r| r.limit_mask_error)
        .col(Column::number("tangent_mask_distance", 1e-2, 2), |r| r.tangent_mask_distance)
        .col(Column::number("residual_right", 1e-2, 2), |r| r.residual_right)
        .col(Column::number("residual_left", 1e-2, 2), |r| r.residual_left)
        .col(Column::text("pair_leads"), |r| yes(r.pair_leads))
        .col(Column::text("map_regular"), |r| r.map.as_ref().map(|m| yes(m.regular)))
        .col(Column::text("map_injective"), |r| r.map.as_ref().map(|m| yes(m.injective)))
        .col(Column::number("map_least_sine", 1e-6, 4), |r| r.map.as_ref().map(|m| m.least_sine));
    let mut table = columns.table(stem(scheme), format!("Splitting matrices of {scheme}"), rows);
    table.note(
        "Each matrix is read off from the refinement of unit vectors on a star; `rings` is the least number on which it \
         closes. `lambda_1` has the largest modulus after λ_0 = 1. Errors are the largest deviations from the closed \
         forms (all eigenvalues; the limit mask, sum 1), `tangent_mask_distance` is that of the closed-form mask from \
         the computed left eigenspace of λ_1 = λ_2, relative; residuals are the largest entries of S·X − X·(XᵀSX) over \
         all invariant subspaces. `pair_leads`: 1 > λ_1 = λ_2 > λ_3 with a real pair of frequency 1; where it does not, the \
         characteristic map of that pair says nothing about the surface.",
    );
    table.note(format!(
        "A characteristic map is refined {MAP_ROUNDS} times. It counts as regular if the angle at every corner of every \
         face is counter-clockwise (sine > 1e-6; the least is shown), which makes the Jacobian of every face positive, \
         and as injective if moreover its outermost ring goes counter-clockwise about the middle exactly once. Without \
         entry: the leading pair of frequency 1 is complex and there is no map."
    ));
    table
}

fn eigenvalue_table(scheme: LocalScheme, rows: &[StarRow]) -> Table {
    let columns = Columns::<(&StarRow, usize)>::new()
        .col(Column::key("valence"), |&(row, _)| row.valence)
        .col(Column::key("index"), |&(_, i)| i)
        .col(Column::number("real", 1e-7, 10), |&(row, i)| row.eigenvalues[i].re)
        .col(Column::number("imaginary", 1e-7, 10), |&(row, i)| row.eigenvalues[i].im);
    let mut table = columns.table(
        format!("{}-eigenvalues", stem(scheme)),
        format!("Eigenvalues of the splitting matrices of {scheme}"),
        &with_indices(rows, |row| row.eigenvalues.len()),
    );
    table.note("All of them with their multiplicities, by falling modulus.");
    table
}

fn mask_table(scheme: LocalScheme, rows: &[StarRow]) -> Table {
    let tangent = |k: usize| move |&(row, i): &(&StarRow, usize)| row.tangent_masks.as_ref().map(|masks| masks[k][i]);
    let columns = Columns::<(&StarRow, usize)>::new()
        .col(Column::key("valence"), |&(row, _)| row.valence)
        .col(Column::key("position"), |&(row, i)| scheme.layout().label(row.valence, i))
        .col(Column::number("limit", 1e-9, 8), |&(row, i)| row.limit_mask[i])
        .col(Column::number("tangent_cosine", 1e-9, 8), tangent(0))
        .col(Column::number("tangent_sine", 1e-9, 8), tangent(1));
    let mut table = columns.table(
        format!("{}-masks", stem(scheme)),
        format!("Limit and tangent masks of {scheme}"),
        &with_indices(rows, |row| row.limit_mask.len()),
    );
    table.note(format!("Positions: {}.", order(scheme)));
    table
}

/// Each row as often as `count` says, with the index of an eigenvalue or a position.
fn with_indices(rows: &[StarRow], count: fn(&StarRow) -> usize) -> Vec<(&StarRow, usize)> {
    rows.iter().flat_map(|row| (0..count(row)).map(move |i| (row, i))).collect()
}

/// How the positions of a star are named.
fn order(scheme: LocalScheme) -> &'static str {
    match scheme {
        LocalScheme::DooSabin => "sector:i,j is the corner of a sector's grid about the face, 0,0 on the face itself",
        _ => {
            "v the middle, sector:i,j the vertex i edges along the sector's first edge and then j towards the next \
             sector's"
        }
    }
}

/// The characteristic maps side by side; none if no valence has one.
fn maps(scheme: LocalScheme, valences: &[usize]) -> Result<Option<Figure>> {
    let mut drawn: Vec<usize> = valences.iter().copied().filter(|n| DRAWN.contains(n)).collect();
    if drawn.is_empty() {
        drawn = valences.iter().copied().take(MOST_DRAWN).collect();
    }
    let mut panels = Vec::new();
    for n in drawn {
        let matrix = SplittingMatrix::new(scheme, n)?;
        let Ok(lambda) = matrix.leading_pair() else {
            continue;
        };
        let net = characteristic_map(scheme, n, scheme.map_rings())?.refine(MAP_ROUNDS)?;
        let check = net.check();
        let verdict = match (matrix.pair_leads()?, check.regular, check.injective) {
            (false, ..) => "not subdominant",
            (_, true, true) => "regular, injective",
            (_, true, false) => "regular, not injective",
            _ => "not regular",
        };
        let joined = |lines: Vec<Vec<(f64, f64)>>| {
            let gap = (f64::NAN, f64::NAN);
            lines.into_iter().flat_map(move |line| line.into_iter().chain([gap]))
        };
        // As far as a line of every family goes all around.
        let step = (net.rings / LINES).max(1);
        let middle_face = 1 - scheme.layout().centre();
        let net = net.inner((net.rings - middle_face) / step * step + middle_face);
        panels.push(LinePlot {
            title: format!("n = {n}, λ = {lambda:.4}: {verdict}"),
            equal_units: true,
            // A map is one only up to similarity.
            without_axes: true,
            series: vec![
                Series::line("", joined(net.lines(step))).colour(palette(0)),
                // Only the lines between sectors.
                Series::line("", joined(net.lines(net.rings + 1))).colour(palette(1)),
            ],
            ..LinePlot::default()
        });
    }
    if panels.is_empty() {
        return Ok(None);
    }
    let columns = panels.len().min(3);
    let lines = panels.len().div_ceil(columns);
    let mut figure =
        Figure::row(panels).title(format!("Characteristic maps of {scheme}, sectors parted by orange lines"));
    figure.columns = columns;
    figure.width = 300 * columns as u32;
    figure.height = 300 * lines as u32 + Figure::TITLE_ROOM;
    Ok(Some(figure))
}

fn thall_report(tables: &ThallTables) -> [Table; 3] {
    let columns = Columns::<PrintedNumber>::new()
        .col(Column::key("place"), |e| e.place)
        .col(Column::key("valence"), |e| e.valence)
        .col(Column::key("item"), |e| e.item.clone())
        .col(Column::number("printed", 1e-12, 10), |e| e.printed)
        .col(Column::number("computed", 1e-9, 10), |e| e.computed)
        .col(Column::text("agrees"), |e| yes((e.printed - e.computed).abs() < 1e-12));
    let title = "Thall's splitting matrices and masks, entry by entry";
    let mut entries = columns.table("splitting-thall", title, &tables.entries);
    entries.note(
        "S and masks in Thall's order v, f_1…f_n, e_1…e_n. Tables II and III are compared with his formulas for c_2 and \
         c_3 under the index map of §4.1 (Table II is scaled by 4). Agreement: to 1e-12.",
    );
    let columns = Columns::<Membership>::new()
        .col(Column::key("place"), |m| m.place)
        .col(Column::key("valence"), |m| m.valence)
        .col(Column::key("mask"), |m| m.mask.clone())
        .col(Column::number("distance", 1e-6, 4), |m| m.distance)
        .col(Column::number("distance_edges_scaled", 1e-6, 4), |m| m.distance_scaled);
    let title = "Printed tangent masks and the left eigenspace of λ_2 = λ_3";
    let mut members = columns.table("splitting-thall-membership", title, &tables.memberships);
    members.note(
        "Relative distance ‖v − QQᵀv‖/‖v‖ of the mask from the eigenspace; then the same with the edge weights \
         multiplied by A_n.",
    );
    let columns = Columns::<MaskOrientation>::new()
        .col(Column::key("place"), |o| o.place)
        .col(Column::key("valence"), |o| o.valence)
        .col(Column::key("masks"), |o| o.masks)
        .col(Column::number("sine", 1e-9, 4), |o| o.sine);
    let mut normals = columns.table("splitting-thall-normals", "Which way m_2 × m_3 points", &tables.orientations);
    normals.note("The sine of the angle from m_2 to m_3 on a counter-clockwise planar star: positive is outward.");
    [entries, members, normals]
}

fn condition_table(sampled: &[Condition]) -> Table {
    let mut columns = Columns::<Condition>::new()
        .col(Column::key("valence"), |c| c.valence)
        .col(Column::key("alpha"), |c| c.alpha.to_string());
    for k in 1..=4 {
        columns = columns.col(Column::number(format!("lambda_{k}_modulus"), 1e-6, 6), move |c| c.lambda[k - 1].norm());
    }
    let columns = columns
        .col(Column::number("margin", 1e-6, 4), |c| c.margin)
        .col(Column::text("holds"), |c| yes(c.holds))
        .col(Column::text("third_equals_fourth"), |c| yes(c.third_equals_fourth));
    let title = "Lin and Luo's eigenvalue condition over α";
    let mut table = columns.table("splitting-sqrt3-condition", title, sampled);
    table.note(
        "S̃ = R·S·S on three rings. The condition: λ_0 = 1 > λ_1 = λ_2 > λ_3, a real pair of frequency 1 leading; `margin` is \
         the modulus of that pair less the largest other. The paper (§6) states it for all α in [0, 2], and λ_3 = λ_4 \
         beside it for n > 3.",
    );
    table
}

fn crossing_table(valences: &[usize], crossings: &[Vec<Crossing>]) -> Table {
    // A valence without crossings has a row all the same.
    let mut rows = Vec::new();
    for (&n, found) in valences.iter().zip(crossings) {
        rows.extend(found.is_empty().then_some((n, None)));
        rows.extend(found.iter().map(|c| (n, Some(c))));
    }
    let columns = Columns::<(usize, Option<&Crossing>)>::new()
        .col(Column::key("valence"), |&(n, _)| n)
        .col(Column::number("alpha", 1e-6, 8), |(_, c)| c.map(|c| c.alpha))
        .col(Column::text("above"), |(_, c)| if c.is_none_or(|c| c.holds_above) { "holds" } else { "fails" })
        .col(Column::text("frequency"), |(_, c)| c.map(|c| c.frequency));
    let title = "Where Lin and Luo's eigenvalue condition ceases to hold";
    let mut table = columns.table("splitting-sqrt3-crossings", title, &rows);
    table.note(
        "`frequency` is that of the eigenvalue that meets λ_1 there: 0 for rotation-invariant ones. Found between \
         neighbours of 401 values of α, then by bisection. Without α: it holds on all of [0, 2].",
    );
    table
}

fn condition_plot(valences: &[usize], crossings: &[Vec<Crossing>]) -> Result<Figure> {
    let mut plotted: Vec<usize> = valences.iter().copied().filter(|n| PLOTTED.contains(n)).collect();
    if plotted.is_empty() {
        plotted = valences.iter().copied().take(MOST_DRAWN).collect();
    }
    let conditions = condition_over_alpha(&plotted, &grid(PLOT_STEP))?;
    let curve = |&n: &usize| {
        let own = conditions.iter().filter(move |c| c.valence == n);
        Series::line(format!("n = {n}"), own.map(|c| (c.alpha, c.margin)))
    };
    let margins = LinePlot {
        title: "The condition holds above 0".into(),
        x_label: "α".into(),
        y_label: "|λ_{1}| − largest other modulus".into(),
        x_range: Some((0.0, 2.0)),
        series: plotted.iter().map(curve).collect(),
        horizontal_lines: vec![Rule::new(0.0, "")],
        ..LinePlot::default()
    };
    let points = |frequency: usize| {
        let all = crossings.iter().flatten().filter(move |c| c.frequency == frequency);
        all.map(|c| (c.valence as f64, c.alpha))
    };
    let mut series = vec![
        Series::scatter("frequency 0", points(0)),
        Series::scatter("frequency 2", points(2)).marker(Marker::Square),
    ];
    series.retain(|s| !s.points.is_empty());
    // A single one needs no legend.
    let which = match &mut series[..] {
        [only] => format!("an eigenvalue of {}", std::mem::take(&mut only.name)),
        _ => "which eigenvalue".to_owned(),
    };
    let first = LinePlot {
        title: format!("Where it ceases to hold: {which} meets λ_{{1}} there"),
        x_label: "valence n".into(),
        y_label: "α".into(),
        x_range: Some((valences[0] as f64 - 1.0, valences[valences.len() - 1] as f64 + 1.0)),
        series,
        ..LinePlot::default()
    };
    let mut figure = Figure::stack([margins, first]).title("Lin and Luo's eigenvalue condition, blended √3");
    figure.share_x = false;
    figure.height = 520;
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Panel;

    #[test]
    fn figures_can_be_read_and_have_no_legend_for_one_series() {
        let scheme = LocalScheme::Sqrt3 { alpha: 0.0 };
        let valences = [3, 4, 5, 6];
        let sampled = sampled(scheme, &valences).unwrap();
        let figures = figures(scheme, &valences, sampled.as_ref()).unwrap();
        assert_eq!(figures.len(), 2);
        for (stem, figure) in &figures {
            assert_eq!(figure.illegible().unwrap(), [""; 0], "{stem}");
        }
        let Panel::Lines(crossings) = &figures[1].1.panels[1] else { panic!("a plot") };
        let names: Vec<&str> = crossings.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!((names, crossings.title.contains("an eigenvalue of frequency 0 meets")), (vec![""], true));
    }
}
