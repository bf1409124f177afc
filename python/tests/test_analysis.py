"""Comparisons, sweeps, spectra, local matrices."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sl

import limitlab as ll
from limitlab.analysis import METHODS


def richardson(A: sp.csr_array, h: np.ndarray, P: np.ndarray) -> Iterator[np.ndarray]:
    V = P.copy()
    while True:
        V += P - A @ V
        yield V


def test_all_methods_are_compared(sphere: ll.Mesh) -> None:
    rows = ll.compare(*sphere)
    assert {row.method for row in rows} == {*METHODS, "auto"} and all(row.status == "converged" for row in rows)
    system = ll.assemble(*sphere)
    for name in ("pia", "cg", "jacobi", "gauss-seidel"):
        found = system.solve(method=name)
        assert rows[name].iterations == found.iterations
        np.testing.assert_array_equal(rows[name].history, found.history)
        np.testing.assert_allclose(rows[name].observed_rate, rows[name].predicted_rate, atol=0.03)
    with pytest.raises(KeyError):
        rows["nothing"]
    assert ll.compare(system, methods=["pia"])["pia"].iterations == rows["pia"].iterations
    with pytest.raises(ValueError, match="leave these out"):
        ll.compare(system, sphere.faces)
    with pytest.raises(ValueError, match="faces are missing"):
        ll.compare(sphere.vertices)


def test_methods_of_ones_own(sphere: ll.Mesh, sheet: ll.Mesh) -> None:
    for mesh in (sphere, sheet):
        system = ll.assemble(*mesh)
        block = system.block

        def direct(A: sp.csr_array, h: np.ndarray, P: np.ndarray) -> np.ndarray:
            return sl.spsolve(A.tocsc(), P)

        rows = ll.compare(system, methods=["pia", richardson, ("by hand", richardson), direct])
        for name in ("richardson", "by hand"):
            assert rows[name].status == "converged"
            np.testing.assert_allclose(rows[name].observed_rate, rows["pia"].observed_rate, rtol=0.02)
            if mesh is sphere:
                # From one start, which on open meshes is the right-hand side of the smooth vertices, and ours V = P.
                assert rows[name].iterations == rows["pia"].iterations
                np.testing.assert_allclose(rows[name].history[:-3], rows["pia"].history[:-3], rtol=1e-3)
        assert rows["direct"].iterations == 1 and rows["direct"].max_error < 1e-12
        assert block.A.shape == (len(system.blocks.smooth),) * 2


def test_an_iterator_of_iterates_is_a_method(sphere: ll.Mesh) -> None:
    system = ll.assemble(*sphere)
    iterates = richardson(system.A, system.h, system.points)
    rows = ll.compare(system, methods=["pia", ("iterates", iterates)])
    assert rows["iterates"].iterations == rows["pia"].iterations
    few = ll.compare(system, methods=[("few", [system.points, system.points])])
    assert few["few"].status == "breakdown" and few["few"].iterations == 2 and "no further" in few["few"].detail


def test_methods_of_ones_own_fail_as_they_do(sphere: ll.Mesh) -> None:
    def raising(A: Any, h: Any, P: np.ndarray) -> Iterator[np.ndarray]:
        yield P
        raise LookupError("mine")

    def misshapen(A: Any, h: Any, P: np.ndarray) -> Iterator[np.ndarray]:
        yield P[:-1]

    with pytest.raises(LookupError, match="mine"):
        ll.compare(*sphere, methods=[raising])
    with pytest.raises(ValueError, match="shape"):
        ll.compare(*sphere, methods=[misshapen])
    with pytest.raises(TypeError):
        ll.compare(*sphere, methods=[lambda A, h, P: 3])
    with pytest.raises(ValueError, match="unknown method"):
        ll.compare(*sphere, methods=["mine"])
    V, F = sphere
    diverging = ll.compare(V, F, methods=[("wild", lambda A, h, P: (10.0**k * P for k in range(400)))])
    assert diverging["wild"].status == "diverged"


def test_darts_leave_methods_out(sphere: ll.Mesh) -> None:
    V, F = sphere
    rows = ll.compare(V, F, creases=F[:1, :2])
    assert "cg" in rows.left_out and {row.method for row in rows} >= {"lu", "pia", "auto"}
    assert all(row.status == "converged" for row in rows)
    with pytest.raises(ValueError, match="of your own"):
        ll.compare(V, F, methods=[richardson], creases=F[:1, :2])


def test_a_callback_ends_one_method(sphere: ll.Mesh) -> None:
    rows = ll.compare(*sphere, methods=["pia", "cg"], callback=lambda step: step.method == "pia" and step.iteration == 4)
    assert (rows["pia"].status, rows["pia"].iterations, rows["cg"].status) == ("stopped", 4, "converged")


def test_sweeps_over_omega() -> None:
    sphere = ll.mesh("quad-sphere:2", noise=0.1)
    sweep = ll.sweep_omega(*sphere)
    assert {row.method for row in sweep} == {"jacobi", "pia", "sor"} and len(sweep) == 24 + 2 * 39
    A = ll.assemble(*sphere).A.toarray()
    inverse = 1 / np.diag(A)[:, None]
    for method, matrix in (("pia", A), ("jacobi", inverse * A)):
        eigenvalues = np.linalg.eigvals(matrix).real
        for row in sweep.of(method):
            np.testing.assert_allclose(row.predicted_rho, abs(1 - row.omega * eigenvalues).max(), atol=1e-9)
            if row.status == "converged" and row.observed_rate is not None:
                assert row.observed_rate < row.predicted_rho + 0.02
        np.testing.assert_allclose(sweep.critical[method], 2 / eigenvalues.max(), rtol=1e-9)
        np.testing.assert_allclose(sweep.optimal[method], 2 / (eigenvalues.max() + eigenvalues.min()), rtol=1e-9)
        fewest = min(row.iterations for row in sweep.of(method) if row.status == "converged")
        assert [row.iterations for row in sweep.of(method) if row.omega == sweep.best[method]] == [fewest]
    for wrong in ({"methods": ["cg"]}, {"omegas": [-1.0]}, {"omegas": [np.inf]}):
        with pytest.raises(ValueError):
            ll.sweep_omega(*sphere, **wrong)


@pytest.mark.parametrize("scheme", ["catmull-clark", "nasri", "zheng-cai", "mid-edge"])
def test_spectra_are_those_of_numpy(scheme: str) -> None:
    V, F = ll.mesh("quad-sphere:2", noise=0.1)
    found = ll.spectrum(V, F, scheme, full=True, modes=4)
    A = ll.assemble(V, F, scheme).A.toarray()
    eigenvalues, vectors = np.linalg.eig(A)
    order = np.argsort(eigenvalues.real)
    np.testing.assert_allclose(np.sort(found.eigenvalues), eigenvalues.real[order], atol=1e-11)
    np.testing.assert_allclose([found.lambda_min, found.lambda_max], eigenvalues.real[order][[0, -1]], atol=1e-9)
    jacobi = np.sort(np.linalg.eigvals(A / np.diag(A)[:, None]).real)
    np.testing.assert_allclose(np.sort(found.jacobi_eigenvalues), jacobi, atol=1e-11)
    np.testing.assert_allclose([found.jacobi_lambda_min, found.jacobi_lambda_max], jacobi[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(found.mode_eigenvalues, eigenvalues.real[order][:4], atol=1e-9)
    np.testing.assert_allclose(A @ found.modes, found.modes * found.mode_eigenvalues, atol=1e-7)
    np.testing.assert_allclose(abs(found.modes).max(axis=0), 1)
    np.testing.assert_allclose(found.rho["pia"], abs(1 - eigenvalues.real).max(), atol=1e-9)
    np.testing.assert_allclose(found.rho["thall"], abs(1 - jacobi / 2).max(), atol=1e-9)
    lower = np.tril(A)
    sweep = np.eye(len(A)) - np.linalg.solve(lower, A)
    np.testing.assert_allclose(found.rho["gauss-seidel"], abs(np.linalg.eigvals(sweep)).max(), atol=1e-6)
    assert found.bounds.lambda_min <= found.lambda_min + 1e-12
    assert found.singular == (scheme == "mid-edge")
    assert vectors.shape == A.shape


def test_spectra_of_open_meshes_are_those_of_smooth_vertices(sheet: ll.Mesh) -> None:
    system = ll.assemble(*sheet)
    found = ll.spectrum(system, full=True, modes=2)
    expected = np.sort(np.linalg.eigvals(system.block.A.toarray()).real)
    np.testing.assert_allclose(np.sort(found.eigenvalues), expected, atol=1e-11)
    assert len(found.curves) == len(system.blocks.curves) and np.all(found.curves > 0)
    fixed = np.setdiff1d(np.arange(len(system)), system.blocks.smooth)
    assert found.modes.shape == (len(system), 2) and not found.modes[fixed].any()


def test_spectra_with_darts_are_complex() -> None:
    V, F = ll.mesh("quad-sphere:2", noise=0.1)
    found = ll.spectrum(V, F, creases=F[:1, :2], full=True)
    expected = np.linalg.eigvals(ll.assemble(V, F, creases=F[:1, :2]).A.toarray())
    np.testing.assert_allclose(np.sort(found.eigenvalues.real), np.sort(expected.real), atol=1e-9)
    assert found.singular is None and found.ends["lambda_min"].source == "real parts"
    with pytest.raises(ValueError, match="symmetric"):
        ll.spectrum(V, F, creases=F[:1, :2], modes=1)


def test_singular_matrices_are_known() -> None:
    found = ll.spectrum(*ll.mesh("cube"), "catmull-clark", modes=1)
    assert found.singular and found.kernel_dimension == 1 and abs(found.lambda_min) < 1e-12
    np.testing.assert_allclose(abs(found.modes[:, 0]), 1)
    assert not ll.spectrum(*ll.mesh("cube"), "nasri").singular
    with pytest.raises(ValueError, match="no vertex is smooth"):
        ll.spectrum(*ll.mesh("cube"), creases=np.stack([ll.mesh("cube").faces.ravel()] * 2, 1)[:0], corners=range(8))


def test_large_spectra_need_no_dense_matrix() -> None:
    found = ll.spectrum(*ll.mesh("torus:40x40"), rates=False)
    # The symbol's least value; both numbers are even.
    np.testing.assert_allclose([found.lambda_min, found.lambda_max], [1 / 9, 1], rtol=1e-9)
    assert found.ends["lambda_max"].source == "proven"
    with pytest.raises((ValueError, MemoryError, ll.ComputationError)):
        ll.spectrum(*ll.mesh("torus:70x70"), full=True)


def test_local_matrices() -> None:
    for row in ll.splitting(range(3, 9), "catmull-clark"):
        n = row.valence
        c = np.cos(2 * np.pi / n)
        subdominant = (5 + c + np.sqrt((c + 9) * (c + 1))) / 16
        np.testing.assert_allclose([row.lambda_subdominant, row.lambda_subdominant_formula], subdominant, atol=1e-12)
        np.testing.assert_allclose(row.limit_mask[0], n / (n + 5), atol=1e-12)
        np.testing.assert_allclose([row.limit_mask.sum(), abs(row.eigenvalues[0])], 1, atol=1e-12)
        assert len(row.positions) == len(row.limit_mask) == len(row.eigenvalues)
        assert set(row.tangent_masks) == {"cosine", "sine"}
    (boundary,) = ll.splitting(2, at="boundary")
    np.testing.assert_allclose(boundary.limit_mask[:3], [2 / 3, 1 / 6, 0], atol=1e-12)
    (blend,) = ll.splitting([6], "sqrt3", alpha=1.0)
    assert blend.limit_mask_error is None or blend.limit_mask_error < 1e-9
    for wrong in (
        (2, {}),
        (101, {}),
        (4, {"scheme": "nasri"}),
        (4, {"at": "edge"}),
        (4, {"alpha": 0.5}),
        (4, {"scheme": "doo-sabin", "at": "crease"}),
    ):
        with pytest.raises(ValueError):
            ll.splitting(wrong[0], **wrong[1])


def test_pictures_and_tables(sphere: ll.Mesh) -> None:
    pytest.importorskip("pandas")
    rows = ll.compare(*sphere, methods=["pia", "cg", "lu"])
    table = rows.to_pandas()
    assert table["method"].tolist() == [row.method for row in rows]
    assert table["iterations"].tolist() == [row.iterations for row in rows]
    assert "observed rate" in repr(rows) and rows._repr_html_().count("<tr>") == 1 + len(rows)
    # One line each, but of the direct method.
    assert len(rows.plot().lines) == len(rows) - 1
    sweep = ll.sweep_omega(*sphere, omegas=[0.5, 1.0])
    assert sweep.to_pandas().shape == (6, 7) and "best" in repr(sweep)
    assert [text.get_text() for text in sweep.plot().get_legend().get_texts()] == ["jacobi", "pia", "sor"]
    spectrum = ll.spectrum(*sphere, full=True)
    assert spectrum.to_pandas().loc["lambda_max", "value"] == spectrum.lambda_max
    assert "proven bound" in repr(spectrum) and "<td>lambda_min</td>" in spectrum._repr_html_()
    assert sum(bar.get_height() for bar in spectrum.plot().patches) == len(spectrum.eigenvalues)
    with pytest.raises(ValueError, match="full=True"):
        ll.spectrum(*sphere).plot()
