use super::super::canvas::Colour;
use super::*;
use crate::report::canvas::{Dash, Marker, PIXELS_PER_POINT, Point, Shape, text_width};
use crate::report::series::{Band, Bars, Rule, marker, palette};
use crate::report::{ColourScale, Scale, Series, ShadedMesh, View};

/// Twelve convergence histories, four of which diverge or stagnate.
fn histories() -> Figure {
    let names = [
        "jacobi",
        "thall",
        "gauss-seidel",
        "sor",
        "ssor",
        "pia",
        "w-pia",
        "chebyshev",
        "cg",
        "pcg-jacobi",
        "pcg-ssor",
        "pcg-ic0",
    ];
    let factors = [1.09, 0.93, 0.87, 0.80, 0.83, 0.96, 0.9, 0.72, 0.66, 0.6, 0.5, 1.03];
    let series = names.iter().zip(factors).enumerate().map(|(i, (name, factor))| {
        let wiggle = move |k: i32| 1.0 + 0.3 * (f64::from(k) * 0.7 + i as f64).sin();
        let values = (0..=200).map(move |k| f64::powi(factor, k) * wiggle(k));
        let values = values.take_while(|v| (1e-12..1e6).contains(v));
        Series::history(*name, values).marker(marker(i))
    });
    Figure::new(LinePlot {
        title: "Catmull-Clark, torus:64x64, noise 0.1".into(),
        x_label: "iteration".into(),
        y_label: "largest vertex error / bounding-box diagonal".into(),
        y_scale: Scale::Log,
        series: series.collect(),
        horizontal_lines: vec![Rule::new(1e-10, "tolerance")],
        ..LinePlot::default()
    })
}

/// Iterations and rates over ω with the optimum and the threshold drawn in.
fn sweep() -> Figure {
    let omegas = || (1..=24).map(|i| 0.05 * f64::from(i));
    let rho = |w: f64| (1.0 - w / 4.0).abs().max((1.0 - 9.0 * w / 4.0).abs());
    let iterations = |w: f64| {
        let count = (1e-10_f64.ln() / rho(w).ln()).ceil();
        if rho(w) < 1.0 { count } else { f64::NAN }
    };
    let marks = |labelled: bool| -> Vec<Rule> {
        let name = |text: &str| {
            if labelled { text.to_owned() } else { String::new() }
        };
        vec![Rule::new(0.8, name("ω_{opt} = 0.8")), Rule::new(8.0 / 9.0, name("ω_{crit} = 0.889"))]
    };
    let upper = LinePlot {
        y_label: "iterations".into(),
        y_scale: Scale::Log,
        series: vec![
            Series::line("Jacobi", omegas().map(|w| (w, iterations(w)))).marker(Marker::Circle),
            Series::line("PIA", omegas().map(|w| (w, 2.0 * iterations(w)))).marker(Marker::Square),
        ],
        vertical_lines: marks(true),
        ..LinePlot::default()
    };
    let lower = LinePlot {
        x_label: "relaxation weight ω".into(),
        y_label: "rate ρ".into(),
        x_range: Some((0.0, 1.2)),
        y_range: Some((0.7, 1.4)),
        series: vec![
            Series::line("predicted ρ(ω)", (0..=240).map(|i| 0.005 * f64::from(i)).map(|w| (w, rho(w)))),
            Series::scatter("measured", omegas().map(|w| (w, rho(w)))).colour(palette(0)),
        ],
        vertical_lines: marks(false),
        bands: vec![Band { from: 0.0, to: 8.0 / 9.0, label: "converges".into() }],
        horizontal_lines: vec![Rule { dash: Dash::Dotted, ..Rule::new(1.0, "ρ = 1") }],
        ..LinePlot::default()
    };
    Figure::stack([upper, lower]).title("Catmull-Clark, torus:16x16, noise 0.1")
}

/// A nine-point torus in row order and with its rows shuffled.
fn patterns(side: u32) -> Figure {
    let n = side * side;
    let torus = move || {
        (0..n).flat_map(move |v| {
            let (i, j) = (v / side, v % side);
            (0..9).map(move |k| {
                let (a, b) = ((i + side + k / 3 - 1) % side, (j + side + k % 3 - 1) % side);
                (v, a * side + b)
            })
        })
    };
    // A permutation, since 7919 is a prime that does not divide n.
    let shuffled = move |v: u32| (u64::from(v) * 7919 % u64::from(n)) as u32;
    Figure::row([
        SparsityPlot::new(format!("file order, bandwidth {}", n - 1), n as usize, torus()),
        SparsityPlot::new("shuffled", n as usize, torus().map(move |(r, c)| (shuffled(r), shuffled(c)))),
    ])
}

fn spectrum() -> Figure {
    let symbol = |k: u32| (2.0 + (f64::from(k) * std::f64::consts::TAU / 64.0).cos()) / 3.0;
    let values: Vec<f64> = (0..64 * 64).map(|k| symbol(k / 64) * symbol(k % 64)).collect();
    Figure::new(LinePlot {
        x_label: "eigenvalue".into(),
        y_label: "count".into(),
        bars: vec![Bars::histogram("torus:64x64", &values, 50)],
        vertical_lines: vec![Rule::new(1.0 / 9.0, "λ_{min} = 1/9")],
        ..LinePlot::default()
    })
}

fn frames(figure: &Figure) -> Vec<Rect> {
    let slots = figure.slots().unwrap();
    slots.iter().map(|slot| slot.frame).collect()
}

/// The part of a rectangle of points that is not white.
fn ink(image: &Image, area: Rect) -> f64 {
    let px = |v: f64| (v * f64::from(PIXELS_PER_POINT)) as u32;
    let (mut dark, mut all) = (0_u32, 0_u32);
    for y in px(area.top)..px(area.bottom).min(image.height) {
        for x in px(area.left)..px(area.right).min(image.width) {
            all += 1;
            dark += u32::from(image.pixel(x, y) != [255; 3]);
        }
    }
    f64::from(dark) / f64::from(all)
}

#[test]
fn figures_have_their_size_are_drawn_and_come_out_the_same() {
    for (figure, width, height) in
        [(histories(), 600, 380), (sweep(), 600, 440), (patterns(64), 600, 320), (spectrum(), 600, 380)]
    {
        let image = figure.render().unwrap();
        assert_eq!((image.width, image.height), (width * 3, height * 3));
        for frame in frames(&figure) {
            assert!(ink(&image, frame) > 0.01, "the data is drawn");
        }
        let mut first = Vec::new();
        image.write_png(&mut first).unwrap();
        let mut second = Vec::new();
        figure.render().unwrap().write_png(&mut second).unwrap();
        assert!(first == second, "the same figure gives the same bytes");
    }
}

/// A plot with letters of every kind and a surface with its bar of colours.
fn mixed() -> Figure {
    let mesh = limitlab::mesh::builtin::builtin("torus:8x6").unwrap();
    let values = mesh.positions.iter().map(|p| p.x).collect();
    let scale = ColourScale::linear("x", (-2.0, 2.0));
    let surface = ShadedMesh::smooth(mesh).scalars(values, scale.clone());
    let view = View::named("oblique").unwrap();
    let picture = Picture::new("a & b < \"c\"", view).surface(surface);
    let Panel::Lines(plot) = sweep().panels.remove(0) else { unreachable!() };
    let figure = Figure::row([Panel::from(plot), Panel::from(picture)]);
    Figure { width: 800, colour_bar: Some(scale), ..figure }.title("ω_{opt} ‖p − A v‖ 10⁻⁸")
}

/// The names of the elements of an XML text in order, every one closed, its attributes quoted, its entities known.
fn elements(text: &str) -> Vec<&str> {
    let (mut open, mut seen) = (Vec::new(), Vec::new());
    let body = text.strip_prefix("<?xml version=\"1.0\" encoding=\"UTF-8\"?>").unwrap();
    for tag in body.split('<').skip(1) {
        let (tag, between) = tag.split_once('>').unwrap();
        assert!(tag == "metadata" || between.trim().is_empty(), "text outside attributes: {between}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
            continue;
        }
        let (name, attributes) = tag.trim_end_matches('/').split_once(' ').unwrap_or((tag, ""));
        for (k, part) in attributes.split('"').enumerate() {
            if k % 2 == 0 {
                assert!(part.is_empty() || part.ends_with('='), "{part}");
            } else {
                let entities = part.split('&').skip(1);
                assert!(
                    entities.into_iter().all(|e| ["amp;", "lt;", "quot;"].iter().any(|known| e.starts_with(known)))
                );
            }
        }
        if !tag.ends_with('/') {
            open.push(name);
        }
        seen.push(name);
    }
    assert_eq!(open, [""; 0]);
    seen
}

#[test]
fn vector_graphics_are_valid_and_of_the_figures_size() {
    for figure in [histories(), sweep(), patterns(64), spectrum(), mixed()] {
        let svg = figure.drawing().unwrap().to_svg(&Provenance::default()).unwrap();
        let names = elements(&svg);
        assert_eq!(names.iter().filter(|&&name| name == "svg").count(), 1);
        let (width, height) = (figure.width, figure.height);
        let size = format!("width=\"{width}pt\" height=\"{height}pt\" viewBox=\"0 0 {width} {height}\"");
        assert!(svg.contains(&size));
        // Images are letters without sense.
        let without_images =
            |(k, part): (usize, &str)| part[if k == 0 { 0 } else { part.find('"').unwrap() }..].to_owned();
        let drawn: String = svg.split(";base64,").enumerate().map(without_images).collect();
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"));
        // Every letter that is placed is defined, and defined once.
        let after = |mark: &'static str| svg.split(mark).skip(1).map(|rest| rest.split('"').next().unwrap());
        let defined: Vec<&str> = after("id=\"letter-").collect();
        assert!(!defined.is_empty() && after("href=\"#letter-").all(|letter| defined.contains(&letter)));
        assert!(defined.iter().enumerate().all(|(k, letter)| !defined[..k].contains(letter)));
    }
    let svg = mixed().drawing().unwrap().to_svg(&Provenance::default()).unwrap();
    assert!(svg.contains("aria-label=\"a &amp; b &lt; &quot;c&quot;\""));
    assert_eq!(svg.matches("data:image/png;base64,iVBOR").count(), 2);
}

#[test]
fn a_page_has_the_figures_size_and_everything_in_it() {
    let find = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).filter(|&w| w == mark).count();
    for (figure, images) in [(histories(), 0), (mixed(), 2)] {
        let pdf = figure.drawing().unwrap().to_pdf(&Provenance::default());
        assert!(pdf.starts_with(b"%PDF-1.7") && pdf.ends_with(b"%%EOF"));
        assert_eq!((find(&pdf, b"/Type /Page\n"), find(&pdf, b"/Subtype /Image")), (1, images));
        let size = format!("/MediaBox [0 0 {} {}]", figure.width, figure.height);
        assert_eq!(find(&pdf, size.as_bytes()), 1);
        // The table at the end says where each object begins.
        let text = String::from_utf8_lossy(&pdf).into_owned();
        let start: usize = text.rsplit("startxref\n").next().unwrap().lines().next().unwrap().parse().unwrap();
        assert!(pdf[start..].starts_with(b"xref"));
        let stream = pdf.windows(7).enumerate().filter(|(_, w)| *w == b"stream\n").map(|(at, _)| at + 7);
        let unpacked = stream.filter_map(|at| miniz_oxide::inflate::decompress_to_vec_zlib(&pdf[at..]).ok());
        let content = unpacked
            .filter_map(|bytes| String::from_utf8(bytes).ok())
            .find(|text| text.ends_with('f') || text.ends_with('S') || text.ends_with('Q'))
            .unwrap();
        assert!(!content.contains("NaN") && !content.contains("inf"));
        assert_eq!(content.matches("\nq\n").count(), content.matches("\nQ").count());
        assert_eq!(content.matches(" Do").count(), images);
    }
}

#[test]
fn figures_are_written_in_the_formats_that_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    sweep()
        .write(folder.path(), "sweep", &["svg", "PDF"].map(|name| name.parse().unwrap()), &Provenance::default())
        .unwrap();
    let written = |name: &str| folder.path().join(name).exists();
    assert!(written("sweep.svg") && written("sweep.pdf") && !written("sweep.png"));
    assert!("jpg".parse::<Format>().unwrap_err().to_string().contains("use png, svg or pdf"));
}

#[test]
fn all_texts_can_be_read() {
    for figure in [histories(), sweep(), patterns(64), spectrum(), mixed(), maps()] {
        assert_eq!(figure.illegible().unwrap(), [""; 0], "{}", figure.title);
    }
}

/// The texts of a drawing with their sizes.
fn texts(drawing: &Canvas) -> Vec<(&str, f64)> {
    let text = |shape| if let &Shape::Text { ref text, size, .. } = shape { Some((text.as_str(), size)) } else { None };
    drawing.shapes.iter().filter_map(text).collect()
}

/// Two rows of pictures with titles of several lengths and one bar of colours.
fn maps() -> Figure {
    let mesh = limitlab::mesh::builtin::builtin("cube").unwrap();
    let scale = ColourScale::logarithmic("error / L", (1e-6, 1e-1));
    let view = View::named("oblique").unwrap();
    let picture = |k: u32| {
        let surface = ShadedMesh::flat(mesh.clone()).scalars(vec![1e-3; 8], scale.clone());
        Picture::new(format!("k = {}: at most 0.1", 10_u64.pow(k)), view).surface(surface)
    };
    let figure = Figure::row((0..6).map(picture));
    Figure { width: 470, height: 260, columns: 3, colour_bar: Some(scale.clone()), ..figure }.headed("errors")
}

#[test]
fn titles_of_panels_have_one_size_and_stand_apart() {
    let drawing = maps().drawing().unwrap();
    let titles: Vec<(&str, f64)> = texts(&drawing).into_iter().filter(|(text, _)| text.starts_with("k =")).collect();
    assert_eq!(titles.len(), 6);
    // That of the longest.
    let size = crate::report::frame::title_size("k = 100000: at most 0.1", frames(&maps())[0].width());
    assert!(size < crate::report::frame::TITLE_SIZE);
    assert!(titles.iter().all(|title| (title.1 - size).abs() < 1e-9), "{titles:?}");
    let starts = drawing.shapes.iter().filter_map(|shape| match shape {
        Shape::Text { text, at, size, .. } if text.starts_with("k =") => Some((at.0, text_width(text, *size))),
        _ => None,
    });
    let starts: Vec<(f64, f64)> = starts.collect();
    assert!(starts[3..].windows(2).all(|w| w[1].0 - (w[0].0 + w[0].1) >= 10.0), "{starts:?}");
}

#[test]
fn pictures_share_one_bar_of_colours_with_its_ends_labelled() {
    let figure = maps();
    let drawing = figure.drawing().unwrap();
    let images: Vec<Point> = drawing
        .shapes
        .iter()
        .filter_map(|shape| if let &Shape::Image { corner, .. } = shape { Some(corner) } else { None })
        .collect();
    // Six pictures, then the bar, to the right of all and across both rows.
    assert_eq!(images.len(), 7);
    let frames = frames(&figure);
    assert!(frames.iter().all(|frame| frame.right < images[6].0));
    assert!(images[6].1 < frames[0].bottom);
    let labels: Vec<&str> = texts(&drawing).iter().map(|(text, _)| *text).collect();
    assert!(labels.contains(&"10⁻¹") && labels.contains(&"10⁻⁶"), "{labels:?}");
    assert_eq!(labels.iter().filter(|label| **label == "error / L").count(), 1);
}

#[test]
fn drawings_without_axes_stand_bare_in_the_middle() {
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let plot = LinePlot {
        title: "a square".into(),
        x_label: "nothing".into(),
        equal_units: true,
        without_axes: true,
        series: vec![Series::line("", square).colour(Colour(255, 0, 0))],
        ..LinePlot::default()
    };
    let figure = Figure::new(plot);
    let drawing = figure.drawing().unwrap();
    assert_eq!(texts(&drawing), [("a square", crate::report::frame::TITLE_SIZE)]);
    let [_, Shape::Text { .. }] = &drawing.shapes[..] else { panic!("more than a line and a title: {drawing:?}") };
    let Shape::Lines { paths, .. } = &drawing.shapes[0] else { panic!("no line") };
    let ends = paths.iter().flatten().map(|&(x, y)| Rect { left: x, right: x, top: y, bottom: y });
    let area = ends.reduce(Rect::around).unwrap();
    let (centre, frame) = (area.centre(), frames(&figure)[0].centre());
    assert!((centre.0 - frame.0).abs() < 1e-6 * area.width() && (centre.1 - frame.1).abs() < 10.0, "{area:?}");
    assert!((area.width() - area.height()).abs() < 1e-6 && area.height() > 300.0);
}

#[test]
fn no_line_hides_a_marker() {
    let line = |marker| Series::line("", [(0.0, 0.0), (1.0, 1.0)]).marker(marker);
    let plot = LinePlot { series: vec![line(Marker::Circle), line(Marker::Square)], ..LinePlot::default() };
    let drawing = Figure::new(plot).drawing().unwrap();
    let lines = drawing.shapes.iter().rposition(|shape| matches!(shape, Shape::Lines { .. }));
    let discs = drawing.shapes.iter().position(|shape| matches!(shape, Shape::Disc { .. }));
    assert!(lines.unwrap() < discs.unwrap());
}

#[test]
fn bold_lines_are_twice_as_wide() {
    let line = |bold| Series { bold, ..Series::line("a line", [(0.0, 0.0), (1.0, 1.0)]).colour(Colour(255, 0, 0)) };
    let plot = LinePlot { series: vec![line(false), line(true)], ..LinePlot::default() };
    let drawing = Figure::new(plot).drawing().unwrap();
    let width = |shape: &Shape| match shape {
        Shape::Lines { width, colour: Colour(255, 0, 0), .. } => Some(*width),
        _ => None,
    };
    // In the frame, then in the legend.
    let widths: Vec<f64> = drawing.shapes.iter().filter_map(width).collect();
    assert_eq!(widths.iter().map(|w| w / widths[0]).collect::<Vec<_>>(), [1.0, 2.0, 1.0, 2.0]);
}

#[test]
fn the_legend_explains_arrowheads_where_there_are_some() {
    let legend = |points: [(f64, f64); 2], x_range| {
        let series = vec![Series::line("", points)];
        let plot = LinePlot { series, x_range, arrows: "goes on".into(), ..LinePlot::default() };
        texts(&Figure::new(plot).drawing().unwrap()).iter().any(|(text, _)| *text == "goes on")
    };
    assert!(!legend([(0.0, 1.0), (2.0, 2.0)], None));
    assert!(!legend([(0.0, 1.0), (2.0, 2.0)], Some((0.0, 2.0))));
    assert!(legend([(0.0, 1.0), (2.0, 2.0)], Some((0.0, 1.5))));
    assert!(legend([(0.0, 1.0), (2.0, f64::INFINITY)], None));
}

#[test]
fn curves_that_go_on_end_in_arrowheads() {
    let arrows = |series: Series, y_range| {
        let plot = LinePlot { series: vec![series.colour(Colour(255, 0, 0))], y_range, ..LinePlot::default() };
        let drawing = Figure::new(plot).drawing().unwrap();
        let is_red = |shape: &&Shape| matches!(shape, Shape::Polygon { colour: Colour(255, 0, 0), .. });
        drawing.shapes.iter().filter(is_red).count()
    };
    let line = |ys: &[f64]| Series::line("", ys.iter().enumerate().map(|(k, &y)| (k as f64, y)));
    assert_eq!(arrows(line(&[1.0, 2.0, 3.0]), None), 0);
    assert_eq!(arrows(Series { goes_on: true, ..line(&[1.0, 2.0, 3.0]) }, None), 1);
    // Out through the top: once, and not where it comes back.
    assert_eq!(arrows(line(&[1.0, 2.0, 3.0]), Some((0.0, 2.5))), 1);
    assert_eq!(arrows(line(&[1.0, 3.0, 1.0]), Some((0.0, 2.5))), 0);
    // Two places without an end of the count.
    assert_eq!(arrows(line(&[1.0, 2.0, f64::INFINITY, f64::INFINITY]), None), 2);
}

#[test]
fn no_marker_covers_an_arrowhead() {
    let red = Colour(255, 0, 0);
    let near_the_edge = Series::line("", [(0.0, 1.0), (9.95, 1.0), (20.0, 1.0)]).colour(red).marker(Marker::Circle);
    let plot = LinePlot { series: vec![near_the_edge], x_range: Some((0.0, 10.0)), ..LinePlot::default() };
    let drawing = Figure::new(plot).drawing().unwrap();
    let place = |wanted: fn(&Shape) -> bool| drawing.shapes.iter().rposition(wanted);
    let discs = drawing.shapes.iter().filter(|s| matches!(s, Shape::Disc { colour: Colour(255, 0, 0), .. }));
    assert_eq!(discs.count(), 1);
    let disc = place(|s| matches!(s, Shape::Disc { .. })).unwrap();
    let arrow = place(|s| matches!(s, Shape::Polygon { colour: Colour(255, 0, 0), .. })).unwrap();
    assert!(disc < arrow);
}

#[test]
fn nothing_reaches_the_border_of_the_picture() {
    for figure in [histories(), sweep(), patterns(64), spectrum()] {
        let image = figure.render().unwrap();
        let (width, height) = (f64::from(figure.width), f64::from(figure.height));
        let strip = |left, top, right, bottom| Rect { left, top, right, bottom };
        for side in [
            strip(0.0, 0.0, width, 1.0),
            strip(0.0, height - 1.0, width, height),
            strip(0.0, 0.0, 1.0, height),
            strip(width - 1.0, 0.0, width, height),
        ] {
            assert_eq!(ink(&image, side), 0.0, "{:?}", figure.title);
        }
    }
}

#[test]
fn the_legend_stands_beside_the_data() {
    let figure = histories();
    let frame = frames(&figure)[0];
    let bare = {
        let mut figure = figure.clone();
        for panel in &mut figure.panels {
            let Panel::Lines(plot) = panel else { unreachable!() };
            plot.series.iter_mut().for_each(|s| s.name.clear());
            plot.horizontal_lines[0].label.clear();
        }
        figure
    };
    let wide = frames(&bare)[0];
    assert!(wide.right > frame.right + 50.0, "the legend takes room from the frame");
    let image = figure.render().unwrap();
    // Between frame and legend there is nothing, in the legend there is something.
    let gap = Rect { left: frame.right + 1.0, right: frame.right + 8.0, ..frame };
    assert_eq!(ink(&image, gap), 0.0);
    let legend = Rect { left: frame.right + 8.0, right: f64::from(figure.width), ..frame };
    assert!(ink(&image, legend) > 0.01);
}

#[test]
fn stacked_panels_are_in_line() {
    let frames = frames(&sweep());
    assert_eq!((frames[0].left, frames[0].right), (frames[1].left, frames[1].right));
    assert!((frames[0].height() - frames[1].height()).abs() < 1e-9);
    assert!(frames[0].bottom < frames[1].top);
    let figure = sweep();
    assert_eq!(figure.x_axis(0), figure.x_axis(1));
}

#[test]
fn curves_stay_in_the_frame_and_break_where_there_is_no_value() {
    let red = Colour(255, 0, 0);
    let points = [(0.0, 1e-3), (1.0, 1e3), (2.0, 1e-3), (3.0, 0.0), (4.0, 1e-1), (5.0, 1e-1)];
    let figure = Figure::new(LinePlot {
        y_scale: Scale::Log,
        x_range: Some((0.0, 5.0)),
        y_range: Some((1e-2, 1e0)),
        series: vec![Series::line("", points).colour(red)],
        ..LinePlot::default()
    });
    let image = figure.render().unwrap();
    let frame = frames(&figure)[0];
    let is_red = |x: u32, y: u32| {
        let [r, g, b] = image.pixel(x, y);
        r > 200 && g < 60 && b < 60
    };
    let columns = |from: f64, to: f64| {
        let px = |v: f64| ((frame.left + v / 5.0 * frame.width()) * f64::from(PIXELS_PER_POINT)) as u32;
        (px(from)..px(to)).map(|x| (0..image.height).filter(|&y| is_red(x, y)).count())
    };
    assert!(columns(0.2, 0.3).all(|n| n > 0), "the rising branch crosses the frame");
    assert!(columns(0.7, 1.3).all(|n| n == 0), "nothing is drawn along the upper edge");
    assert!(columns(2.1, 3.9).all(|n| n == 0), "the point at 0 has no line to it");
    assert!(columns(4.1, 4.9).all(|n| n > 0), "the line goes on after the gap");
    let outside = (0..image.height)
        .flat_map(|y| (0..image.width).map(move |x| (x, y)))
        .filter(|&(x, y)| is_red(x, y))
        .filter(|&(x, y)| {
            let at = |v: u32| (f64::from(v) + 0.5) / f64::from(PIXELS_PER_POINT);
            let (x, y) = (at(x), at(y));
            // A slanted line of 1.3 points ends at a right angle, so half its width may show.
            let grown = Rect {
                left: frame.left - 0.7,
                top: frame.top - 0.7,
                right: frame.right + 0.7,
                bottom: frame.bottom + 0.7,
            };
            !grown.contains((x, y))
        });
    assert_eq!(outside.count(), 0);
}

#[test]
fn no_room_is_an_error_of_one_line() {
    let mut figure = histories();
    figure.width = 120;
    let message = figure.render().unwrap_err().to_string();
    assert!(message.contains("120×380") && !message.contains('\n'), "{message}");
}

#[test]
fn empty_plots_are_drawn() {
    assert!(Figure::new(LinePlot::default()).render().is_ok());
    assert!(Figure::row([SparsityPlot::new("", 0, [])]).render().is_ok());
    let none: [LinePlot; 0] = [];
    let figure = Figure { height: 100, ..Figure::stack(none) };
    assert!(figure.render().is_ok());
}

/// Entries 16, 4 and 1 in blocks: black, and a half and a quarter of the way from there to the lightest grey.
#[test]
fn blocks_darken_with_the_square_root_of_their_entries() {
    let entries = [(0, 16), (1, 4), (2, 1)].into_iter().flat_map(|(i, count)| std::iter::repeat_n((i, i), count));
    let image = Figure::row([SparsityPlot::new("", 3, entries)]).render().unwrap();
    let pixels = |grey: u8| {
        let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
        all.filter(|&(x, y)| image.pixel(x, y) == [grey; 3]).count()
    };
    let block = pixels(75);
    assert!(block > 1000, "{block}");
    // 112.5, rounded.
    assert!(pixels(113).abs_diff(block) < block / 20 && pixels(0) > block / 20 * 19);
}

#[test]
fn equal_units_make_a_circle_round() {
    let circle = (0..=200).map(|i| (f64::from(i) * std::f64::consts::TAU / 200.0).sin_cos());
    let figure = Figure::new(LinePlot {
        equal_units: true,
        series: vec![Series::line("", circle).colour(Colour(255, 0, 0))],
        ..LinePlot::default()
    });
    let image = figure.render().unwrap();
    let red = |x: u32, y: u32| image.pixel(x, y)[0] > 200 && image.pixel(x, y)[1] < 60;
    let columns = (0..image.width).filter(|&x| (0..image.height).any(|y| red(x, y)));
    let rows = (0..image.height).filter(|&y| (0..image.width).any(|x| red(x, y)));
    let (width, height) = (columns.count(), rows.count());
    assert!(width.abs_diff(height) <= 2, "{width}×{height}");
    assert!(height > 700, "it fills the frame: {height}");
}

#[test]
fn a_shared_axis_keeps_the_range_that_was_asked_for() {
    let figure = sweep();
    let axis = figure.x_axis(0);
    assert_eq!((axis.lo, axis.hi), (0.0, 1.2));
}
