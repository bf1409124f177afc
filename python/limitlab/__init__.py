"""Limit systems of interpolating subdivision surfaces, for NumPy and SciPy.

A subdivision scheme takes control points V, (n, 3), to limit points A V. Here are the control points whose limit points are
given ones (`interpolate`), the matrix A = diag(h) M in the forms of SciPy (`assemble`), all methods of the literature on it,
those of your own beside them (`compare`), and what spectra say of them before (`spectrum`, `sweep_omega`, `splitting`).

Meshes are arrays: `V, F = limitlab.read("spot.obj")`.

>>> import limitlab
>>> V, F = limitlab.mesh("torus:32x32", noise=0.1)
>>> limitlab.interpolate(V, F, "catmull-clark").converged
True
"""

from . import _limitlab
from .analysis import (
    Comparison,
    OmegaSweep,
    Row,
    Spectrum,
    Splitting,
    SweepRow,
    compare,
    spectrum,
    splitting,
    sweep_omega,
)
from .errors import ComputationError, ConvergenceError, FormatError, MeshError
from .gallery import Problem, gallery
from .meshes import Mesh, limit, mesh, normals, read, subdivide, write
from .solving import Block, Blocks, Bounds, Interpolator, Solution, Step, System, assemble, interpolate

__version__ = _limitlab.VERSION

__all__ = [
    "Block",
    "Blocks",
    "Bounds",
    "Comparison",
    "ComputationError",
    "ConvergenceError",
    "FormatError",
    "Interpolator",
    "Mesh",
    "MeshError",
    "OmegaSweep",
    "Problem",
    "Row",
    "Solution",
    "Spectrum",
    "Splitting",
    "Step",
    "SweepRow",
    "System",
    "__version__",
    "assemble",
    "compare",
    "gallery",
    "interpolate",
    "limit",
    "mesh",
    "normals",
    "read",
    "spectrum",
    "splitting",
    "subdivide",
    "sweep_omega",
    "write",
]
