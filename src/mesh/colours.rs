//! Multicolour numbering of the vertices, for sweeps that relax all of a colour at once.

use super::breadth_first::breadth_first;
use super::numbering::Numbering;
use super::order::colouring;
use super::{Faces, Incidence};

/// The colours of [`Order::Multicolour`](super::order::Order::Multicolour), one after the other, each [breadth
/// first](breadth_first): sweeps by colours give the same iterates as in that order, and neighbours lie together in
/// memory whatever the file's order is. O(C log C) for C corners.
///
/// ```
/// use limitlab::mesh::{Incidence, builtin, colours::in_colours};
///
/// // Opposite corners of an octahedron share a colour.
/// let mesh = builtin::octahedron();
/// let incidence = Incidence::new(&mesh.faces, mesh.len());
/// let numbering = in_colours(&mesh.faces, &incidence);
/// for pair in numbering.order().chunks(2) {
///     let [a, b] = [0, 1].map(|k| mesh.positions[pair[k] as usize]);
///     assert_eq!(a, -b);
/// }
/// ```
pub fn in_colours(faces: &Faces, incidence: &Incidence) -> Numbering {
    let colour = colouring(faces, incidence);
    let mut colours: Vec<Vec<u32>> = Vec::new();
    for v in breadth_first(faces, incidence) {
        let k = colour[v as usize] as usize;
        if k >= colours.len() {
            colours.resize_with(k + 1, Vec::new);
        }
        colours[k].push(v);
    }
    Numbering::new(colours.concat())
}
