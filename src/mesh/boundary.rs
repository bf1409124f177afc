//! Treatment of the boundary of an open mesh: refused, sharp, or as interior.

use std::fmt;
use std::str::FromStr;

use crate::{Error, Result, names};

/// What to make of boundary edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Boundary {
    /// An open mesh is invalid.
    #[default]
    Refuse,
    /// Boundary edges are sharp, and so are boundary vertices with one face: OpenSubdiv's and USD's edge-and-corner.
    EdgeAndCorner,
    /// Boundary edges are sharp, and boundary vertices with one face lie on the curve: edge-only.
    EdgeOnly,
    /// Boundary vertices get the masks of interior ones with as many edges, as in the paper that has the Boy
    /// model. Only schemes whose masks need edges alone (Loop, √3) can do this.
    AsInterior,
}

impl Boundary {
    const ALL: [Boundary; 4] = [Boundary::EdgeAndCorner, Boundary::EdgeOnly, Boundary::AsInterior, Boundary::Refuse];

    /// As `parse` reads it.
    pub fn name(self) -> &'static str {
        match self {
            Boundary::EdgeAndCorner => "edge-and-corner",
            Boundary::EdgeOnly => "edge-only",
            Boundary::AsInterior => "as-interior",
            Boundary::Refuse => "refuse",
        }
    }

    /// The least valence that a vertex may have on an open mesh.
    pub(super) fn least_valence(self) -> usize {
        match self {
            Boundary::EdgeAndCorner | Boundary::EdgeOnly => 2,
            Boundary::AsInterior | Boundary::Refuse => 3,
        }
    }
}

impl FromStr for Boundary {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let all = Boundary::ALL.map(|boundary| (boundary.name(), boundary));
        names::find("treatment of the boundary", text, &all, &[])
    }
}

impl fmt::Display for Boundary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
