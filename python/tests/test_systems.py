"""Matrices: shared memory, SciPy's own solvers on them, operators, stages."""

from __future__ import annotations

import gc

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sl

import limitlab as ll

SCHEMES = {
    "catmull-clark": "quad-sphere:3",
    "loop": "icosphere:3",
    "sqrt3": "icosphere:3",
    "nasri": "irregular-quad:300",
    "zheng-cai": "irregular-poly:300",
    "mid-edge": "icosphere:3",
}


@pytest.mark.parametrize(("scheme", "name"), SCHEMES.items())
def test_factors_and_solutions_are_those_of_scipy(scheme: str, name: str) -> None:
    V, F = ll.mesh(name, noise=0.1)
    system = ll.assemble(V, F, scheme)
    A, M, h = system.A, system.M, system.h
    assert A.format == "csr" and A.indices.dtype == np.int32 and A.shape == (len(V), len(V))
    np.testing.assert_allclose(A.sum(axis=1), 1, atol=1e-14)
    assert abs(M - M.T).max() == 0
    assert abs(sp.diags_array(h) @ M - A).max() < 1e-15
    # What was told SciPy of the order of the indices is so.
    assert all(np.all(np.diff(row) > 0) for row in np.split(A.indices, A.indptr[1:-1]))
    found = ll.interpolate(V, F, scheme)
    np.testing.assert_allclose(found.vertices, sl.spsolve(A.tocsc(), V), atol=1e-8)
    np.testing.assert_allclose(system.solve(method="lu").vertices, sl.spsolve(A.tocsc(), V), atol=1e-11)
    np.testing.assert_allclose(A @ found.vertices, V, atol=2 * found.tolerance)
    np.testing.assert_allclose(ll.limit(found.vertices, F, scheme), V, atol=2 * found.tolerance)


def test_memory_is_that_of_the_library_and_lives_on(sphere: ll.Mesh) -> None:
    system = ll.assemble(*sphere)
    A, M, h = system.A, system.M, system.h
    assert np.shares_memory(A.indices, M.indices) and np.shares_memory(A.indptr, M.indptr)
    assert not np.shares_memory(A.data, M.data)
    again = system._inner.a()
    for held, there in zip((A.data, A.indices, A.indptr), again, strict=True):
        assert np.shares_memory(held, there) and held.__array_interface__["data"] == there.__array_interface__["data"]
        assert not held.flags.writeable
    with pytest.raises(ValueError):
        h[0] = 1.0
    before = A.toarray()
    del system, again, M, h
    gc.collect()
    # Memory that had been freed would be used by these.
    _ = [np.full(len(A.data), np.nan) for _ in range(20)]
    np.testing.assert_array_equal(A.toarray(), before)
    assert A.copy().data.flags.writeable


def test_scipy_and_pyamg_run_on_the_views(sphere: ll.Mesh) -> None:
    V, F = sphere
    system = ll.assemble(V, F)
    M, right = system.M, V / system.h[:, None]
    x, code = sl.cg(M, right[:, 0], rtol=1e-12)
    assert code == 0
    np.testing.assert_allclose(x, system.solve(V[:, 0], method="cholesky").vertices, atol=1e-9)
    low = sl.eigsh(M.tocsc(), k=1, sigma=0, return_eigenvectors=False)
    np.testing.assert_allclose(low[0], np.linalg.eigvalsh(M.toarray())[0], rtol=1e-9)
    pyamg = pytest.importorskip("pyamg")
    solver = pyamg.smoothed_aggregation_solver(sp.csr_matrix(M))
    np.testing.assert_allclose(solver.solve(right[:, 1], tol=1e-12, accel="cg"), sl.spsolve(M.tocsc(), right[:, 1]), atol=1e-8)


@pytest.mark.parametrize("scheme", ["catmull-clark", "nasri", "mid-edge"])
def test_operators_are_the_matrices(scheme: str, sphere: ll.Mesh) -> None:
    system = ll.assemble(*sphere, scheme)
    rng = np.random.default_rng(1)
    for shape in [(len(system),), (len(system), 1), (len(system), 2), (len(system), 3)]:
        x = rng.standard_normal(shape)
        np.testing.assert_allclose(system.operator @ x, system.A @ x, atol=1e-14)
        np.testing.assert_allclose(system.operator.T @ x, system.A.T @ x, atol=1e-14)
        np.testing.assert_allclose(system.symmetric_operator @ x, system.M @ x, atol=1e-11)
    # Strided, and of another type.
    wide = rng.standard_normal((len(system), 6)).astype(np.float32)
    np.testing.assert_allclose(system.operator @ wide[:, ::2], system.A @ wide[:, ::2].astype(float), atol=1e-14)


@pytest.mark.parametrize("matrix_free", [False, True])
def test_cg_of_scipy_makes_as_many_iterations_as_ours(sphere: ll.Mesh, matrix_free: bool) -> None:
    V, _ = sphere
    system = ll.assemble(*sphere)
    ours = system.solve(V[:, 0], method="cg", atol=1e-8)
    M = system.symmetric_operator if matrix_free else system.M
    counted = [0, 0]

    def watch(x: np.ndarray) -> None:
        counted[0] += 1
        if not counted[1] and np.abs(V[:, 0] - system.A @ x).max() <= 1e-8:
            counted[1] = counted[0]

    # From V = P, as ours.
    H = sl.LinearOperator(M.shape, matvec=lambda r: system.h * r)
    sl.cg(M, V[:, 0] / system.h, x0=V[:, 0], rtol=1e-13, M=H, callback=watch)
    assert counted[1] == ours.iterations > 10


def test_open_and_creased_meshes_have_stages(sheet: ll.Mesh) -> None:
    V, F = sheet
    system = ll.assemble(V, F)
    blocks, block = system.blocks, system.block
    assert len(blocks.smooth) + len(blocks.curves) + len(blocks.corners) == len(V) and len(blocks.curves) > 4
    np.testing.assert_allclose(system.A.sum(axis=1), 1, atol=1e-14)
    A_SS = system.A.tocsr()[blocks.smooth][:, blocks.smooth]
    assert abs(A_SS - block.A).max() < 1e-15
    assert abs(sp.diags_array(block.h) @ block.M - block.A).max() < 1e-15 and abs(block.M - block.M.T).max() == 0
    # Curves see curves and corners alone.
    assert abs(system.A.tocsr()[blocks.curves][:, blocks.smooth]).max() == 0
    x = np.random.default_rng(2).standard_normal((len(V), 3))
    np.testing.assert_allclose(system.operator @ x, system.A @ x, atol=1e-14)
    np.testing.assert_allclose(system.operator.T @ x, system.A.T @ x, atol=1e-14)
    exact = sl.spsolve(system.A.tocsc(), V)
    for method in ("auto", "lu", "cg", "gauss-seidel"):
        np.testing.assert_allclose(system.solve(method=method).vertices, exact, atol=1e-8)
    with pytest.raises(ValueError, match=r"block\.M"):
        _ = system.symmetric_operator


def test_darts_have_no_symmetric_matrix(sphere: ll.Mesh) -> None:
    V, F = sphere
    # Two edges at a vertex between them: darts at both ends.
    crease = np.array([[F[0, 0], F[0, 1]]])
    system = ll.assemble(V, F, creases=crease)
    assert len(system.blocks.stars) == 2
    exact = sl.spsolve(system.A.tocsc(), V)
    for method in ("auto", "lu", "gauss-seidel", "anderson"):
        np.testing.assert_allclose(system.solve(method=method).vertices, exact, atol=1e-8)
    with pytest.raises(ll.MeshError, match="symmetric") as caught:
        system.solve(method="cg")
    assert caught.value.defects[0]["vertex"] in F[0, :2]


def test_a_start_saves_iterations(sphere: ll.Mesh, sheet: ll.Mesh) -> None:
    for V, F in (sphere, sheet):
        system = ll.assemble(V, F)
        cold = system.solve(method="pia", tol=1e-6)
        for method in ("pia", "auto"):
            warm = system.solve(method=method, x0=cold.vertices, tol=1e-6)
            assert warm.iterations == 0 and warm.converged
            np.testing.assert_allclose(warm.vertices, cold.vertices, atol=1e-12)
        onward = system.solve(method="pia", x0=cold.vertices, tol=1e-10)
        assert cold.iterations + onward.iterations == system.solve(method="pia", tol=1e-10).iterations


def test_right_hand_sides_of_other_shapes(sphere: ll.Mesh) -> None:
    V, _ = sphere
    system = ll.assemble(*sphere)
    exact = sl.spsolve(system.A.tocsc(), V)
    assert system.solve(V[:, 0], method="lu").vertices.shape == (len(V),)
    np.testing.assert_allclose(system.solve(V[:, :2], method="lu").vertices, exact[:, :2], atol=1e-11)
    for wrong in (V[:-1], np.zeros((len(V), 4)), np.zeros((len(V), 0)), np.zeros((2, len(V), 3))):
        with pytest.raises(ValueError, match="shape"):
            system.solve(wrong)
    with pytest.raises(ValueError, match="finite"):
        system.solve(V * np.nan)


def test_bounds_hold() -> None:
    system = ll.assemble(*ll.mesh("quad-sphere:2", noise=0.1), "nasri")
    eigenvalues = np.linalg.eigvals(system.A.toarray()).real
    assert 0.25 == system.bounds.lambda_min <= eigenvalues.min() + 1e-12
    assert eigenvalues.max() <= system.bounds.lambda_max + 1e-12


@pytest.mark.parametrize("scheme", ["catmull-clark", "nasri", "zheng-cai", "mid-edge", "loop", "sqrt3"])
@pytest.mark.parametrize("size", [(6, 6), (5, 8)])
def test_the_gallery_knows_its_eigenvalues(scheme: str, size: tuple[int, int]) -> None:
    family = "tri-torus" if scheme in ("loop", "sqrt3") else "torus"
    A, eigenvalues = ll.gallery(family, *size, scheme)
    assert A.shape == (size[0] * size[1],) * 2
    np.testing.assert_allclose(np.linalg.eigvalsh(A.toarray()), eigenvalues, atol=1e-13)
    # And as the library computes them.
    V, F = ll.mesh(f"{family}:{size[0]}x{size[1]}")
    full = ll.spectrum(V, F, scheme, full=True, rates=False)
    np.testing.assert_allclose(np.sort(full.eigenvalues), eigenvalues, atol=1e-12)


def test_the_gallery_refuses_what_it_has_no_symbol_of() -> None:
    for name, scheme in (("torus", "loop"), ("tri-torus", "nasri"), ("cube", None)):
        with pytest.raises(ValueError, match="use"):
            ll.gallery(name, 5, scheme=scheme)


def test_representations_tell_what_there_is(sheet: ll.Mesh) -> None:
    system = ll.assemble(*sheet)
    assert "curves" in repr(system) and "catmull-clark" in repr(system) and f"{len(system)} vertices" in repr(system)
