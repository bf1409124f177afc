//! Closed manifolds by their definition: a second opinion on the validator, which shares no code with it.

use std::collections::{HashMap, HashSet};

use limitlab::mesh::Mesh;

/// The Euler characteristic V − E + F of a mesh where every side of a face has one opposite and every vertex one closed
/// umbrella of three faces or more; `None` for any other mesh. Positions do not matter.
pub fn euler_if_closed(mesh: &Mesh) -> Option<i64> {
    let n = mesh.len();
    // How many sides lead from v to w, and the corner (v, before) → after of an umbrella's walk.
    let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
    let mut around: HashMap<(u32, u32), u32> = HashMap::new();
    let mut valence = vec![0; n];
    for face in mesh.faces.iter() {
        let different: HashSet<u32> = face.iter().copied().collect();
        if face.len() < 3 || different.len() < face.len() || face.iter().any(|&v| v as usize >= n) {
            return None;
        }
        for (k, &v) in face.iter().enumerate() {
            let before = face[(k + face.len() - 1) % face.len()];
            let after = face[(k + 1) % face.len()];
            *sides.entry((v, after)).or_default() += 1;
            around.insert((v, before), after);
            valence[v as usize] += 1;
        }
    }
    let paired = sides.iter().all(|(&(v, w), &count)| count == 1 && sides.get(&(w, v)) == Some(&1));
    if n == 0 || !paired || valence.iter().any(|&faces| faces < 3) {
        return None;
    }
    // One umbrella: from any neighbour on, the walk comes by all faces before it returns.
    let one_umbrella = |(&(v, start), _): (&(u32, u32), &u32)| {
        let walk = std::iter::successors(Some(start), |&at| around.get(&(v, at)).copied());
        walk.skip(1).position(|at| at == start) == Some(valence[v as usize] - 1)
    };
    let euler = n as i64 - (sides.len() / 2) as i64 + mesh.faces.len() as i64;
    around.iter().all(one_umbrella).then_some(euler)
}
