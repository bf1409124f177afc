"""Limit matrices as test problems: known spectra, and the solvers of SciPy and PyAMG beside `interpolate`.

    python solver_family.py [OUT] [SIDE …]

One row a solver on a torus of SIDE × SIDE quads with noise: the time of everything after assembly, for all three
coordinates, to about one largest error, which the row tells. petsc4py takes the same arrays:
PETSc.Mat().createAIJ(A.shape, csr=(A.indptr, A.indices, A.data)).
"""

import sys
import time

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

import limitlab

A, eigenvalues = limitlab.gallery("torus", 40)
low, high = (sl.eigsh(A, k=1, which=end, return_eigenvectors=False)[0] for end in ("SA", "LA"))
print(f"λ_min {low:.10f} computed, {eigenvalues[0]:.10f} by the formula; λ_max {high:.10f}, {eigenvalues[-1]:.10f}")
print()

#: Of the diagonal of the bounding box, in all solvers.
TOLERANCE = 1e-8


def by_splu(system, P):
    """SuperLU of A, by minimum degree on A + Aᵀ."""
    options = {"SymmetricMode": True}
    factors = sl.splu(system.A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return factors.solve(P)


def columns(system, P, solve):
    """M V = P / h, one coordinate after the other, each to a 2-norm at which the largest error is about the tolerance."""
    M, h = system.M, system.h
    atol = tolerance(P) * np.sqrt(len(P)) / 10 / h.max()
    return np.stack([solve(M, P[:, k] / h, P[:, k], atol) for k in range(3)], axis=1)


def by_cg(system, P):
    """Conjugate gradients on M, preconditioned by H, from V = P."""
    h = system.h
    H = sl.LinearOperator(system.A.shape, matvec=lambda r: h * r)
    return columns(system, P, lambda M, b, p, atol: sl.cg(M, b, x0=p, rtol=0, atol=atol, M=H)[0])


def by_pyamg(system, P):
    """Smoothed aggregation of M as a preconditioner of conjugate gradients."""
    import pyamg

    multigrid = pyamg.smoothed_aggregation_solver(sp.csr_matrix(system.M))
    solve = multigrid.solve
    return columns(system, P, lambda M, b, p, atol: solve(b, x0=p, tol=atol / np.linalg.norm(b), accel="cg"))


def tolerance(P):
    """Of the largest error, in the units of the points."""
    return TOLERANCE * np.linalg.norm(np.ptp(P, axis=0))


solvers = {
    "limitlab, auto": lambda system, P: system.solve(P, tol=TOLERANCE).vertices,
    "limitlab, cg": lambda system, P: system.solve(P, method="cg", tol=TOLERANCE).vertices,
    "scipy splu": by_splu,
    "scipy cg": by_cg,
    "pyamg": by_pyamg,
}
for side in [int(side) for side in sys.argv[2:]] or [40]:
    V, F = limitlab.mesh(f"torus:{side}x{side}", noise=0.1)
    begin = time.perf_counter()
    system = limitlab.assemble(V, F)
    print(f"{len(V)} vertices, assembled in {time.perf_counter() - begin:.3f} s, tolerance {tolerance(V):.1e}")
    begin = time.perf_counter()
    found = limitlab.interpolate(V, F, tol=TOLERANCE)
    seconds = time.perf_counter() - begin
    rows = [("limitlab.interpolate, from V and F", seconds, found.vertices)]
    for name, solver in solvers.items():
        try:
            begin = time.perf_counter()
            solution = solver(system, V)
            rows.append((name, time.perf_counter() - begin, solution))
        except ImportError as missing:
            print(f"{name}: left out, {missing}")
    for name, seconds, solution in rows:
        error = np.linalg.norm(V - system.A @ solution, axis=1).max()
        print(f"  {name:36}{seconds:10.3f} s   max error {error:.1e}")
