"""How fast methods are and why: comparisons, sweeps over ω, spectra, local matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from . import _arguments, _limitlab
from ._arguments import Faces, Floats, Tagged
from .solving import Bounds, Step, System, _told, assemble

__all__ = [
    "Comparison",
    "End",
    "OmegaSweep",
    "OwnMethod",
    "Row",
    "Spectrum",
    "Splitting",
    "SweepRow",
    "compare",
    "spectrum",
    "splitting",
    "sweep_omega",
]

OwnMethod = Callable[[csr_array, Floats, Floats], Any] | Iterable[ArrayLike]
"""A method of one's own: called with A, h and P it gives iterates, or the solution; or an iterable of iterates."""

METHODS = [
    "lu",
    "cholesky",
    "ldlt",
    "jacobi",
    "thall",
    "gauss-seidel",
    "sor",
    "ssor",
    "pia",
    "w-pia",
    "chebyshev",
    "cg",
    "pcg-jacobi",
    "pcg-ssor",
    "pcg-ic0",
    "anderson",
    "heavy-ball",
]
"""All methods that solve a system, by name."""


def _table(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)


def _html(rows: Sequence[Sequence[str]]) -> str:
    import html

    head, *body = ("".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) for tag, row in _tagged(rows))
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(f'<tr>{row}</tr>' for row in body)}</tbody></table>"


def _tagged(rows: Sequence[Sequence[str]]) -> Iterator[tuple[str, Sequence[str]]]:
    return ((("td" if k else "th"), row) for k, row in enumerate(rows))


def _number(x: float | None, digits: int = 4) -> str:
    return "" if x is None else f"{x:.{digits}g}"


@dataclass(frozen=True, repr=False, kw_only=True)
class Row:
    """What came of one method."""

    method: str
    """By name, or the name of one's own."""
    parameter: str
    """Its numbers, its order, its variant."""
    status: str
    iterations: int
    max_error: float
    """In the units of the points, as all errors."""
    mean_error: float
    observed_rate: float | None
    """The factor per iteration at the end of the history."""
    predicted_rate: float | None
    """What the spectrum says of it."""
    passes: int | None
    """Passes over the matrix in an iteration; `None` where it factors the matrix, or is not known."""
    fill: int | None
    """Stored entries of factors, where they are known."""
    setup_seconds: float
    solve_seconds: float
    detail: str | None
    """The reason of a status, where there is one."""
    history: Floats
    """(k, 3): iteration, maximum and mean error."""

    @property
    def label(self) -> str:
        """Method and parameter."""
        return f"{self.method} ({self.parameter})" if self.parameter else self.method

    def __repr__(self) -> str:
        return f"<Row: {self.label}, {self.status} after {self.iterations} iterations, max error {self.max_error:.2e}>"


@dataclass(frozen=True, repr=False)
class Comparison:
    """Methods on one system, from one start, in one norm, to one tolerance. It is a sequence of its rows."""

    rows: list[Row]
    left_out: list[str] = field(default_factory=list)
    """Methods that need a symmetric matrix, where darts and semi-sharp vertices leave none."""

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: int | str) -> Row:
        """A row by number, or the first of a method."""
        if isinstance(which, int):
            return self.rows[which]
        for row in self.rows:
            if row.method == which:
                return row
        raise KeyError(which)

    def to_pandas(self) -> Any:
        """The rows as a `pandas.DataFrame`, without histories."""
        import pandas

        names = [name for name in Row.__dataclass_fields__ if name != "history"]
        return pandas.DataFrame([[getattr(row, name) for name in names] for row in self.rows], columns=names)

    def plot(self, ax: Any = None) -> Any:
        """Draw the maximum errors over the iterations with matplotlib; gives the axes."""
        from .plots import histories

        return histories([(row.label, row.history, row.status) for row in self.rows if len(row.history) > 2], ax)

    def _cells(self) -> list[list[str]]:
        head = ["method", "status", "iterations", "max error", "observed rate", "predicted rate", "seconds"]
        return [head] + [
            [
                row.label,
                row.status,
                str(row.iterations),
                f"{row.max_error:.2e}",
                _number(row.observed_rate),
                _number(row.predicted_rate),
                f"{row.setup_seconds + row.solve_seconds:.3g}",
            ]
            for row in self.rows
        ]

    def __repr__(self) -> str:
        return _table(self._cells())

    def _repr_html_(self) -> str:
        return _html(self._cells())


def _named(method: OwnMethod, name: str | None) -> tuple[str, OwnMethod]:
    return name or str(getattr(method, "__name__", type(method).__name__)), method


def _runs(method: OwnMethod, A: csr_array, h: Floats) -> Callable[[Floats], Iterator[Floats]]:
    """Gives the iterates of one's own method on a right-hand side, each time from the first."""
    kept: list[Floats] = []
    rest: Iterator[ArrayLike] | None = None if callable(method) else iter(method)

    def array(iterate: ArrayLike, P: Floats) -> Floats:
        found = np.ascontiguousarray(iterate, dtype=np.float64)
        if found.shape != P.shape:
            raise ValueError(f"an iterate has the shape {found.shape}, and P {P.shape}")
        return found

    def run(P: Floats) -> Iterator[Floats]:
        if rest is None:
            found = method(A, h, P)  # type: ignore[operator]
            iterates = [found] if isinstance(found, np.ndarray) else found
            for iterate in iterates:
                yield array(iterate, P)
            return
        # Short runs are timed several times, and an iterator gives its iterates once.
        yield from kept
        for iterate in rest:
            kept.append(array(iterate, P).copy())
            yield kept[-1]

    return run


def _system(V: Any, F: Faces | None, scheme: str | None, tags: dict[str, Any]) -> System:
    if isinstance(V, System):
        if F is not None or scheme is not None or any(value is not None for value in tags.values()):
            raise ValueError("a System has its faces, scheme and creases: leave these out")
        return V
    if F is None:
        raise ValueError("faces are missing: give V and F, or a System")
    return assemble(V, F, scheme, **tags)


def compare(
    V: ArrayLike | System,
    F: Faces | None = None,
    scheme: str | None = None,
    methods: Iterable[str | OwnMethod | tuple[str, OwnMethod]] | None = None,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
    tol: float = 1e-10,
    atol: float | None = None,
    max_iter: int = 10_000,
    order: str = "file",
    callback: Callable[[Step], Any] | None = None,
) -> Comparison:
    """Run methods on one system, one's own among them, each from V = P to the same tolerance in the same norm.

    Parameters
    ----------
    V, F, scheme, boundary, creases, corners
        As in `interpolate`; or a `System` alone.
    methods
        Names, all and `auto` unless told; some have further rows, of other intervals and libraries. And methods of one's own,
        by themselves or as (name, method): a function of A, h and P that gives an iterator of iterates, or the solution at
        once; or an iterator of iterates. Iterates are (n, 3) arrays, the first of them that after P. On open and creased meshes
        A, h and P are those of the smooth vertices. A short run is made up to five times, and its least times are told.
    tol, atol, max_iter, order
        As in `interpolate`.
    callback
        As in `interpolate`, for each method by name; one that says stop ends that method.

    Examples
    --------
    >>> import limitlab
    >>> def richardson(A, h, P):
    ...     V = P.copy()
    ...     while True:
    ...         V += P - A @ V
    ...         yield V
    >>> V, F = limitlab.mesh("icosphere:2", noise=0.1)
    >>> rows = limitlab.compare(V, F, methods=["pia", richardson])
    >>> rows["pia"].iterations == rows["richardson"].iterations
    True
    """
    system = _system(V, F, scheme, {"boundary": boundary, "creases": creases, "corners": corners})
    names: list[str] = []
    own: list[tuple[str, Callable[[Floats], Iterator[Floats]]]] = []
    block = system.block
    for method in [*METHODS, "auto"] if methods is None else methods:
        if isinstance(method, str):
            names.append(method)
            continue
        pair = isinstance(method, tuple) and len(method) == 2 and isinstance(method[0], str)
        name, one = _named(method[1], method[0]) if pair else _named(method, None)  # type: ignore[index, arg-type]
        own.append((name, _runs(one, block.A, block.h)))
    asked = _arguments.asked("auto", None, order, tol, atol, max_iter, _told(callback))
    rows, left_out = _limitlab.compare(system._inner, system.points, names, own, asked)
    return Comparison([Row(**row) for row in rows], left_out)


@dataclass(frozen=True, kw_only=True)
class SweepRow:
    """A method at one ω."""

    method: str
    omega: float
    status: str
    iterations: int
    predicted_rho: float
    """The spectral radius of its error matrix."""
    observed_rate: float | None
    """The factor per iteration at the end of the history."""
    max_error: float
    """At the end, in the units of the points."""


@dataclass(frozen=True, repr=False)
class OmegaSweep:
    """Iterations and rates over ω."""

    rows: list[SweepRow]
    best: dict[str, float]
    """ω of the fewest iterations on the grid, by method."""
    optimal: dict[str, float]
    """ω of the least spectral radius, by method; none of SOR."""
    critical: dict[str, float]
    """ω beyond which a method diverges; none of SOR."""

    def __iter__(self) -> Iterator[SweepRow]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def of(self, method: str) -> list[SweepRow]:
        """The rows of one method."""
        return [row for row in self.rows if row.method == method]

    def to_pandas(self) -> Any:
        """The rows as a `pandas.DataFrame`."""
        import pandas

        names = list(SweepRow.__dataclass_fields__)
        return pandas.DataFrame([[getattr(row, name) for name in names] for row in self.rows], columns=names)

    def plot(self, ax: Any = None) -> Any:
        """Draw predicted rates as lines and observed ones as dots over ω, with matplotlib; gives the axes."""
        from .plots import sweep

        return sweep(self, ax)

    def __repr__(self) -> str:
        best = ", ".join(f"{method} ω={omega:.4g}" for method, omega in self.best.items())
        return f"<OmegaSweep: {len(self.rows)} rows; best: {best or 'none converged'}>"


def sweep_omega(
    V: ArrayLike | System,
    F: Faces | None = None,
    scheme: str | None = None,
    methods: Iterable[str] = ("jacobi", "pia", "sor"),
    omegas: ArrayLike | None = None,
    *,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
    tol: float = 1e-10,
    atol: float | None = None,
    max_iter: int = 10_000,
    order: str = "file",
) -> OmegaSweep:
    """Run `jacobi`, `pia` and `sor` at every ω of a grid, with the predicted spectral radius of each.

    Parameters
    ----------
    omegas
        The grid: from 0.05 in steps of 0.05, to 1.2 for Jacobi and below 2 for the others, unless given.

    Examples
    --------
    >>> import limitlab
    >>> sweep = limitlab.sweep_omega(*limitlab.mesh("torus:8x8", noise=0.1), methods=["pia"], omegas=[1.0, 1.5])
    >>> [row.iterations > 0 and row.predicted_rho < 1 for row in sweep]
    [True, True]
    """
    system = _system(V, F, scheme, {"boundary": boundary, "creases": creases, "corners": corners})

    def grid(method: str) -> list[float]:
        if omegas is not None:
            return np.asarray(omegas, dtype=np.float64).ravel().tolist()
        steps = 24 if method.lower() == "jacobi" else 39
        return [round(0.05 * k, 2) for k in range(1, steps + 1)]

    asked = _arguments.asked("auto", None, order, tol, atol, max_iter)
    found = _limitlab.sweep_omega(system._inner, system.points, [(name, grid(name)) for name in methods], asked)
    return OmegaSweep([SweepRow(**row) for row in found["rows"]], found["best"], found["optimal"], found["critical"])


@dataclass(frozen=True)
class End:
    """An end of a spectrum and how well it is known."""

    value: float
    residual: float | None
    """An eigenvalue lies within this distance."""
    error: float | None
    """Estimated."""
    source: str
    """`dense`, `proven`, `bracketed`, `lanczos`, `unconverged`; `real parts` of complex eigenvalues."""
    multiplicity: int | None
    """Where it was decided."""


@dataclass(frozen=True, repr=False, kw_only=True)
class Spectrum:
    """The spectra of A and D⁻¹A, and what follows for methods. On open and creased meshes those of the smooth vertices; where
    darts and semi-sharp vertices leave no symmetric matrix, those of all, whose eigenvalues are complex."""

    ends: dict[str, End]
    """Of `lambda_min`, `lambda_max`, `jacobi_lambda_min` and `jacobi_lambda_max`."""
    bounds: Bounds
    """Proven before."""
    rho: dict[str, float]
    """The predicted factor per iteration by method, with the best ω known of `jacobi` and `w-pia`."""
    optimal_omega: dict[str, float]
    """2/(λ_min + λ_max), of `w-pia` and `jacobi`."""
    critical_omega: dict[str, float]
    """2/λ_max, beyond which they diverge."""
    singular: bool | None = None
    """By theory; `None` where there is none."""
    kernel_dimension: int | None = None
    eigenvalues: NDArray[Any] | None = None
    """All of A, if they were asked for."""
    jacobi_eigenvalues: NDArray[Any] | None = None
    """All of D⁻¹A, if they were asked for."""
    mode_eigenvalues: Floats | None = None
    """Of the slowest modes, ascending."""
    modes: Floats | None = None
    """(n, k): the slowest modes at the vertices, of largest entry 1."""
    curves: Floats | None = None
    """Eigenvalues of the curves of an open or creased mesh."""

    @property
    def lambda_min(self) -> float:
        """The least eigenvalue of A."""
        return self.ends["lambda_min"].value

    @property
    def lambda_max(self) -> float:
        """The greatest eigenvalue of A."""
        return self.ends["lambda_max"].value

    @property
    def jacobi_lambda_min(self) -> float:
        """The least eigenvalue of D⁻¹A."""
        return self.ends["jacobi_lambda_min"].value

    @property
    def jacobi_lambda_max(self) -> float:
        """The greatest eigenvalue of D⁻¹A."""
        return self.ends["jacobi_lambda_max"].value

    def to_pandas(self) -> Any:
        """The ends as a `pandas.DataFrame`, with the proven bounds."""
        import pandas

        rows = {name: {**vars(end), "bound": getattr(self.bounds, name)} for name, end in self.ends.items()}
        return pandas.DataFrame.from_dict(rows, orient="index")

    def plot(self, ax: Any = None) -> Any:
        """Draw all eigenvalues of A: how many where, or in the complex plane. Needs `full=True`; gives the axes."""
        from .plots import eigenvalues

        return eigenvalues(self, ax)

    def _cells(self) -> list[list[str]]:
        rows = [["quantity", "value", "proven bound", "source"]]
        for name, end in self.ends.items():
            rows.append([name, f"{end.value:.10g}", f"{getattr(self.bounds, name):.10g}", end.source])
        rows += [[f"rho of {method}", f"{rho:.6g}", "", "predicted"] for method, rho in self.rho.items()]
        if self.singular is not None:
            rows.append(["singular", str(self.singular), "", "proven"])
        return rows

    def __repr__(self) -> str:
        return _table(self._cells())

    def _repr_html_(self) -> str:
        return _html(self._cells())


def spectrum(
    V: ArrayLike | System,
    F: Faces | None = None,
    scheme: str | None = None,
    *,
    full: bool = False,
    modes: int = 0,
    rates: bool = True,
    boundary: str | None = None,
    creases: Tagged | None = None,
    corners: Tagged | None = None,
) -> Spectrum:
    """The ends of the spectra of A and D⁻¹A, the rates that follow, singular or not.

    Parameters
    ----------
    V, F, scheme, boundary, creases, corners
        As in `interpolate`; or a `System` alone.
    full
        All eigenvalues, of up to 4000 vertices (2000 where they are complex).
    modes
        So many of the slowest modes.
    rates
        Predict those of all methods; the ones of sweeps take Arnoldi processes.

    Examples
    --------
    >>> import limitlab
    >>> found = limitlab.spectrum(*limitlab.mesh("cube"), "catmull-clark")
    >>> found.singular, found.kernel_dimension
    (True, 1)
    """
    system = _system(V, F, scheme, {"boundary": boundary, "creases": creases, "corners": corners})
    if modes < 0:
        raise ValueError(f"modes={modes}: a number from 0 on is needed")
    wanted = {"full": full, "modes": modes, "rates": rates}
    found = _limitlab.spectrum(system._inner, system.points, wanted)
    for name in ("eigenvalues", "jacobi_eigenvalues"):
        if isinstance(found.get(name), list):
            real, imaginary = found[name]
            found[name] = real + 1j * imaginary
    found["ends"] = {name: End(*end) for name, end in found["ends"].items()}
    for name in ("rho", "optimal_omega", "critical_omega"):
        found[name] = dict(found[name])
    if "modes" in found:
        found["modes"] = found["modes"].T
        found["mode_eigenvalues"] = np.asarray(found["mode_eigenvalues"])
    return Spectrum(bounds=system.bounds, **found)


@dataclass(frozen=True, repr=False, kw_only=True)
class Splitting:
    """The local matrix of one valence."""

    valence: int
    positions: list[str]
    """What its rows are of: the vertex, edges, faces, ring by ring."""
    eigenvalues: NDArray[np.complex128]
    """All, by falling modulus."""
    eigenvalue_error: float | None
    """From the closed forms, where there are some."""
    limit_mask: Floats
    """One weight a position, sum 1."""
    limit_mask_error: float | None
    """From the closed form."""
    tangent_masks: dict[str, Floats]
    """By name."""
    lambda_subdominant: float | None = None
    """λ_1 of a smooth vertex."""
    lambda_subdominant_formula: float | None = None
    """The same in closed form."""
    regular: bool | None = None
    """Whether the characteristic map is."""
    injective: bool | None = None
    """Whether it is."""

    def __repr__(self) -> str:
        leading = ", ".join(f"{abs(z):.6f}" for z in self.eigenvalues[:4])
        return f"<Splitting: valence {self.valence}, |λ| = {leading}, …>"


def splitting(
    valences: int | Iterable[int] = range(3, 13),
    scheme: str = "catmull-clark",
    *,
    alpha: float | None = None,
    at: str = "smooth",
) -> list[Splitting]:
    """Local splitting matrices: eigenvalues, limit and tangent masks, held against closed forms; one a valence.

    Parameters
    ----------
    valences
        From 3 to 100; at a boundary or corner numbers of faces, from 1 on.
    scheme
        `catmull-clark`, `loop`, `doo-sabin` (at a face), `sqrt3`, `labsik-greiner`, `kobbelt`, or one with the prefix
        `blended-` or `pushed-back-` (`catmull-clark`, `loop`).
    alpha
        The blend of `sqrt3`, from 0 to 2.
    at
        `smooth`, `boundary`, `crease`, `corner` or `dart`.

    Examples
    --------
    >>> import limitlab
    >>> regular, = limitlab.splitting(6, "loop")
    >>> round(regular.lambda_subdominant, 12)
    0.5
    """
    wanted = [valences] if isinstance(valences, (int, np.integer)) else list(valences)
    found = _limitlab.splitting([int(n) for n in wanted], scheme, alpha, at)
    for row in found:
        real, imaginary = row["eigenvalues"]
        row["eigenvalues"] = real + 1j * imaginary
        row["tangent_masks"] = {name: np.asarray(mask) for name, mask in row["tangent_masks"]}
    return [Splitting(**row) for row in found]
