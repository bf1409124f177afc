//! The rasteriser against coverage and order that can be counted by hand.

use glam::DVec3;

use super::scene::Scene;
use super::*;
use crate::report::{Figure, Image, Scale};
use limitlab::mesh::builtin::builtin;
use limitlab::mesh::{Faces, Mesh};

const RED: Colour = Colour(255, 0, 0);
const BLUE: Colour = Colour(0, 0, 255);
const WHITE: [u8; 3] = [255; 3];

fn mesh(positions: &[[f64; 3]], faces: &[&[u32]]) -> Mesh {
    Mesh::new(positions.iter().copied().map(DVec3::from).collect(), Faces::from_lists(faces))
}

/// Corners such that a pixel is a unit: the margin, 3 % of 100 pixels on each side, is as it falls.
const FRAME: [[f64; 2]; 2] = [[-47.0, -47.0], [47.0, 47.0]];

/// A picture from the front, in which (x, y) is at pixel (50 + x, 50 − y) of 100×100.
fn picture() -> Picture {
    let corners = FRAME.map(|[x, y]| DVec3::new(x, y, 0.0));
    Picture::new("", View::named("front").unwrap()).frame(&corners)
}

/// Drawn pixels without smoothing, a pixel a point.
fn drawn(picture: &Picture) -> Image {
    raster::draw(&Scene::new(picture, (100, 100), 1.0).unwrap(), 100, 100)
}

/// The pixels that are not white, as (x, y).
fn covered(image: &Image) -> Vec<(u32, u32)> {
    let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    all.filter(|&(x, y)| image.pixel(x, y) != WHITE).collect()
}

fn is_reddish([r, _, b]: [u8; 3]) -> bool {
    r > b
}

#[test]
fn a_triangle_covers_the_pixels_whose_centres_it_holds() {
    // Legs of four pixels from (0, 0): of the centres (i+½, j+½), those with i + j < 3 are inside, and the four on
    // the hypotenuse belong to the triangle to its right. On screen the hypotenuse is the right side.
    let lower = mesh(&[[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]], &[&[0, 1, 2]]);
    let upper = mesh(&[[4., 4., 0.], [0., 4., 0.], [4., 0., 0.]], &[&[0, 1, 2]]);
    let count = |mesh: &Mesh| covered(&drawn(&picture().surface(ShadedMesh::flat(mesh.clone()))));
    let (a, b) = (count(&lower), count(&upper));
    assert_eq!((a.len(), b.len()), (6, 10), "{a:?}");
    for i in 0..4 {
        for j in 0..4 {
            let at = (50 + i, 49 - j);
            assert_eq!(a.contains(&at), i + j < 3, "{at:?}");
            assert_eq!(b.contains(&at), i + j >= 3, "{at:?}");
        }
    }
}

#[test]
fn a_fan_leaves_no_gap_and_no_overlap() {
    // A 40-gon of 40 triangles around a point off its centre, each drawn alone: every pixel in exactly one.
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / 40.0).sin_cos();
        [31.37 * cos, 31.37 * sin, 0.0]
    };
    let hub = [3.21, -7.83, 0.0];
    let mut times = vec![0; 100 * 100];
    for k in 0..40 {
        let one = mesh(&[hub, corner(k), corner(k + 1)], &[&[0, 1, 2]]);
        for (x, y) in covered(&drawn(&picture().surface(ShadedMesh::flat(one)))) {
            times[(y * 100 + x) as usize] += 1;
        }
    }
    for (at, &times) in times.iter().enumerate() {
        let (x, y) = ((at % 100) as f64 + 0.5 - 50.0, (at / 100) as f64 + 0.5 - 50.0);
        // The polygon lies between its inner and its outer circle.
        if x.hypot(y) < 31.37 * (std::f64::consts::PI / 40.0).cos() - 0.01 {
            assert_eq!(times, 1, "({x}, {y})");
        }
        if x.hypot(y) > 31.38 {
            assert_eq!(times, 0, "({x}, {y})");
        }
    }
}

/// A square of side 20 about the origin at height `z`.
fn square(z: f64) -> Mesh {
    mesh(&[[-10., -10., z], [10., -10., z], [10., 10., z], [-10., 10., z]], &[&[0, 1, 2, 3]])
}

#[test]
fn the_nearest_is_seen_whatever_the_order() {
    let near = ShadedMesh::flat(square(1.0)).colour(RED);
    let far = ShadedMesh::flat(square(-1.0)).colour(BLUE);
    for surfaces in [[near.clone(), far.clone()], [far, near]] {
        let [a, b] = surfaces;
        let image = drawn(&picture().surface(a).surface(b));
        assert_eq!(covered(&image).len(), 400);
        assert!(covered(&image).iter().all(|&(x, y)| is_reddish(image.pixel(x, y))));
    }
}

#[test]
fn planes_that_cross_change_places_where_they_meet() {
    // z = x/2 in red against z = 0 in blue: red is nearer at x > 0.
    let mut tilted = square(0.0);
    for p in &mut tilted.positions {
        p.z = p.x / 2.0;
    }
    let image = drawn(
        &picture().surface(ShadedMesh::flat(square(0.0)).colour(BLUE)).surface(ShadedMesh::flat(tilted).colour(RED)),
    );
    for (x, y) in covered(&image) {
        assert_eq!(is_reddish(image.pixel(x, y)), x >= 50, "({x}, {y})");
    }
    // The same in perspective, where depth is not linear in the picture: they meet at x = 0 still.
    let mut view = picture();
    view.view = view.view.perspective(90.0);
    let mut tilted = square(0.0);
    for p in &mut tilted.positions {
        p.z = p.x / 2.0;
    }
    let image =
        drawn(&view.surface(ShadedMesh::flat(square(0.0)).colour(BLUE)).surface(ShadedMesh::flat(tilted).colour(RED)));
    for (x, y) in covered(&image) {
        assert_eq!(is_reddish(image.pixel(x, y)), x >= 50, "({x}, {y})");
    }
}

#[test]
fn clockwise_faces_show_their_back() {
    let mut turned = square(0.0);
    turned.faces = Faces::from_lists([[3, 2, 1, 0]]);
    let two_sided = |mesh: Mesh| ShadedMesh { back: Some(BLUE), ..ShadedMesh::flat(mesh).colour(RED) };
    let front = drawn(&picture().surface(two_sided(square(0.0))));
    let back = drawn(&picture().surface(two_sided(turned.clone())));
    assert!(is_reddish(front.pixel(50, 50)) && !is_reddish(back.pixel(50, 50)));
    // Without a colour of its own a back side looks as the front: light comes from the eye's side.
    let plain = drawn(&picture().surface(ShadedMesh::flat(turned).colour(RED)));
    assert_eq!(plain.pixel(50, 50), front.pixel(50, 50));
}

#[test]
fn concave_quads_are_cut_inside() {
    // A dart: the corner (0, −2) is re-entrant, and (0, −6) lies outside.
    let points = [[0., 10., 0.], [-10., -10., 0.], [0., -2., 0.], [10., -10., 0.]];
    for turn in 0..4_u32 {
        let face: Vec<u32> = (0..4).map(|k| (k + turn) % 4).collect();
        let image = drawn(&picture().surface(ShadedMesh::flat(mesh(&points, &[&face]))));
        assert_eq!(image.pixel(50, 56), WHITE, "outside");
        assert_ne!(image.pixel(50, 48), WHITE, "inside");
        // Shoelace: |Σ x_i y_{i+1} − x_{i+1} y_i|/2 = 120.
        assert!(covered(&image).len().abs_diff(120) <= 4);
    }
}

#[test]
fn edges_in_front_are_drawn_and_those_behind_are_hidden() {
    let black = |image: &Image| {
        covered(image).into_iter().filter(|&(x, y)| image.pixel(x, y).iter().all(|&c| c < 60)).collect::<Vec<_>>()
    };
    // An upright line through the middle, as the edge between two triangles, before and behind a square.
    let line = |z: f64| mesh(&[[0., -5., z], [0., 5., z], [0., 5., z]], &[&[0, 1, 2]]);
    let with = |z: f64| {
        let wire = ShadedMesh::wireframe(line(z), 1.0);
        drawn(&picture().surface(ShadedMesh::flat(square(0.0)).colour(RED)).surface(wire))
    };
    // One pixel wide and ten long, with round ends.
    let seen = black(&with(3.0));
    assert!((10..=24).contains(&seen.len()), "{seen:?}");
    assert!(seen.iter().all(|&(x, y)| (49..=50).contains(&x) && (44..=55).contains(&y)), "{seen:?}");
    assert_eq!(black(&with(-3.0)), []);
    // On the surface itself: shown in full. A pixel is a unit and the offset two.
    assert_eq!(black(&with(0.0)), seen);
    assert_eq!(black(&with(-1.9)), seen);
    assert_eq!(black(&with(-2.1)), []);
}

#[test]
fn a_box_hides_its_three_far_edges() {
    // The cube from an oblique direction: nine edges seen, the three at the hidden corner not.
    let cube = builtin("cube").unwrap();
    let view = View::named("oblique").unwrap();
    let hidden = cube
        .positions
        .iter()
        .copied()
        .min_by(|a, b| a.dot(view.toward_eye).total_cmp(&b.dot(view.toward_eye)))
        .unwrap();
    let scene = |surface: ShadedMesh| Scene::new(&Picture::new("", view).surface(surface), (300, 300), 1.0).unwrap();
    let solid = raster::draw(&scene(ShadedMesh::flat(cube.clone()).edges(2.0)), 300, 300);
    let wires = raster::draw(&scene(ShadedMesh::wireframe(cube.clone(), 2.0)), 300, 300);
    let camera = camera::Camera::framing(&view, &cube.positions, (300, 300)).unwrap();
    let EdgeMiddles { near, far } = edge_middles(&cube, hidden);
    assert_eq!((near.len(), far.len()), (9, 3));
    let is_line = |image: &Image, p: DVec3| {
        let seen = camera.project(p).unwrap();
        image.pixel(seen.x as u32, seen.y as u32) == [30, 30, 40]
    };
    assert!(near.iter().all(|&p| is_line(&solid, p) && is_line(&wires, p)));
    assert!(far.iter().all(|&p| !is_line(&solid, p) && is_line(&wires, p)));
}

struct EdgeMiddles {
    near: Vec<DVec3>,
    far: Vec<DVec3>,
}

/// Points at a third of every edge, away from crossings.
fn edge_middles(mesh: &Mesh, hidden: DVec3) -> EdgeMiddles {
    let mut found = EdgeMiddles { near: Vec::new(), far: Vec::new() };
    for face in mesh.faces.iter() {
        for (&a, &b) in face.iter().zip(face.iter().cycle().skip(1)) {
            let (p, q) = (mesh.positions[a as usize], mesh.positions[b as usize]);
            if a < b {
                let list = if p == hidden || q == hidden { &mut found.far } else { &mut found.near };
                list.push(p.lerp(q, 0.37));
            }
        }
    }
    found
}

#[test]
fn balls_are_discs_half_sunk_in_a_surface() {
    let balls = |z: f64| Points { positions: vec![DVec3::new(0.0, 0.0, z)], radius: 6.0, colour: BLUE };
    let blue = |z: f64| {
        let image = drawn(&picture().surface(ShadedMesh::flat(square(0.0)).colour(RED)).points(balls(z)));
        covered(&image).into_iter().filter(|&(x, y)| !is_reddish(image.pixel(x, y))).count()
    };
    // Area 36π = 113; sunk to the depth z, the circle of radius √(36 − z²) is left.
    assert!(blue(0.0).abs_diff(113) <= 5 && blue(6.0).abs_diff(113) <= 5);
    assert!(blue(-4.0).abs_diff(63) <= 5, "{}", blue(-4.0));
    assert_eq!(blue(-6.5), 0);
}

#[test]
fn arrows_run_from_tail_to_tip() {
    let image = drawn(&picture().vectors(Vectors {
        tails: vec![DVec3::new(-20.0, 0.0, 0.0), DVec3::ZERO],
        vectors: vec![DVec3::new(40.0, 0.0, 0.0), DVec3::ZERO],
        width: 4.0,
        colour: BLUE,
    }));
    let pixels = covered(&image);
    let (left, right) = (pixels.iter().map(|p| p.0).min(), pixels.iter().map(|p| p.0).max());
    assert_eq!(left, Some(30));
    assert!(right.is_some_and(|x| (67..=69).contains(&x)), "{right:?}");
    let height = |x: u32| pixels.iter().filter(|p| p.0 == x).count();
    assert!((3..=5).contains(&height(40)), "shaft {}", height(40));
    // The head is 18 long from x = 52 and 13.6 high there.
    assert!((10..=15).contains(&height(53)), "head {}", height(53));
    assert!(height(67) <= 3);
}

#[test]
fn scalars_run_through_the_map() {
    // A strip whose number is its x, from 0 to 1 over 80 pixels.
    let strip = mesh(&[[-40., -5., 0.], [40., -5., 0.], [40., 5., 0.], [-40., 5., 0.]], &[&[0, 1, 2, 3]]);
    let scale = ColourScale::linear("x", (0.0, 1.0));
    let image = drawn(&picture().surface(ShadedMesh::flat(strip).scalars(vec![0.0, 1.0, 1.0, 0.0], scale)));
    // Light is the same all along: the ratio to the map's colour is too.
    for (x, t) in [(10, 0.00625), (30, 0.25625), (50, 0.50625), (70, 0.75625), (89, 0.99375)] {
        let Colour(r, g, b) = ColourMap::Sequential.colour(t);
        let shown = image.pixel(x, 50);
        let full = f64::from(r) + f64::from(g) + f64::from(b);
        let lit = shown.iter().map(|&c| f64::from(c)).sum::<f64>() / full;
        for (c, full) in shown.into_iter().zip([r, g, b]) {
            assert!((f64::from(c) - lit * f64::from(full)).abs() < 4.0, "{x}: {shown:?}");
        }
        assert!((0.6..=1.0).contains(&lit));
    }
}

#[test]
fn the_colour_bar_ends_with_the_ends_of_the_map() {
    for (scale, ends) in [
        (ColourScale::logarithmic("error", (1e-6, 1.0)), [[68, 1, 84], [253, 231, 37]]),
        (ColourScale::signed("mode", 2.0), [[59, 76, 192], [180, 4, 38]]),
    ] {
        let picture = picture().surface(ShadedMesh::flat(square(0.0)));
        let image = Figure { colour_bar: Some(scale), ..Figure::row([picture]) }.render().unwrap();
        // Down the column with the most colours of the map's upper end.
        let near = |pixel: [u8; 3], wanted: [u8; 3]| pixel.iter().zip(wanted).all(|(&a, b)| a.abs_diff(b) <= 6);
        let column =
            (0..image.width).find(|&x| (0..image.height).any(|y| near(image.pixel(x, y), ends[1]))).expect("a bar");
        let x = column + 6;
        let rows = |wanted| (0..image.height).filter(|&y| near(image.pixel(x, y), wanted)).collect::<Vec<_>>();
        let (bottom, top) = (rows(ends[0]), rows(ends[1]));
        assert!(!bottom.is_empty() && !top.is_empty());
        assert!(top.iter().max() < bottom.iter().min(), "the greatest number is on top");
    }
}

#[test]
fn a_picture_that_something_reaches_out_of_has_an_outline() {
    // Grey beside the middle of the left edge of the frame.
    let is_outlined = |framed: &[DVec3]| {
        let cube = builtin("cube").unwrap();
        let picture = Picture::new("", View::named("front").unwrap()).surface(ShadedMesh::flat(cube));
        let image = Figure::row([picture.frame(framed)]).render().unwrap();
        let middle = image.height / 2;
        let edge = (0..image.width).map(|x| image.pixel(x, middle)).find(|pixel| *pixel != WHITE);
        edge.is_some_and(|[r, g, b]| r == g && g == b)
    };
    let all = builtin("cube").unwrap().positions;
    assert!(!is_outlined(&all));
    assert!(is_outlined(&all.iter().map(|p| 0.5 * *p).collect::<Vec<_>>()));
}

#[test]
fn edges_are_told_from_the_darkest_colour_of_a_map() {
    let brightness = |Colour(r, g, b): Colour| u32::from(r) + u32::from(g) + u32::from(b);
    let cube = ShadedMesh::flat(builtin("cube").unwrap());
    let map = cube.clone().scalars(vec![0.0; 8], ColourScale::linear("", (0.0, 1.0)));
    let edge = |surface: ShadedMesh| brightness(surface.edges(1.0).edges.unwrap().colour);
    assert!(edge(map) > brightness(ColourMap::Sequential.colour(0.0)) + 200);
    assert!(edge(cube) < brightness(SURFACE_COLOUR) - 200);
}

#[test]
fn the_same_picture_gives_the_same_bytes_on_any_number_of_threads() {
    let mesh = builtin("irregular-poly:300").unwrap();
    let picture = Picture::new("a mesh", View::named("oblique").unwrap().perspective(30.0))
        .surface(ShadedMesh::smooth(mesh.clone()).edges(0.4))
        .points(Points { positions: mesh.positions, radius: 1.0, colour: RED });
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let image = pool.install(|| Figure::row([picture.clone()]).render()).unwrap();
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).unwrap();
        bytes
    };
    let once = bytes(1);
    assert!(once == bytes(1) && once == bytes(4));
}

#[test]
fn bands_join_without_a_seam() {
    // The diagonal of a square that fills rows of two bands, on the surface itself.
    let halves = mesh(&[[-40., -40., 0.], [40., -40., 0.], [40., 40., 0.], [-40., 40., 0.]], &[&[0, 1, 2], &[0, 2, 3]]);
    let image = drawn(&picture().surface(ShadedMesh::flat(halves).colour(RED).edges(3.0)));
    for y in 16..84 {
        let is_line = |x: &u32| !is_reddish(image.pixel(*x, y));
        let row: Vec<u32> = (13..87).filter(is_line).collect();
        // 3·√2 pixels of every row, about x = 99 − y.
        assert!((4..=5).contains(&row.len()), "{y}: {row:?}");
        assert!(row.contains(&(99 - y)));
    }
}

#[test]
fn what_cannot_be_drawn_says_so() {
    let message = |picture: Picture| {
        let error = Figure::row([picture]).render().expect_err("no picture").to_string();
        assert!(!error.contains('\n'), "{error}");
        error
    };
    let view = View::named("front").unwrap();
    let mut broken = square(0.0);
    broken.positions[2].y = f64::NAN;
    let said = message(Picture::new("", view).surface(ShadedMesh::flat(broken)));
    assert!(said.contains("surface 0, vertex 2 is not finite"), "{said}");
    let missing = mesh(&[[0.; 3], [1.; 3]], &[&[0, 1, 7]]);
    let said = message(Picture::new("", view).surface(ShadedMesh::flat(missing)));
    assert!(said.contains("face 0 names a vertex that is not there"), "{said}");
    let normals = vec![DVec3::Z, DVec3::Z, DVec3::Z, DVec3::INFINITY];
    let said = message(Picture::new("", view).surface(ShadedMesh::with_normals(square(0.0), normals)));
    assert!(said.contains("the normal of vertex 3"), "{said}");
    let scale = ColourScale::linear("x", (0.0, 1.0));
    let scalars = vec![0.0, f64::NAN, 0.0, 0.0];
    let said = message(Picture::new("", view).surface(ShadedMesh::flat(square(0.0)).scalars(scalars, scale)));
    assert!(said.contains("the number of vertex 1"), "{said}");
    assert!(message(Picture::new("", view)).contains("no points"));
    // Behind the eye, where not all is framed.
    let behind = ShadedMesh::flat(square(1000.0));
    let said = message(picture_in_perspective().surface(behind));
    assert!(said.contains("vertex 0 at") && said.contains("behind the eye"), "{said}");
}

fn picture_in_perspective() -> Picture {
    let mut picture = picture();
    picture.view = picture.view.perspective(40.0);
    picture
}

#[test]
fn degenerate_faces_are_no_trouble() {
    // Coincident and collinear corners cover nothing, with or without normals of their own.
    let flat = mesh(&[[0.; 3], [10., 0., 0.], [20., 0., 0.]], &[&[0, 1, 2], &[0, 0, 1]]);
    for surface in [ShadedMesh::flat(flat.clone()), ShadedMesh::smooth(flat)] {
        assert_eq!(covered(&drawn(&picture().surface(surface))), []);
    }
    // Zero normals fall back on the face's.
    let none = drawn(&picture().surface(ShadedMesh::with_normals(square(0.0), vec![DVec3::ZERO; 4])));
    assert_eq!(none, drawn(&picture().surface(ShadedMesh::flat(square(0.0)))));
}

#[test]
fn zero_has_the_colour_of_the_least_on_a_logarithmic_scale() {
    let scale = ColourScale::logarithmic("error", (1e-6, 1.0));
    assert_eq!(scale.scale, Scale::Log);
    let at =
        |value: f64| drawn(&picture().surface(ShadedMesh::flat(square(0.0)).scalars(vec![value; 4], scale.clone())));
    assert_eq!(at(0.0), at(1e-6));
    assert_eq!(at(-1.0), at(1e-9));
    assert_ne!(at(1e-3), at(1e-6));
}

#[test]
fn a_sphere_is_round_and_lit_from_the_upper_left() {
    let sphere = builtin("icosphere:4").unwrap();
    let normals = sphere.positions.clone();
    let picture = Picture::new("", View::named("front").unwrap()).surface(ShadedMesh::with_normals(sphere, normals));
    let image = raster::draw(&Scene::new(&picture, (200, 200), 1.0).unwrap(), 200, 200);
    let area = covered(&image).len() as f64;
    let expected = std::f64::consts::PI * 94.0_f64.powi(2);
    assert!((area / expected - 1.0).abs() < 5e-3, "{area} {expected}");
    let [lit, dark] = [(60, 60), (140, 140)].map(|(x, y)| image.pixel(x, y)[1]);
    assert!(lit > dark + 60, "{lit} {dark}");
}

#[test]
fn paint_by_face_shows_each_face_in_its_colour() {
    let two = mesh(
        &[[-10., -10., 0.], [0., -10., 0.], [0., 10., 0.], [-10., 10., 0.], [10., -10., 0.], [10., 10., 0.]],
        &[&[0, 1, 2, 3], &[1, 4, 5, 2]],
    );
    let surface = ShadedMesh { paint: Some(Paint::Faces(vec![RED, BLUE])), ..ShadedMesh::flat(two) };
    let image = drawn(&picture().surface(surface));
    assert!(is_reddish(image.pixel(45, 50)) && !is_reddish(image.pixel(55, 50)));
}
