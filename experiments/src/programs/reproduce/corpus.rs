//! The meshes that the items run on: the real models, each with the built-in mesh that stands in for it, and the
//! lists of both.

use limitlab::mesh::validate::Boundary;
use limitlab::schemes::Scheme;

/// A real model.
#[derive(Clone, Copy)]
pub struct Model {
    /// Within the folder of `--meshes`.
    pub file: &'static str,
    /// What boundary vertices are taken for.
    pub boundary: Boundary,
    /// The built-in mesh that takes its place without that folder, of about its size.
    pub stand_in: &'static str,
}

const fn closed(file: &'static str, stand_in: &'static str) -> Model {
    Model { file, boundary: Boundary::Refuse, stand_in }
}

pub const BIRD: Model = closed("closed/psb_m32_bird_1129v.off", "irregular-tri:1129");
pub const BOB: Model = closed("closed/bob_334v_quad.off", "quad-sphere:3");
pub const BOB_TRIANGLES: Model = closed("closed/bob_small_250v.off", "tri-torus:12x7");
/// With its holes, as PIA Table 1 counts it: boundary vertices as interior ones.
pub const BOY: Model =
    Model { file: "open/psb_m149_boy_17342v_raw.off", boundary: Boundary::AsInterior, stand_in: "icosphere:5" };
pub const BOY_FILLED: Model = closed("closed/psb_m149_boy_17342v_holesfilled.off", "icosphere:5");
pub const BUNNY: Model = closed("closed/bunny_1839v.off", "irregular-tri:1129");
const FOX: Model = closed("closed/fox_313v.off", "irregular-tri:300");
pub const HAND: Model = closed("closed/psb_m329_hand_6191v.off", "irregular-tri:6191");
/// Zheng and Cai's model of 562 vertices.
pub const HAT: Model = closed("closed/psb_m1630_hat_562v.off", "irregular-tri:562");
pub const HORSE: Model = closed("closed/psb_m104_horse_233v.off", "irregular-tri:233");
const HORSE_QUADS: Model = closed("closed/horse_2400v_quad.off", "quad-sphere:4");
pub const LETTER: Model = closed("closed/letterp_26v_poly.off", "irregular-poly:40");
pub const MUSHROOM: Model = closed("closed/geomview_mushroom_226v.off", "irregular-quad:226");
/// In place of Zheng and Cai's model of 11 540 vertices, which is not at hand.
pub const SPOT: Model = closed("closed/spot_11533v.off", "irregular-tri:11540");
pub const SPOT_COARSE: Model = closed("closed/spot_188v_poly.off", "quad-sphere:2");
pub const SPOT_QUADS: Model = closed("closed/spot_2930v_quad.off", "quad-sphere:4");
pub const TRIPOD: Model = closed("closed/tripod_24v.off", "star:5");

/// The meshes of one item, each with what the item does on it: of the real models, and of the built-in meshes where
/// these are not the models' stand-ins one by one.
pub struct List<T: 'static> {
    pub models: &'static [(Model, T)],
    pub built_in: &'static [(&'static str, T)],
}

pub const SWEEPS: List<Scheme> = List {
    models: &[
        (HORSE, Scheme::Loop),
        (SPOT_QUADS, Scheme::CatmullClark),
        (SPOT_COARSE, Scheme::CatmullClark),
        (HAT, Scheme::ZhengCai),
    ],
    built_in: &[
        ("torus:32x32", Scheme::CatmullClark),
        ("quad-sphere:4", Scheme::CatmullClark),
        ("icosphere:3", Scheme::Loop),
        ("irregular-quad:1000", Scheme::CatmullClark),
        ("irregular-poly:1000", Scheme::Nasri),
    ],
};

/// Of iteration matrices: quick runs take the first.
pub const SPLITTINGS: List<Scheme> = List {
    models: &[
        (SPOT_COARSE, Scheme::CatmullClark),
        (HORSE, Scheme::Loop),
        (BOB, Scheme::CatmullClark),
        (HAT, Scheme::ZhengCai),
    ],
    built_in: &[
        ("torus:12x12", Scheme::CatmullClark),
        ("icosphere:2", Scheme::Loop),
        ("irregular-quad:300", Scheme::CatmullClark),
        ("torus:24x24", Scheme::Nasri),
    ],
};

pub const ORDERS: List<&[Scheme]> = List {
    models: &[(HAT, &[Scheme::ZhengCai, Scheme::Loop]), (BOB, &[Scheme::CatmullClark])],
    built_in: &[
        ("torus:24x24", &[Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai]),
        ("irregular-quad:500", &[Scheme::CatmullClark, Scheme::Nasri]),
        ("icosphere:2", &[Scheme::Loop, Scheme::Sqrt3]),
        ("irregular-tri:500", &[Scheme::Loop, Scheme::ZhengCai]),
    ],
};

pub const POPPING: List<()> = List {
    models: &[(HORSE, ()), (BUNNY, ()), (FOX, ())],
    built_in: &[("icosahedron", ()), ("icosphere:1", ()), ("irregular-tri:300", ())],
};

/// Of the freedom of first refined meshes: the first in quick runs too.
pub const FREEDOM: [Model; 5] = [LETTER, HORSE, BOB, HAT, SPOT];

/// With the number of Catmull-Clark refinements.
pub const LINES: List<usize> = List {
    models: &[
        (BOB, 0),
        (BOB, 1),
        (BOB, 2),
        (SPOT_QUADS, 0),
        (SPOT_QUADS, 1),
        (SPOT_QUADS, 2),
        (HORSE_QUADS, 0),
        (HORSE_QUADS, 1),
        (HORSE_QUADS, 2),
    ],
    built_in: &[
        ("torus:32x32", 0),
        ("quad-sphere:4", 0),
        ("irregular-quad:300", 0),
        ("irregular-quad:300", 1),
        ("irregular-quad:300", 2),
        ("quad-sphere:7", 0),
    ],
};

/// Built-in meshes that are opened in place of the open models.
pub const OPENED: [&str; 4] = ["quad-sphere:4", "irregular-quad:1000", "irregular-tri:1000", "irregular-poly:1000"];

/// Built-in meshes in place of all closed models: of every method's table.
pub const ALL_METHODS: [&str; 9] = [
    "cube",
    "icosahedron",
    "prism:17",
    "torus:32x32",
    "quad-sphere:4",
    "icosphere:3",
    "irregular-quad:1000",
    "irregular-tri:1000",
    "irregular-poly:1000",
];
/// The same, of the claims.
pub const CLAIMS: [&str; 8] = [
    "torus:32x32",
    "quad-sphere:4",
    "icosphere:3",
    "irregular-quad:1000",
    "irregular-tri:1000",
    "irregular-poly:1000",
    "prism:17",
    "star:12",
];
/// The same, of Thall's iterations: those of the claims without the star.
pub const THALL: &[&str] = CLAIMS.split_at(7).0;
