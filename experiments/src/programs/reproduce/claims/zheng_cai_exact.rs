//! What Zheng and Cai say of normals and handles in their figures, and of exact evaluation (Z27–Z30).

use glam::DVec3;

use limitlab::Result;
use limitlab::analysis::splitting::evaluation::RINGS;
use limitlab::analysis::splitting::{ExactSurface, LocalScheme, SplittingMatrix};
use limitlab::interpolate::lin_luo::surface::volume;
use limitlab::interpolate::zheng_cai::{Constraints, PhaseOne, interpolate};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::{Refinement, catmull_clark, doo_sabin, loop_scheme};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, distance, exact, largest, random_points};

const ROUNDING: f64 = 1e-12;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "Z27",
        title: "With and without normals the auxiliary mesh is the same",
        place: "§4.1, Fig. 6",
        printed: "Both input meshes give an exactly identical auxiliary mesh; the perturbed refinements differ.",
        slow: false,
        check: same_auxiliary,
    },
    Claim {
        id: "Z28",
        title: "S = 0.4 is slim, S = 2.5 round or fat, with a flat spot",
        place: "§4.2, Fig. 8",
        printed: "Handles of 0.4 make the shape slim, of 2.5 round or fat; large values give a flat spot near D.",
        slow: false,
        check: slim_and_fat,
    },
    Claim {
        id: "Z29",
        title: "A biquadratic B-spline away from other faces and valences",
        place: "§2",
        printed: "Beyond the faces that are no quads the mesh is rectangular and converges to a biquadratic B-spline.",
        slow: false,
        check: biquadratic,
    },
    Claim {
        id: "Z30",
        title: "Exact evaluation in Stam's way",
        place: "§3.5, Remark 2",
        printed: "A direct and exact evaluation of Doo-Sabin surfaces as Stam's of Catmull-Clark gives any point exactly.",
        slow: false,
        check: exact_evaluation,
    },
];

fn same_auxiliary(_: &Lab) -> Result<Finding> {
    let subject = exact("irregular-poly:60")?;
    let surface = &subject.surface;
    // As in the figure: the outermost on either side.
    let along = |v: &usize| surface.positions()[*v].x;
    let ends = [
        (0..surface.len()).min_by(|a, b| along(a).total_cmp(&along(b))),
        (0..surface.len()).max_by(|a, b| along(a).total_cmp(&along(b))),
    ];
    let mut marks = vec![false; surface.len()];
    let mut normals = vec![None; surface.len()];
    for v in ends.into_iter().flatten() {
        marks[v] = true;
        normals[v] = Some(DVec3::new(0.8, 0.6, 0.1));
    }
    let plain = Constraints { interpolated: Some(&marks), ..Constraints::default() };
    let given = Constraints { normals: Some(&normals), ..plain };
    let [plain, given] = [plain, given].map(|wishes| interpolate(surface, &wishes, &PhaseOne::default()));
    let (plain, given) = (plain?, given?);
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "largest distance of the auxiliary meshes, two vertices of irregular-poly:60 interpolated",
            distance(plain.auxiliary.surface.positions(), given.auxiliary.surface.positions()),
            0.0,
        ),
        Evidence::above(
            "largest distance over L of the perturbed first refinements",
            distance(plain.first.surface.positions(), given.first.surface.positions()) / surface.diagonal(),
            1e-3,
        ),
    ]))
}

fn slim_and_fat(_: &Lab) -> Result<Finding> {
    const LEVEL: usize = 5;
    let subject = exact("irregular-poly:60")?;
    let surface = &subject.surface;
    // The volume, and the mean height over its tangent plane of the surface within a tenth of the radius about a point.
    let measured = |s: f64| -> Result<(f64, f64)> {
        let handles = vec![s; surface.len()];
        let wishes = Constraints { handles: Some(&handles), ..Constraints::default() };
        let made = interpolate(surface, &wishes, &PhaseOne::default())?;
        let fine = made.first.at_level(LEVEL)?;
        let normals = doo_sabin::face_normals(&fine);
        let near = 0.05 * surface.diagonal();
        let heights = surface.positions().iter().enumerate().map(|(v, point)| {
            let n = normals[made.first.first_vertex_face + v];
            let offsets = fine.positions.iter().map(|p| *p - *point).filter(|d| d.length() < near);
            largest(offsets.map(|d| d.dot(n).abs()))
        });
        let heights: Vec<f64> = heights.collect();
        Ok((volume(&fine), heights.iter().sum::<f64>() / heights.len() as f64 / near))
    };
    let [slim, plain, fat] = [0.4, 1.0, 2.5].map(measured);
    let (slim, plain, fat) = (slim?, plain?, fat?);
    Ok(Finding::reproduced(vec![
        Evidence::below(
            "volume with S = 0.4 over that with 1, irregular-poly:60, all vertices interpolated",
            slim.0 / plain.0,
            1.0,
        ),
        Evidence::above("the same with S = 2.5", fat.0 / plain.0, 1.0),
        Evidence::below(
            "mean of the largest height over the tangent plane within 5 % of L, S = 2.5 over 1",
            fat.1 / plain.1,
            1.0,
        ),
        Evidence::above("the same, S = 0.4 over 1", slim.1 / plain.1, 1.0),
    ]))
}

/// The surface about a random star of valence n by refinement: its distance from the exact one over all parameters that are
/// multiples of 2^-4 in a sector.
fn off_refinement(scheme: LocalScheme, n: usize) -> Result<f64> {
    const ROUNDS: usize = 4;
    const STEPS: i64 = 1 << ROUNDS;
    // Rings that the walk crosses, and one around them.
    const AROUND: usize = 4;
    let layout = scheme.layout();
    let points = random_points(layout.len(n, AROUND) + 1, n as u64);
    let mut surface = Surface::new(Mesh::new(points, layout.closed(n, AROUND)))?;
    let control = layout.walk(&surface, 0, n, RINGS)?;
    let control: Vec<DVec3> = control.iter().map(|&v| surface.positions()[v as usize]).collect();
    let exact = ExactSurface::new(scheme, n)?;
    let refinement = match scheme {
        LocalScheme::CatmullClark => Refinement::CatmullClark,
        LocalScheme::Loop => Refinement::Loop,
        _ => Refinement::DooSabin,
    };
    let mut root = 0;
    for _ in 0..ROUNDS {
        surface = refinement.refined(&surface)?;
        root = scheme.root_after_step(root);
    }
    let found = layout.walk(&surface, root, n, STEPS as usize + 1)?;
    let limits = match scheme {
        LocalScheme::CatmullClark => catmull_clark::limit_positions(&surface)?,
        LocalScheme::Loop => loop_scheme::limit_positions(&surface)?,
        _ => surface.positions().to_vec(),
    };
    let at = |i: i64, j: i64| limits[found[layout.position(n, 0, i, j) as usize] as usize];
    let mut worst = 0.0f64;
    for i in 0..=STEPS {
        for j in 0..=STEPS {
            let beyond = scheme == LocalScheme::Loop && i + j > STEPS;
            let expected = match refinement {
                // Doo-Sabin keeps the centroids of faces, here of those between its points.
                Refinement::DooSabin if (i, j) != (0, 0) => {
                    0.25 * (at(i - 1, j - 1) + at(i - 1, j) + at(i, j - 1) + at(i, j))
                }
                Refinement::DooSabin => continue,
                _ if beyond => continue,
                _ => at(i, j),
            };
            let parameters = [i, j].map(|x| x as f64 / STEPS as f64);
            worst = largest([worst, exact.point(&control, 0, parameters).distance(expected)]);
        }
    }
    Ok(worst)
}

fn biquadratic(_: &Lab) -> Result<Finding> {
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest distance of the refined mesh's centroids from the biquadratic B-spline of nine points about each, random points",
        off_refinement(LocalScheme::DooSabin, 4)?,
        ROUNDING,
    )]))
}

fn exact_evaluation(_: &Lab) -> Result<Finding> {
    const VALENCES: std::ops::RangeInclusive<usize> = 3..=12;
    let mut evidence = Vec::new();
    for (scheme, name) in [
        (LocalScheme::DooSabin, "Doo-Sabin, about faces of"),
        (LocalScheme::CatmullClark, "Catmull-Clark, about valences"),
        (LocalScheme::Loop, "Loop, about valences"),
    ] {
        let off = VALENCES.map(|n| off_refinement(scheme, n)).collect::<Result<Vec<f64>>>()?;
        evidence.push(Evidence::at_most(
            format!("largest distance from the refined surface, {name} 3…12, random points of size 1"),
            largest(off),
            ROUNDING,
        ));
    }
    // Nearer to the middle than refinement gets easily: points of the characteristic map shrink by λ_1 at every halving.
    let mut rate = 0.0f64;
    for scheme in [LocalScheme::DooSabin, LocalScheme::CatmullClark, LocalScheme::Loop] {
        for n in VALENCES {
            let exact = ExactSurface::new(scheme, n)?;
            let net = SplittingMatrix::on_rings(scheme, n, RINGS)?.characteristic_net()?;
            let control: Vec<DVec3> = net.iter().map(|p| p.extend(0.0)).collect();
            let at = |k: i32| exact.point(&control, 0, [0.4, 0.3].map(|x| x * 0.5f64.powi(k)));
            let lambda = scheme.subdominant_formula(n).unwrap_or(f64::NAN);
            rate = largest([rate, at(12).distance(lambda.powi(7) * at(5)) / at(12).length()]);
        }
    }
    Ok(Finding::reproduced(evidence)
        .also([Evidence::at_most("largest relative deviation from λ_1⁷, on the characteristic maps, of a point 2⁻¹² near the middle from one 2⁻⁵ near", rate, 1e-6)])
        .remark(
            "S on two rings is decomposed into its invariant subspaces, so that S^k costs the same for every k; the patches are \
             biquadratic, bicubic and quartic. Parameters are multiples of 1/16 in a sector. A mesh of Zheng and Cai's after its first \
             refinement has valence 4 everywhere, and is evaluated about each of its faces.",
        ))
}
