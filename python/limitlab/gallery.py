"""Limit matrices as a family of test problems for sparse solvers, with spectra that are known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ._arguments import Floats
from .meshes import mesh
from .solving import assemble

__all__ = ["Problem", "gallery"]


class Problem(NamedTuple):
    """A matrix with all of its eigenvalues."""

    A: csr_array
    """Symmetric: on these meshes H is a multiple of the identity."""
    eigenvalues: Floats
    """Ascending, by the formula."""


def _quads(scheme: str, s: Floats, t: Floats) -> Floats:
    """The symbol on a torus of quads, by angles s and t along its two directions: a circulant in both."""
    along: Floats = np.cos(s)
    across: Floats = np.cos(t)
    match scheme:
        case "catmull-clark":
            return (2 + along) * (2 + across) / 9
        case "nasri":
            return (3 + along) * (3 + across) / 16
        case "zheng-cai":
            return 0.5 + (1 + along) * (1 + across) / 8
        case "mid-edge":
            return 0.5 + (along + across) / 4
    raise ValueError(f'no symbol on quads of scheme "{scheme}": use catmull-clark, nasri, zheng-cai or mid-edge')


def _triangles(scheme: str, s: Floats, t: Floats) -> Floats:
    """The symbol on a torus of triangles, whose third direction is the sum of the others."""
    if scheme not in ("loop", "sqrt3"):
        raise ValueError(f'no symbol on triangles of scheme "{scheme}": use loop or sqrt3')
    values: Floats = 0.5 + (np.cos(s) + np.cos(t) + np.cos(s + t)) / 6
    return values


def gallery(name: str, n: int, m: int | None = None, scheme: str | None = None) -> Problem:
    """The limit matrix of a torus of n × m vertices, whose eigenvalues are the values of a symbol.

    Parameters
    ----------
    name
        `torus`, of quads, or `tri-torus`, of triangles with valence 6.
    n, m
        Vertices along both directions, 3 or more; m = n unless given. The matrix has n·m rows.
    scheme
        `catmull-clark` (unless told), `nasri`, `zheng-cai` or `mid-edge` on quads; `loop` (unless told) or `sqrt3` on
        triangles.
        λ_max = 1 under all, λ_min for even n and m 1/9, 1/4, 1/2 and 0 on quads; on triangles about 1/4.

    Returns
    -------
    Problem
        `A`, a symmetric `csr_array` whose rows sum to 1, and all eigenvalues, ascending.

    Examples
    --------
    >>> import limitlab, numpy as np
    >>> A, eigenvalues = limitlab.gallery("torus", 8)
    >>> bool(np.allclose(np.linalg.eigvalsh(A.toarray()), eigenvalues))
    True
    """
    m = n if m is None else m
    if name not in ("torus", "tri-torus"):
        raise ValueError(f'unknown family "{name}": use torus or tri-torus')
    angles = (2 * np.pi * np.arange(count) / count for count in (n, m))
    s, t = np.meshgrid(*angles, indexing="ij")
    if name == "torus":
        scheme = scheme or "catmull-clark"
        values = _quads(scheme, s, t)
    else:
        scheme = scheme or "loop"
        values = _triangles(scheme, s, t)
    V, F = mesh(f"{name}:{n}x{m}")
    return Problem(assemble(V, F, scheme).A, np.sort(values.ravel()))
