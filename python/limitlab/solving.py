"""Control meshes of given points, and the linear systems that they solve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator

from . import _arguments, _limitlab
from ._arguments import Faces, Floats, Tagged
from .errors import ConvergenceError
from .meshes import Mesh, _mesh_of

__all__ = ["Block", "Blocks", "Bounds", "Interpolator", "Solution", "Step", "System", "assemble", "interpolate"]


class Step(NamedTuple):
    """What a callback is told of an iterate, first of the start. Errors are lengths in the units of the points."""

    iteration: int
    """Updates of all vertices made before."""
    max_error: float
    """max_i ‖p_i − (A v)_i‖₂."""
    mean_error: float
    """The mean of the same."""
    method: str
    """The method at work."""


def _told(callback: Callable[[Step], Any] | None) -> Callable[..., Any] | None:
    return None if callback is None else lambda *step: callback(Step(*step))


@dataclass(frozen=True, repr=False, kw_only=True)
class Solution:
    """A control mesh and how it came about."""

    vertices: Floats
    """V, (n, 3): the limit points of this control mesh are the points asked for. By `halstead`, of a mesh two refinements
    finer."""
    faces: Any
    """The faces of the control mesh: those that were given, but by `halstead`. `None` of a system's solution."""
    method: str
    """What found it: of `auto`, the method that came to the end."""
    scheme: str
    """The scheme whose surface passes through the points."""
    status: str
    """`converged`, `rounding` (the tolerance lies below the last digits of the data), `diverged`, `max-iterations`,
    `stagnated`, `singular`, `breakdown`, or `stopped` by a callback."""
    iterations: int
    """Updates of all vertices made."""
    history: Floats
    """(k, 3): iteration, maximum and mean error of the limit points in the units of the points, first those of the start.
    By `halstead`, which meets the points all the way, the steps that would take the energy to its least value along one
    control point at a time."""
    tolerance: float
    """The maximum error that was allowed, in the same units."""
    setup_seconds: float = 0.0
    """Assembly, spectra, factorization."""
    solve_seconds: float = 0.0
    """Iterations."""
    fill: int | None = None
    """Stored entries of the factors of a direct method, where they are known."""
    detail: str | None = None
    """The reason of a status, where there is one."""
    advice: str | None = None
    """What to do where there is no solution."""
    surface: Mesh | None = None
    """The surface, if it was asked for."""
    energies: tuple[float, float] | None = None
    """Thin-plate and membrane energy of the fairest surface."""
    errors: tuple[float, float] | None = None
    """Maximum and mean error of the limit points, where the history holds steps."""
    normals_set: int | None = None
    """Given normals that had to be set: rings turned, faces tilted."""
    not_flattened: list[int] = field(default_factory=list)
    """Vertices whose Doo-Sabin face has no average normal, and was not made planar."""

    @property
    def converged(self) -> bool:
        """Whether the tolerance is met by the true residual."""
        return self.status == "converged"

    @property
    def seconds(self) -> float:
        """All of the time, but for the validation of the mesh."""
        return self.setup_seconds + self.solve_seconds

    @property
    def max_error(self) -> float:
        """max_i ‖p_i − (A v)_i‖₂ at the end; 0 where nothing is solved."""
        return self._last(1)

    @property
    def mean_error(self) -> float:
        """The mean of the same."""
        return self._last(2)

    def _last(self, column: int) -> float:
        if self.errors is not None:
            return self.errors[column - 1]
        return float(self.history[-1, column]) if len(self.history) else 0.0

    def raise_for_status(self) -> None:
        """Raise `ConvergenceError` where there is no solution, and no callback stopped it."""
        if self.advice is not None:
            detail = f" [{self.detail}]" if self.detail else ""
            raise ConvergenceError(
                f"{self.method} under {self.scheme} ended as {self.status} after {self.iterations} iterations with max error "
                f"{self.max_error:.3e} against {self.tolerance:.3e}{detail}; {self.advice}",
                self,
            )

    def to_pandas(self) -> Any:
        """The history as a `pandas.DataFrame`, by iteration."""
        import pandas

        frame = pandas.DataFrame(self.history, columns=["iteration", "max_error", "mean_error"])
        return frame.astype({"iteration": int}).set_index("iteration")

    def plot(self, ax: Any = None) -> Any:
        """Draw the errors over the iterations with matplotlib; gives the axes."""
        from .plots import histories

        return histories([(self.method, self.history, self.status)], ax)

    def __repr__(self) -> str:
        return (
            f"<Solution: {self.scheme} by {self.method}, {self.status} after {self.iterations} iterations, "
            f"max error {self.max_error:.2e}, {len(self.vertices)} vertices, {self.seconds:.3g} s>"
        )


def _solution(found: dict[str, Any], faces: Any, check: bool) -> Solution:
    failed = found.pop("failed")
    control, surface = found.pop("control", None), found.pop("surface", None)
    if control is not None:
        faces = _mesh_of(control).faces
    solution = Solution(faces=faces, advice=failed, surface=None if surface is None else _mesh_of(surface), **found)
    if check:
        solution.raise_for_status()
    return solution


def interpolate(
    V: ArrayLike,
    F: Faces,
    scheme: str | None = None,
    *,
    method: str = "auto",
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
    crease_angle: float | None = None,
    vertices: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    handles: ArrayLike | None = None,
    alpha: ArrayLike | None = None,
    subdivide: int = 0,
    limit: bool = False,
    surface_normals: bool = False,
    tol: float = 1e-10,
    atol: float | None = None,
    max_iter: int = 10_000,
    omega: float | None = None,
    order: str = "file",
    callback: Callable[[Step], Any] | None = None,
    check: bool = True,
    normal_threshold: float = 0.0,
    normal_tolerance: float = 0.0,
    normal_levels: int = 1,
    ite_max: int = 5,
    eps: float = 0.003,
    thin_plate: float = 1.0,
    membrane: float = 1.0,
) -> Solution:
    """The control mesh whose limit surface passes through points: the V' with A V' = V.

    Parameters
    ----------
    V
        (n, 3) points. Contiguous doubles are copied once, into the library; other arrays are converted before.
    F
        Faces: an (m, k) array of integers of any kind, a pair (corners, offsets), or a list of lists. Vertices are numbered
        from 0, counter-clockwise seen from outside.
    scheme
        `catmull-clark`, `loop`, `sqrt3`, `nasri`, `zheng-cai` or `mid-edge`; `loop` on triangles, else `catmull-clark`, unless
        told. Blender, Maya and Rhino subdivide by Catmull-Clark.
    method
        `auto` (Chebyshev in mixed precision without a stored matrix, conjugate gradients where that makes no progress, LDLᵀ
        where these do not), `lu`, `cholesky`, `ldlt`, `jacobi`, `thall`, `gauss-seidel`, `sor`, `ssor`, `pia`, `w-pia`,
        `chebyshev`, `cg`, `pcg-jacobi`, `pcg-ssor`, `pcg-ic0`, `anderson`, `heavy-ball`; `two-phase` (Zheng and Cai's own
        sweeps), `halstead` (the fairest surface, a control mesh two refinements down), `butterfly` and `labsik-greiner` (with
        `subdivide`: schemes that pass through the vertices of triangles with no system).
    boundary
        `edge-and-corner` (unless told), `edge-only`, `as-interior` (`loop`, `sqrt3` and `mid-edge` only) or `refuse`.
    creases
        Sharp edges: (k, 2) vertices, which are sharp for ever; a pair ((k, 2), sharpness); or (k, 3) rows `a, b, sharpness`.
        From 10 on an edge is sharp for ever, less is taken 1 at each level (Catmull-Clark and Loop).
    corners
        Sharp vertices: numbers; a pair (numbers, sharpness); or (k, 2) rows.
    crease_angle
        Degrees between the normals of two faces beyond which their edge is sharp.
    vertices
        Which vertices are interpolated: n marks, or numbers. The others stay, or go by `halstead` where the surface is fairest.
    normals
        (n, 3) normals of the surface at the points, zero or nan where none is wanted. Met on the surface: with `subdivide`.
    handles
        Shape handles, n numbers or one: faces of `nasri` and `zheng-cai` are scaled by them about their points.
    alpha
        Lin and Luo's unified √3 scheme, n numbers or one: 0 approximates, 1 interpolates; no system is solved.
    subdivide, limit, surface_normals
        Make the surface too: refine the control mesh so many times, push its vertices to their limit points, compute its
        normals. It is `Solution.surface`.
    tol, atol
        The maximum distance of limit points from theirs, in parts of the diagonal of the bounding box, or in its units.
    max_iter
        The most iterations of each method tried.
    omega
        The factor of `jacobi`, `pia` and `sor`; the best one known unless told.
    order
        Of sweeps in place: `file`, `reverse`, `bfs`, `rcm`, `morton`, `valence`, `multicolour` or `random:SEED`.
    callback
        Called with a `Step` for every iterate whose errors are known, the start first. A true result stops the run; an
        exception comes through.
    check
        Raise `ConvergenceError` where there is no solution; otherwise `Solution.status` says it.
    normal_threshold, normal_tolerance, normal_levels
        Turn rings where a normal is off by more than the first, leave the second (degrees), and spread it over so many levels.
    ite_max, eps
        `two-phase`: the most sweeps, and the largest update at the end in parts of the diagonal.
    thin_plate, membrane
        `halstead`: weights of the energies, the first 0 or more, the second positive.

    Raises
    ------
    MeshError
        Defects of the mesh, as data; faces, boundaries or creases that the scheme is not defined on.
    ConvergenceError
        No solution: with `solution`, and what to do in its message.
    ValueError
        Unknown names, shapes that do not fit, wishes that contradict each other.

    Notes
    -----
    Linear in the vertices but for direct methods: a million vertices take some tenths of a second by `auto`. Other threads run
    meanwhile, and Ctrl-C ends an iteration. After Thall (2003), Zheng and Cai (2005), PIA, Lin and Luo (2007), Halstead, Kass
    and DeRose (1993).

    Examples
    --------
    >>> import limitlab, numpy as np
    >>> V, F = limitlab.mesh("quad-sphere:3", noise=0.1)
    >>> found = limitlab.interpolate(V, F, "catmull-clark")
    >>> found.converged, found.vertices.shape
    (True, (386, 3))
    >>> bool(abs(limitlab.limit(found.vertices, F) - V).max() < 1e-9)
    True
    """
    surface = _arguments.surface(V, F, boundary, creases, corners, crease_angle)
    if subdivide < 0 or ite_max < 0:
        raise ValueError("subdivide and ite_max are numbers from 0 on")
    given = None if normals is None else _arguments.points(normals, "normals")
    wishes = {
        "vertices": _arguments.marks(vertices, len(surface)),
        "normals": given,
        "handles": _arguments.numbers(handles),
        "alpha": _arguments.numbers(alpha),
        "subdivide": subdivide,
        "limit": limit,
        "surface_normals": surface_normals,
        "normal_threshold": normal_threshold,
        "normal_tolerance": normal_tolerance,
        "normal_levels": normal_levels,
        "ite_max": ite_max,
        "eps": eps,
        "thin_plate": thin_plate,
        "membrane": membrane,
    }
    asked = _arguments.asked(method, omega, order, tol, atol, max_iter, _told(callback))
    return _solution(_limitlab.interpolate(surface, scheme, asked, wishes), F, check)


class Bounds(NamedTuple):
    """What is proven of the eigenvalues of A and of D⁻¹A, D = diag A, by valences and face sizes."""

    lambda_min: float
    lambda_max: float
    jacobi_lambda_min: float
    jacobi_lambda_max: float


class Block(NamedTuple):
    """The smooth vertices S of an open or creased mesh: A_SS = diag(h) M with a symmetric M."""

    vertices: NDArray[np.int32]
    """The vertex of each row."""
    A: csr_array
    M: csr_array
    h: Floats


@dataclass(frozen=True)
class Blocks:
    """Which vertices are found in which stage: corners rest, curves are solved exactly, then the smooth ones."""

    smooth: NDArray[np.int32]
    curves: NDArray[np.int32]
    """On boundaries and creases."""
    corners: NDArray[np.int32]
    stars: NDArray[np.int32]
    """Darts and semi-sharp vertices, where no diagonal makes A symmetric; solved with the smooth ones."""

    def __repr__(self) -> str:
        parts = ", ".join(f"{len(getattr(self, name))} {name}" for name in ("smooth", "curves", "corners", "stars"))
        return f"<Blocks: {parts}>"


def _csr(parts: tuple[NDArray[Any], ...]) -> csr_array:
    n = len(parts[2]) - 1
    matrix = csr_array(parts, shape=(n, n), copy=False)
    # They are: SciPy would look for it, and note it, with passes over all entries.
    matrix.has_sorted_indices = True
    matrix.has_canonical_format = True
    return matrix


class System:
    """The limit system A V = P of a mesh: its matrices, products and solutions. Made by `assemble`.

    The arrays of `A`, `M` and `h` lie in the memory of the library, which they keep alive; A and M share their indices. They
    are read-only: products, factorizations and solvers of SciPy take them as they are, what changes a matrix in place needs
    `A.copy()`.
    """

    def __init__(self, inner: _limitlab.System, points: Floats) -> None:
        self._inner = inner
        self._points = points
        self._blocks = Blocks(*inner.blocks())
        self._A = _csr(inner.a())

    @property
    def scheme(self) -> str:
        """By name."""
        return self._inner.scheme

    @property
    def points(self) -> Floats:
        """The vertices of the mesh that it was assembled of: the right-hand side unless another is given."""
        return self._points

    @property
    def A(self) -> csr_array:
        """(n, n): takes control points to limit points. Rows sum to 1."""
        return self._A

    @property
    def M(self) -> csr_array:
        """Symmetric, with A = diag(h) M; on open and creased meshes that of the smooth vertices, `block`."""
        return _csr(self._inner.block_m())

    @property
    def h(self) -> Floats:
        """The diagonal of H, positive; on open and creased meshes that of the smooth vertices."""
        return self._inner.block_h()

    @property
    def bounds(self) -> Bounds:
        """Proven bounds; on open and creased meshes those of the smooth vertices."""
        return Bounds(*self._inner.bounds())

    @property
    def blocks(self) -> Blocks:
        """Smooth vertices, curves, corners."""
        return self._blocks

    @property
    def block(self) -> Block:
        """The system of the smooth vertices: all of it, where all are."""
        A = self._A if len(self._blocks.smooth) == len(self) else _csr(self._inner.block_a())
        return Block(self._blocks.smooth, A, self.M, self.h)

    @property
    def operator(self) -> LinearOperator:
        """A as a `scipy.sparse.linalg.LinearOperator`: without stored entries where all vertices are smooth, on all threads.

        SciPy's solvers for symmetric matrices want `symmetric_operator`.
        """
        n = len(self)

        def times(x: ArrayLike) -> Floats:
            return self._times(np.asarray(x))

        def transposed(x: NDArray[Any]) -> Floats:
            image: Floats
            if len(self._blocks.smooth) < n:
                image = self._A.T @ x
            else:
                h = self.h if np.ndim(x) == 1 else self.h[:, None]
                image = self._times(h * np.asarray(x)) / h
            return image

        return LinearOperator(
            (n, n), matvec=times, matmat=times, rmatvec=transposed, rmatmat=transposed, dtype=np.dtype(np.float64)
        )

    @property
    def symmetric_operator(self) -> LinearOperator:
        """M as a `LinearOperator`, of a mesh whose vertices are all smooth. M V = P / h; with diag(h) as the preconditioner
        SciPy's `cg` makes the iterates of `cg` here."""
        n = len(self)
        if len(self._blocks.smooth) < n:
            raise ValueError("M is that of the smooth vertices alone: use block.M")

        def times(x: ArrayLike) -> Floats:
            x = np.asarray(x)
            image: Floats = self._times(x) / (self.h if x.ndim == 1 else self.h[:, None])
            return image

        return LinearOperator((n, n), matvec=times, matmat=times, rmatvec=times, rmatmat=times, dtype=np.dtype(np.float64))

    def _times(self, x: NDArray[Any]) -> Floats:
        x = np.asarray(x, dtype=np.float64)
        if x.ndim == 2 and x.shape[1] == 3:
            return self._inner.times_points(np.ascontiguousarray(x))
        columns = x.reshape(len(x), -1).T
        image = np.stack([self._inner.times(np.ascontiguousarray(column)) for column in columns], axis=1)
        return image.reshape(x.shape)

    def solve(
        self,
        P: ArrayLike | None = None,
        *,
        method: str = "auto",
        x0: ArrayLike | None = None,
        tol: float = 1e-10,
        atol: float | None = None,
        max_iter: int = 10_000,
        omega: float | None = None,
        order: str = "file",
        callback: Callable[[Step], Any] | None = None,
        check: bool = True,
    ) -> Solution:
        """Solve A V = P.

        Parameters
        ----------
        P
            (n,), or (n, k) with k ≤ 3; the vertices of the mesh unless given.
        method
            As in `interpolate`, but for whole pipelines.
        x0
            The first V, of the shape of P; P unless given.
        tol, atol, max_iter, omega, order, callback, check
            As in `interpolate`; the tolerance is relative to the extent of P.

        Returns
        -------
        Solution
            Its vertices have the shape of P.

        Examples
        --------
        >>> import limitlab
        >>> system = limitlab.assemble(*limitlab.mesh("torus:16x16", noise=0.1))
        >>> system.solve(method="cg", tol=1e-8).converged
        True
        """
        right, shape = _padded(self._points if P is None else P, len(self), "P")
        start = None if x0 is None else _padded(x0, len(self), "x0")[0]
        asked = _arguments.asked(method, omega, order, tol, atol, max_iter, _told(callback))
        found = self._inner.solve(right, start, asked)
        width = shape[1] if len(shape) == 2 else 1
        found["vertices"] = found["vertices"][:, :width].reshape(shape)
        return _solution(found, None, check)

    def __len__(self) -> int:
        return len(self._inner)

    def __repr__(self) -> str:
        return f"<System: {self.scheme}, {len(self)} vertices, {self._A.nnz} entries, {self._blocks}>"


def _padded(given: ArrayLike, n: int, name: str) -> tuple[Floats, tuple[int, ...]]:
    """(n, 3), with zeros for the columns that are not there, and the shape."""
    array = np.asarray(given, dtype=np.float64)
    if array.ndim not in (1, 2) or len(array) != n or (array.ndim == 2 and not 1 <= array.shape[1] <= 3):
        raise ValueError(f"{name} has the shape {array.shape}: ({n},) is needed, or ({n}, k) with k from 1 to 3")
    if array.ndim == 2 and array.shape[1] == 3:
        return np.ascontiguousarray(array), array.shape
    padded = np.zeros((n, 3))
    padded[:, : array.shape[1] if array.ndim == 2 else 1] = array.reshape(n, -1)
    return padded, array.shape


def assemble(
    V: ArrayLike,
    F: Faces,
    scheme: str | None = None,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
    crease_angle: float | None = None,
) -> System:
    """Assemble the limit system of a mesh, with the options of `interpolate`.

    Examples
    --------
    >>> import limitlab, numpy as np
    >>> system = limitlab.assemble(*limitlab.mesh("octahedron"), "loop")
    >>> system.A.shape, bool(np.allclose(system.A.sum(axis=1), 1))
    ((6, 6), True)
    >>> np.shares_memory(system.A.indices, system.M.indices)
    True
    """
    surface = _arguments.surface(V, F, boundary, creases, corners, crease_angle)
    return System(_limitlab.System(surface, scheme), _arguments.points(V))


class Interpolator:
    """Control points again and again, for points that move over the same faces.

    The operator, the order of its rows and all arrays are kept from one set of points to the next; iterations go on from the
    control points that are there.

    Parameters
    ----------
    F, scheme, boundary, creases, corners, vertices
        As in `interpolate`.
    points
        (n, 3), any points of the mesh: a large one whose vertices lie scattered in memory is put in order by them. Without them
        the vertices are those that the faces name.

    Examples
    --------
    >>> import limitlab, numpy as np
    >>> V, F = limitlab.mesh("icosphere:3", noise=0.1)
    >>> interpolator = limitlab.Interpolator(F, "loop")
    >>> cold = interpolator.solve(V)
    >>> V[5] *= 1.01
    >>> interpolator.solve(V).iterations < cold.iterations
    True
    """

    def __init__(
        self,
        F: Faces,
        scheme: str | None = None,
        *,
        points: ArrayLike | None = None,
        boundary: str | None = None,
        creases: Tagged | None = None,
        corners: Tagged | None = None,
        vertices: ArrayLike | None = None,
    ) -> None:
        surface = _arguments.surface(points, F, boundary, creases, corners)
        self._inner = _limitlab.Interpolator(surface, scheme, _arguments.marks(vertices, len(surface)))
        self._faces = F

    @property
    def scheme(self) -> str:
        """By name."""
        return self._inner.scheme

    def solve(
        self,
        P: ArrayLike,
        *,
        out: Floats | None = None,
        warm: bool = True,
        tol: float = 1e-10,
        atol: float | None = None,
        max_iter: int = 10_000,
        callback: Callable[[Step], Any] | None = None,
        check: bool = True,
    ) -> Solution:
        """The control points of P.

        Parameters
        ----------
        out
            (n, 3) contiguous doubles, not those of P: where the control points go. With it no array is allocated.
        warm
            Go on from the control points of the last P, not from P.
        tol, atol, max_iter, callback, check
            As in `interpolate`.
        """
        given = _arguments.points(P, "P")
        target = np.empty_like(given) if out is None else out
        if np.may_share_memory(given, target):
            raise ValueError("out is a part of P: give another array")
        asked = _arguments.asked("auto", None, "file", tol, atol, max_iter, _told(callback))
        found = self._inner.solve(given, target, warm, asked)
        found["failed"] = None if found["status"] in ("converged", "stopped") else "use interpolate, which tries LDLᵀ too"
        return _solution(found | {"vertices": target, "scheme": self.scheme}, self._faces, check)

    def __len__(self) -> int:
        return len(self._inner)

    def __repr__(self) -> str:
        return f"<Interpolator: {self.scheme}, {len(self)} vertices>"
