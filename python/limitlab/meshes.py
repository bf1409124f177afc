"""Mesh files, built-in meshes, and the surfaces that control meshes have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arguments, _limitlab
from ._arguments import Faces, Floats, Tagged

__all__ = ["Mesh", "limit", "mesh", "normals", "read", "subdivide", "write"]


@dataclass(frozen=True, repr=False)
class Mesh:
    """A mesh as arrays. It unpacks as `V, F`, and its `tags` are keyword arguments of the functions here.

    >>> import limitlab
    >>> V, F = limitlab.mesh("cube")
    >>> V.shape, F.shape
    ((8, 3), (6, 4))
    """

    vertices: Floats
    """(n, 3)."""
    faces: Any
    """(m, k) where all faces have k corners, else a pair (corners, offsets) of which face f is
    `corners[offsets[f]:offsets[f + 1]]`. int32, numbered from 0."""
    creases: tuple[NDArray[np.int32], Floats] | None = None
    """Sharp edges as (k, 2) vertices, and their sharpness: from 10 on for ever, less is taken 1 at each level."""
    corners: tuple[NDArray[np.int32], Floats] | None = None
    """Sharp vertices and their sharpness."""
    boundary: str | None = None
    """The rule of boundary edges, where the file has one or the mesh a boundary."""
    normals: Floats | None = None
    """(n, 3), where there are some; zero where the surface has none."""
    remarks: list[str] = field(default_factory=list)
    """What the reader has to say of the file, a sentence each."""

    def __iter__(self) -> Iterator[Any]:
        return iter((self.vertices, self.faces))

    @property
    def tags(self) -> dict[str, Any]:
        """`creases`, `corners` and `boundary`, as far as there are some."""
        tags = {"creases": self.creases, "corners": self.corners, "boundary": self.boundary}
        return {name: value for name, value in tags.items() if value is not None}

    def __repr__(self) -> str:
        sizes = "mixed" if isinstance(self.faces, tuple) else self.faces.shape[1]
        count = len(self.faces[1]) - 1 if isinstance(self.faces, tuple) else len(self.faces)
        tags = "".join(f", {name}" for name in self.tags)
        return f"<Mesh: {len(self.vertices)} vertices, {count} faces of size {sizes}{tags}>"


def _mesh_of(found: dict[str, Any]) -> Mesh:
    def tagged(name: str, width: int) -> tuple[NDArray[np.int32], Floats] | None:
        vertices, sharpness = found[name]
        if not len(sharpness):
            return None
        return vertices.reshape(-1, 2) if width == 2 else vertices, np.asarray(sharpness, dtype=np.float64)

    return Mesh(
        found["vertices"],
        _arguments.of_parts(*found["faces"]),
        tagged("creases", 2),
        tagged("corners", 1),
        found["boundary"],
        found.get("normals"),
        found.get("remarks", []),
    )


def read(path: str | PathLike[str]) -> Mesh:
    """Read a mesh file: .obj, .off, .ply, .usda, .stl, .glb or .gltf.

    Positions are those of the file bit for bit; creases, corners and the rule of the boundary come from .usda and .obj.
    Vertices of .stl, .glb and .gltf at one position are one.

    Raises
    ------
    FileNotFoundError, OSError
        The file cannot be read.
    FormatError
        It is not what its format says; with the line.
    """
    return _mesh_of(_limitlab.read(path))


def mesh(name: str, noise: float = 0.0, seed: int = 1) -> Mesh:
    """Make a built-in mesh: `cube`, `torus:32x32`, `icosphere:4`, `quad-sphere:5`, `irregular-quad:1000`, …

    An unknown name lists all.

    Parameters
    ----------
    noise
        The standard deviation of a Gaussian that moves every coordinate, in mean edge lengths. Smooth symmetric meshes excite
        few eigenvectors: with noise 0.1 methods converge as on real ones.
    seed
        Of the noise; one seed, one noise, on every platform.

    Examples
    --------
    >>> import limitlab
    >>> limitlab.mesh("torus:8x6", noise=0.1)
    <Mesh: 48 vertices, 48 faces of size 4>
    """
    return _mesh_of(_limitlab.mesh(name, float(noise), int(seed)))


def write(
    path: str | PathLike[str],
    V: ArrayLike,
    F: Faces,
    *,
    normals: ArrayLike | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
    boundary: str | None = None,
    scheme: str | None = None,
    ascii: bool = False,
    comments: Iterable[str] = (),
) -> None:
    """Write a mesh file, whose ending names its format: .obj, .off, .ply or .usda.

    Doubles read back equal, but from .usda, which holds nine digits. The file appears as a whole or not at all.

    Parameters
    ----------
    normals
        (n, 3).
    creases, corners, boundary
        What is sharp, as in `interpolate`; .obj and .usda have a place for it.
    scheme
        What refines the mesh, for .usda.
    ascii
        .ply as text; the other formats always are.
    comments
        Lines near the top of the file.
    """
    lines = list(comments)
    if any("\n" in line or "\r" in line for line in lines):
        raise ValueError("comments are single lines")
    _limitlab.write(
        path,
        _arguments.points(V),
        _arguments.faces(F),
        None if normals is None else _arguments.points(normals, "normals"),
        boundary,
        _arguments.creases(creases),
        _arguments.corners(corners),
        scheme,
        ascii,
        lines,
    )


def subdivide(
    V: ArrayLike,
    F: Faces,
    scheme: str | None = None,
    levels: int = 1,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
) -> Mesh:
    """Refine a control mesh `levels` times.

    `scheme` is one of the six, or `doo-sabin`, `butterfly` or `labsik-greiner`; `loop` on triangles, else `catmull-clark`,
    unless told. Under all but Doo-Sabin and mid-edge the first vertices are those of V.

    Examples
    --------
    >>> import limitlab
    >>> limitlab.subdivide(*limitlab.mesh("cube"), levels=2)
    <Mesh: 98 vertices, 96 faces of size 4>
    """
    surface = _arguments.surface(V, F, boundary, creases, corners)
    if levels < 0:
        raise ValueError(f"levels={levels}: a number from 0 on is needed")
    return _mesh_of(surface.refined(scheme or surface.scheme(None), levels))


def limit(
    V: ArrayLike,
    F: Faces,
    scheme: str | None = None,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
) -> Floats:
    """The limit points A V of control points V, (n, 3): what `interpolate` inverts. O(corners), without a stored matrix.

    Examples
    --------
    >>> import limitlab, numpy as np
    >>> V, F = limitlab.mesh("tetrahedron")
    >>> np.allclose(limitlab.limit(V, F, "loop"), V / 5)
    True
    """
    return _arguments.surface(V, F, boundary, creases, corners).limit_points(scheme)


def normals(
    V: ArrayLike,
    F: Faces,
    scheme: str | None = None,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
) -> Floats:
    """Unit normals of the limit surface at the limit points of control points V, (n, 3); zero where it has none."""
    surface = _arguments.surface(V, F, boundary, creases, corners)
    return surface.limit_normals(scheme or surface.scheme(None))
