//! Closed manifolds by their definition: a second opinion on the validator, which shares no code with it.

use std::collections::{HashMap, HashSet};

use limitlab::mesh::Mesh;

/// What a mesh is, apart from its positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Every vertex has one closed umbrella of three faces or more; with the Euler characteristic V − E + F.
    Closed { euler: i64 },
    /// As many sides from v to w as from w to v for all v and w, but two or more for some: vertices that are joined by
    /// several edges. Which sides meet, a list of faces cannot say; what is summed over faces does not depend on it.
    Doubled,
    /// Anything else.
    Defective,
}

impl Surface {
    pub fn of(mesh: &Mesh) -> Surface {
        let n = mesh.len();
        // How many sides lead from v to w, and the corner (v, before) → after of an umbrella's walk.
        let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
        let mut around: HashMap<(u32, u32), u32> = HashMap::new();
        let mut valence = vec![0; n];
        for face in mesh.faces.iter() {
            let different: HashSet<u32> = face.iter().copied().collect();
            if face.len() < 3 || different.len() < face.len() || face.iter().any(|&v| v as usize >= n) {
                return Surface::Defective;
            }
            for (k, &v) in face.iter().enumerate() {
                let before = face[(k + face.len() - 1) % face.len()];
                let after = face[(k + 1) % face.len()];
                *sides.entry((v, after)).or_default() += 1;
                around.insert((v, before), after);
                valence[v as usize] += 1;
            }
        }
        let balanced = sides.iter().all(|(&(v, w), count)| sides.get(&(w, v)) == Some(count));
        if n == 0 || !balanced || valence.iter().any(|&faces| faces < 3) {
            return Surface::Defective;
        }
        if sides.values().any(|&count| count > 1) {
            return Surface::Doubled;
        }
        // One umbrella: from any neighbour on, the walk comes by all faces before it returns.
        let one_umbrella = |(&(v, start), _): (&(u32, u32), &u32)| {
            let walk = std::iter::successors(Some(start), |&at| around.get(&(v, at)).copied());
            walk.skip(1).position(|at| at == start) == Some(valence[v as usize] - 1)
        };
        if !around.iter().all(one_umbrella) {
            return Surface::Defective;
        }
        Surface::Closed { euler: n as i64 - (sides.len() / 2) as i64 + mesh.faces.len() as i64 }
    }

    pub fn is_closed(self) -> bool {
        matches!(self, Surface::Closed { .. })
    }
}
