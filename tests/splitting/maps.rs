//! Characteristic maps, and maps built to fail.

use glam::DVec2;
use limitlab::analysis::splitting::{Blended, LocalScheme, Net, SplittingMatrix, characteristic_map};

use super::{EIGEN, SCHEMES};

const VALENCES: [usize; 8] = [3, 4, 5, 6, 7, 8, 12, 50];
const BLENDS: [LocalScheme; 6] = [
    LocalScheme::Sqrt3 { alpha: 0.5 },
    LocalScheme::Sqrt3 { alpha: 1.0 },
    LocalScheme::LabsikGreiner,
    LocalScheme::Blend { of: Blended::CatmullClark, alpha: 1.0 },
    LocalScheme::Blend { of: Blended::Loop, alpha: 1.0 },
    LocalScheme::Kobbelt,
];

fn map(scheme: LocalScheme, n: usize) -> Net {
    characteristic_map(scheme, n, scheme.map_rings()).unwrap()
}

#[test]
fn refinement_scales_a_characteristic_net_by_its_eigenvalue() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in VALENCES {
            let net = map(scheme, n);
            let lambda = SplittingMatrix::new(scheme, n).unwrap().leading_pair().unwrap();
            let refined = net.refine(2).unwrap();
            assert!(refined.rings > net.rings, "{scheme} {n}");
            for (coarse, fine) in net.points.iter().zip(&refined.points) {
                assert!((lambda * lambda * coarse - fine).length() < EIGEN, "{scheme} {n}");
            }
        }
    }
}

#[test]
fn the_rings_that_a_net_determines() {
    let rings = |scheme, start, rounds| characteristic_map(scheme, 5, start).unwrap().refine(rounds).unwrap().rings;
    for scheme in [LocalScheme::CatmullClark, LocalScheme::Loop, LocalScheme::DooSabin] {
        assert_eq!([rings(scheme, 3, 1), rings(scheme, 3, 2), rings(scheme, 3, 3)], [5, 9, 17]);
    }
    let sqrt3 = LocalScheme::Sqrt3 { alpha: 0.0 };
    assert_eq!([rings(sqrt3, 3, 1), rings(sqrt3, 3, 2)], [6, 15]);
    let blend = LocalScheme::Sqrt3 { alpha: 1.0 };
    assert_eq!([rings(blend, 3, 1), rings(blend, 4, 1), rings(blend, 4, 2)], [3, 6, 12]);
}

#[test]
fn regular_valences_give_affine_maps() {
    let hexagon = |scheme| (map(scheme, 6), DVec2::from_angle(std::f64::consts::FRAC_PI_3));
    for (net, second) in [hexagon(LocalScheme::Loop), hexagon(BLENDS[1])] {
        for line in net.lines(1) {
            for point in line {
                // Lattice coordinates are whole numbers.
                let b = point.1 / second.y;
                let a = point.0 - b * second.x;
                assert!((a - a.round()).abs() < 1e-11 && (b - b.round()).abs() < 1e-11);
            }
        }
    }
    for point in map(LocalScheme::CatmullClark, 4).points {
        assert!((point - point.round()).length() < 1e-11);
    }
}

#[test]
fn the_maps_of_all_schemes_are_regular_and_injective() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in VALENCES {
            // On every level: a single level could hide a fold between its samples.
            for rounds in 0..=3 {
                let check = map(scheme, n).refine(rounds).unwrap().check();
                assert!(check.regular && check.injective, "{scheme} {n} {rounds} {check:?}");
                assert!((check.winding - 1.0).abs() < 1e-9);
            }
        }
    }
}

/// z² is regular away from the middle, but goes around twice.
#[test]
fn a_map_that_goes_around_twice_is_not_injective() {
    for scheme in SCHEMES {
        let mut net = map(scheme, 8).refine(2).unwrap();
        for z in &mut net.points {
            *z = DVec2::new(z.x * z.x - z.y * z.y, 2.0 * z.x * z.y);
        }
        let check = net.check();
        assert!((check.winding - 2.0).abs() < 1e-9, "{check:?}");
        assert!(check.star_shaped && !check.injective);
    }
}

#[test]
fn folded_and_mirrored_maps_are_not_regular() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        let net = map(scheme, 7).refine(2).unwrap();
        // One vertex pulled across its neighbours.
        let mut folded = net.clone();
        let last = folded.points.len() / 2;
        folded.points[last] *= -0.5;
        let check = folded.check();
        assert!(!check.regular && !check.injective && check.least_sine < 0.0, "{scheme}");
        assert!(check.folded_corners > 0 && check.folded_corners < 30);
        // All of it turned over.
        let mut mirrored = net.clone();
        mirrored.points.iter_mut().for_each(|z| z.y = -z.y);
        let check = mirrored.check();
        assert_eq!(check.folded_corners, check.samples);
        assert!((check.winding + 1.0).abs() < 1e-9 && !check.star_shaped);
        // All of it in one point.
        let mut point = net;
        point.points.fill(DVec2::ZERO);
        let check = point.check();
        assert!(!check.regular && !check.injective);
    }
}

/// A regular net whose boundary is not star-shaped is left undecided, on the safe side.
#[test]
fn a_spiral_is_not_taken_for_injective() {
    let mut net = map(LocalScheme::Loop, 6).inner(1);
    net.points[2] = DVec2::new(1.0, -0.2);
    assert!(!net.check().injective);
}

#[test]
fn out_of_range_is_an_error() {
    assert!(characteristic_map(LocalScheme::Loop, 2, 3).is_err());
    assert!(characteristic_map(BLENDS[0], 5, 2).is_err());
    assert!(LocalScheme::new("sqrt3", Some(2.5)).is_err());
    assert!(LocalScheme::new("sqrt3", Some(f64::NAN)).is_err());
    assert!(LocalScheme::new("loop", Some(1.0)).is_err());
    assert!(LocalScheme::new("butterfly", None).is_err());
}
