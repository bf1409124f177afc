//! Characteristic maps.

use limitlab::analysis::splitting::{LocalScheme, characteristic_map};

use crate::SCHEMES;

#[test]
fn probe() {
    for scheme in SCHEMES.into_iter().chain([
        LocalScheme::Sqrt3 { alpha: 0.5 },
        LocalScheme::Sqrt3 { alpha: 1.0 },
        LocalScheme::Sqrt3 { alpha: 2.0 },
    ]) {
        for n in [3, 4, 5, 6, 7, 8, 12, 20, 50] {
            match characteristic_map(scheme, n, scheme.map_rings()) {
                Ok(net) => {
                    for k in 0..=3 {
                        let net = net.refine(k).unwrap();
                        println!("{scheme} {n} {} {:?}", net.rings, net.check());
                    }
                }
                Err(e) => println!("{e}"),
            }
        }
    }
}
