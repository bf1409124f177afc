//! The inputs that the fuzzer kept, and mutants of them.

use std::fs;

use chacha20::ChaCha8Rng;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};

/// Checks the committed inputs of a target and then `mutants` of them. The last line printed names what failed.
pub fn replay(target: &str, mutants: u64, check: impl Fn(&[u8])) {
    let folder = super::root().join("fuzz/corpus").join(target);
    let mut paths: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let seeds: Vec<Vec<u8>> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
    for (path, seed) in paths.iter().zip(&seeds) {
        println!("{}", path.display());
        check(seed);
    }
    for number in 0..mutants {
        let data = mutant(&seeds, number);
        println!("mutant {number}: {}", data.escape_ascii());
        check(&data);
    }
}

/// A seed after a few changes: bytes set, removed and added, parts of other seeds put in.
fn mutant(seeds: &[Vec<u8>], number: u64) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let mut data = seeds.choose(&mut rng).expect("a corpus").clone();
    for _ in 0..rng.random_range(1..=6) {
        let start = rng.random_range(0..=data.len());
        let end = data.len().min(start + rng.random_range(0..8));
        match rng.random_range(0..4) {
            0 => data[start..end].iter_mut().for_each(|byte| *byte = rng.random()),
            1 => drop(data.drain(start..end)),
            2 => drop(data.splice(start..start, (0..rng.random_range(1..8)).map(|_| rng.random()))),
            _ => {
                let other = seeds.choose(&mut rng).expect("a corpus");
                let from = rng.random_range(0..=other.len());
                let to = other.len().min(from + rng.random_range(0..32));
                data.splice(start..end, other[from..to].iter().copied());
            }
        }
    }
    data
}
