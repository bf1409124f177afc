"""Control meshes: every form of input, every pipeline, callbacks, errors, threads."""

from __future__ import annotations

import itertools
import os
import pathlib
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import edges

import limitlab as ll
from limitlab.analysis import METHODS


def test_every_form_of_faces_is_the_same_mesh() -> None:
    V, F = ll.mesh("octahedron")
    offsets = np.arange(0, 3 * len(F) + 1, 3)
    wide = np.zeros((len(F), 6), np.int64)
    wide[:, ::2] = F
    forms: list[Any] = [F.astype(kind) for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4", ">i8")]
    forms += [np.asfortranarray(F), wide[:, ::2], F.tolist(), [tuple(face) for face in F.tolist()]]
    forms += [(F.ravel(), offsets), (F.ravel().astype(np.int64), offsets.astype(np.int32)), (F.ravel(), offsets[:-1])]
    forms += [(F.ravel().tolist(), offsets.tolist())]
    first = ll.assemble(V, F).A.toarray()
    for form in forms:
        np.testing.assert_array_equal(ll.assemble(V, form).A.toarray(), first)


def test_mixed_faces_come_and_go_as_offsets() -> None:
    V, F = ll.mesh("prism:5")
    corners, offsets = F
    assert corners.dtype == offsets.dtype == np.int32 and offsets[-1] == len(corners)
    lists = [corners[a:b].tolist() for a, b in itertools.pairwise(offsets)]
    assert sorted(map(len, lists)) == [4] * 5 + [5] * 2
    np.testing.assert_array_equal(ll.assemble(V, lists).A.toarray(), ll.assemble(V, F).A.toarray())
    assert "mixed" in repr(ll.mesh("prism:5"))


def test_points_of_every_kind_are_taken(sphere: ll.Mesh) -> None:
    V, F = sphere
    wide = np.zeros((len(V), 6))
    wide[:, ::2] = V
    expected = ll.interpolate(V, F).vertices
    for points in (np.asfortranarray(V), wide[:, ::2], V.tolist(), V.astype(">f8")):
        np.testing.assert_array_equal(ll.interpolate(points, F).vertices, expected)
    np.testing.assert_allclose(ll.interpolate(V.astype(np.float32), F).vertices, expected, atol=1e-5)
    whole = np.round(100 * V).astype(int)
    np.testing.assert_array_equal(ll.interpolate(whole, F).vertices, ll.interpolate(whole.astype(float), F).vertices)


def test_what_is_given_stays_as_it_is(sphere: ll.Mesh) -> None:
    V, F = sphere
    before = V.copy(), F.copy()
    V.flags.writeable = F.flags.writeable = False
    found = ll.interpolate(V, F, subdivide=1, limit=True)
    np.testing.assert_array_equal(V, before[0])
    np.testing.assert_array_equal(F, before[1])
    assert found.faces is F and found.vertices.flags.writeable and not np.shares_memory(found.vertices, V)


@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_every_method_finds_the_control_mesh(method: str, sphere: ll.Mesh) -> None:
    V, F = sphere
    found = ll.interpolate(V, F, method=method)
    assert found.converged and found.status == "converged" and found.method == ("chebyshev" if method == "auto" else method)
    np.testing.assert_allclose(ll.limit(found.vertices, F), V, atol=1.01 * found.tolerance + 1e-15)
    assert found.history.shape[1] == 3 and found.history[0, 0] == 0 and found.history[-1, 0] == found.iterations
    distances = np.linalg.norm(ll.limit(found.vertices, F) - V, axis=1)
    np.testing.assert_allclose([found.max_error, found.mean_error], [distances.max(), distances.mean()], atol=1e-14)
    assert found.seconds >= found.setup_seconds >= 0


def test_names_are_forgiving(sphere: ll.Mesh) -> None:
    assert ll.interpolate(*sphere, "Catmull_Clark", method="Gauss Seidel").method == "gauss-seidel"
    assert ll.interpolate(*sphere, method="two_phase").method == "two-phase"
    with pytest.raises(ValueError, match="perhaps cholesky"):
        ll.interpolate(*sphere, method="cholesk")


def test_tolerances_are_relative_or_absolute(sphere: ll.Mesh) -> None:
    V, F = sphere
    diagonal = np.linalg.norm(np.ptp(V, axis=0))
    for options, allowed in (({"tol": 1e-4}, 1e-4 * diagonal), ({"atol": 1e-3}, 1e-3)):
        found = ll.interpolate(V, F, method="pia", **options)
        np.testing.assert_allclose(found.tolerance, allowed, rtol=1e-12)
        assert found.history[-1, 1] <= allowed < found.history[-2, 1]
    for wrong in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="tol"):
            ll.interpolate(V, F, tol=wrong)


def test_points_of_any_size_and_place(sphere: ll.Mesh) -> None:
    V, F = sphere
    plain = ll.interpolate(V, F)
    for scale, shift in ((1e200, 0.0), (1e-200, 0.0), (1.0, 1e9)):
        found = ll.interpolate(scale * V + shift, F)
        assert found.converged
        np.testing.assert_allclose((found.vertices - shift) / scale, plain.vertices, atol=1e-6)
        np.testing.assert_allclose(found.tolerance, scale * plain.tolerance, rtol=1e-6)
    system = ll.assemble(V, F)
    np.testing.assert_allclose(system.solve(1e-200 * V, method="cg").vertices, 1e-200 * plain.vertices, atol=1e-208)


def test_open_and_creased_meshes(sheet: ll.Mesh) -> None:
    V, F = sheet
    for boundary in ("edge-and-corner", "edge-only"):
        found = ll.interpolate(V, F, boundary=boundary)
        np.testing.assert_allclose(ll.limit(found.vertices, F, boundary=boundary), V, atol=2 * found.tolerance)
    with pytest.raises(ll.MeshError, match="boundary edge"):
        ll.interpolate(V, F, boundary="refuse")
    triangles = np.concatenate([F[:, :3], F[:, [0, 2, 3]]])
    assert ll.interpolate(V, triangles, "loop", boundary="as-interior", method="lu").converged


@pytest.mark.parametrize("form", ["edges", "pair", "rows", "angle"])
def test_creases_and_corners_in_every_form(form: str) -> None:
    V, F = ll.mesh("cube")
    sharp = edges(F)
    tags: dict[str, Any] = {
        "edges": {"creases": sharp},
        "pair": {"creases": (sharp, np.full(len(sharp), 10.0))},
        "rows": {"creases": np.column_stack([sharp, np.full(len(sharp), 11.0)])},
        "angle": {"crease_angle": 60},
    }[form]
    # Where all edges are sharp every vertex is a corner, and stays.
    np.testing.assert_array_equal(ll.interpolate(V, F, **tags).vertices, V)
    for corners in ([0, 3], np.array([0, 3]), ([0, 3], 10.0), [[0, 10.0], [3, 10.0]]):
        np.testing.assert_array_equal(ll.assemble(V, F, corners=corners).blocks.corners, [0, 3])


@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_a_mesh_without_smooth_vertices_is_known_at_once(method: str) -> None:
    V, F = ll.mesh("cube")
    np.testing.assert_array_equal(ll.interpolate(V, F, crease_angle=60, method=method).vertices, V)
    if method == "auto":
        assert all(row.status == "converged" for row in ll.compare(V, F, creases=edges(F)))


def test_seams_of_duplicate_vertices_are_told() -> None:
    V, F = ll.mesh("cube")
    # Every face with vertices of its own.
    apart = V[F.ravel()], np.arange(24).reshape(6, 4)
    with pytest.raises(ll.MeshError, match="24 of 24 boundary edges lie on each other"):
        ll.interpolate(*apart)
    np.testing.assert_array_equal(ll.interpolate(*apart, boundary="edge-and-corner").vertices, apart[0])


def test_semi_sharp_edges_differ_from_sharp_ones(sphere: ll.Mesh) -> None:
    V, F = sphere
    edge = edges(F)[:1]
    limits = [ll.limit(V, F, creases=(edge, s)) for s in (0.0, 1.5, 10.0)]
    np.testing.assert_array_equal(limits[0], ll.limit(V, F))
    assert abs(limits[1] - limits[0]).max() > 1e-6 and abs(limits[1] - limits[2]).max() > 1e-6


def test_some_vertices_only(sphere: ll.Mesh) -> None:
    V, F = sphere
    marks = np.zeros(len(V), bool)
    marks[::3] = True
    found = ll.interpolate(V, F, vertices=marks)
    np.testing.assert_array_equal(found.vertices[~marks], V[~marks])
    np.testing.assert_allclose(ll.limit(found.vertices, F)[marks], V[marks], atol=2 * found.tolerance)
    np.testing.assert_array_equal(ll.interpolate(V, F, vertices=np.flatnonzero(marks)).vertices, found.vertices)
    with pytest.raises(ll.ComputationError, match="no vertex"):
        ll.interpolate(V, F, vertices=[])
    for wrong in ([len(V)], [-1]):
        with pytest.raises(ValueError, match="numbered from 0"):
            ll.interpolate(V, F, vertices=wrong)


@pytest.mark.parametrize("scheme", ["catmull-clark", "nasri", "zheng-cai"])
def test_surfaces_with_normals(scheme: str, sphere: ll.Mesh) -> None:
    V, F = sphere
    wanted = V / np.linalg.norm(V, axis=1)[:, None]
    some = np.where(np.arange(len(V))[:, None] % 5 == 0, wanted, np.nan)
    found = ll.interpolate(V, F, scheme, normals=some, subdivide=2, limit=True, surface_normals=True)
    assert found.surface is not None and found.normals_set == len(V[::5])
    if scheme == "catmull-clark":
        # Original vertices keep their numbers, and reach their points.
        np.testing.assert_allclose(found.surface.vertices[: len(V)], V, atol=1e-8)
        np.testing.assert_allclose(found.surface.normals[: len(V) : 5], wanted[::5], atol=1e-7)
        with pytest.raises(ValueError, match="subdivide=2"):
            ll.interpolate(V, F, normals=some)


def test_handles_change_the_surface_and_not_the_points(sphere: ll.Mesh) -> None:
    V, F = sphere
    plain, flat = (ll.interpolate(V, F, "zheng-cai", handles=s, subdivide=1) for s in (1.0, 1.5))
    assert abs(plain.surface.vertices - flat.surface.vertices).max() > 1e-3
    np.testing.assert_array_equal(plain.vertices, flat.vertices)
    each = ll.interpolate(V, F, "zheng-cai", handles=np.full(len(V), 1.5), subdivide=1)
    np.testing.assert_array_equal(each.surface.vertices, flat.surface.vertices)
    with pytest.raises(ValueError, match="zheng-cai or nasri"):
        ll.interpolate(V, F, handles=1.5, subdivide=1)


def test_the_fairest_surface(sphere: ll.Mesh) -> None:
    V, F = sphere
    found = ll.interpolate(V, F, method="halstead")
    assert found.energies and len(found.vertices) == len(ll.subdivide(V, F, levels=2).vertices)
    # Every iterate with its steps, the errors of the limit points beside them.
    seen = []
    again = ll.interpolate(V, F, method="halstead", callback=lambda step: seen.append(step[:3]))
    np.testing.assert_array_equal(found.history, again.history)
    np.testing.assert_array_equal(np.array(seen)[:, 0], np.arange(found.iterations + 1))
    np.testing.assert_array_equal(np.array(seen)[:-1], found.history[:-1])
    assert found.iterations > 5 and found.history[-1, 1] <= found.tolerance < found.history[0, 1]
    assert found.max_error < 1e-12
    np.testing.assert_allclose(ll.limit(found.vertices, found.faces)[: len(V)], V, atol=1e-9)
    heavy = ll.interpolate(V, F, method="halstead", membrane=100.0)
    assert heavy.energies[1] < found.energies[1] and heavy.energies[0] > found.energies[0]
    with pytest.raises(ll.ComputationError, match="membrane"):
        ll.interpolate(V, F, method="halstead", membrane=0.0)


def test_two_phases(sphere: ll.Mesh) -> None:
    V, F = sphere
    found = ll.interpolate(V, F, method="two-phase", ite_max=3, eps=1e-12, subdivide=1)
    assert (found.scheme, found.iterations, found.status) == ("zheng-cai", 3, "max-iterations")
    exact = ll.interpolate(V, F, "zheng-cai")
    assert 0 < abs(found.vertices - exact.vertices).max() < 0.1
    assert len(found.history) == 4 and found.history[3, 1] < found.history[0, 1]


def test_schemes_that_need_no_system() -> None:
    V, F = ll.mesh("icosphere:2", noise=0.1)
    for method in ("butterfly", "labsik-greiner"):
        found = ll.interpolate(V, F, method=method, subdivide=2)
        np.testing.assert_array_equal(found.surface.vertices[: len(V)], V)
    found = ll.interpolate(V, F, alpha=1.0, subdivide=2)
    np.testing.assert_array_equal(found.surface.vertices[: len(V)], V)
    approximated = ll.interpolate(V, F, "sqrt3", alpha=0.0, subdivide=1)
    np.testing.assert_allclose(approximated.surface.vertices, ll.subdivide(V, F, "sqrt3").vertices, atol=1e-14)
    half = ll.interpolate(V, F, alpha=0.0, vertices=[3], limit=True)
    np.testing.assert_allclose(half.surface.vertices[3], V[3], atol=1e-14)


@pytest.mark.parametrize(
    "wishes",
    [
        {"alpha": 1.0},
        {"alpha": 1.0, "subdivide": 1, "scheme": "loop"},
        {"alpha": 1.0, "subdivide": 1, "method": "cg"},
        {"method": "two-phase", "scheme": "loop"},
        {"method": "halstead", "subdivide": 1},
        {"method": "butterfly"},
        {"method": "butterfly", "subdivide": 1, "scheme": "loop"},
        {"method": "cg", "omega": 1.0},
        {"method": "jacobi", "omega": -1.0},
        {"omega": 1.0},
        {"order": "sideways"},
        {"boundary": "open"},
        {"crease_angle": 200},
        {"subdivide": -1},
        {"normal_levels": 0},
        {"handles": np.ones(3)},
        {"vertices": np.ones(3, bool)},
        {"normals": np.ones((3, 3))},
    ],
)
def test_wishes_that_contradict_each_other(wishes: dict[str, Any]) -> None:
    V, F = ll.mesh("icosphere:1")
    with pytest.raises(ValueError):
        ll.interpolate(V, F, **wishes)


def test_omega_and_order_are_taken(sphere: ll.Mesh) -> None:
    V, F = sphere
    count = {omega: ll.interpolate(V, F, method="jacobi", omega=omega).iterations for omega in (0.3, 0.5)}
    assert count[0.5] == ll.interpolate(V, F, method="thall").iterations < count[0.3]
    orders = {order: ll.interpolate(V, F, method="gauss-seidel", order=order).history for order in ("file", "random:7")}
    assert not np.array_equal(*orders.values())


def test_callbacks_see_stop_and_raise(sphere: ll.Mesh) -> None:
    V, F = sphere
    seen: list[ll.Step] = []
    found = ll.interpolate(V, F, method="pia", callback=lambda step: seen.append(step) or step.iteration == 5)
    assert found.status == "stopped" and found.iterations == 5 and not found.converged
    np.testing.assert_array_equal([[*step[:3]] for step in seen], found.history)
    assert {step.method for step in seen} == {"pia"}
    solvers: list[Callable[..., Any]] = [
        lambda **kw: ll.interpolate(V, F, method="cg", **kw),
        lambda **kw: ll.interpolate(V, F, **kw),
        lambda **kw: ll.interpolate(V, F, method="two-phase", **kw),
        lambda **kw: ll.assemble(V, F).solve(method="sor", **kw),
        lambda **kw: ll.assemble(V, F).solve(x0=V, **kw),
        lambda **kw: ll.Interpolator(F).solve(V, **kw),
        lambda **kw: ll.compare(V, F, methods=["pia"], **kw),
    ]
    for solver in solvers:
        with pytest.raises(ZeroDivisionError):
            solver(callback=lambda step: 1 / 0)


def test_no_solution_is_an_exception_with_what_there_is() -> None:
    V, F = ll.mesh("cube", noise=0.1)
    with pytest.raises(ll.ConvergenceError, match="no control mesh reaches") as caught:
        ll.interpolate(V, F, "catmull-clark")
    assert caught.value.solution.status != "converged" and "nasri" in str(caught.value)
    found = ll.interpolate(V, F, "catmull-clark", method="lu", check=False)
    assert found.status == "singular" and found.detail
    with pytest.raises(ll.ConvergenceError):
        found.raise_for_status()
    with pytest.raises(ll.ConvergenceError, match="raise max_iter"):
        ll.interpolate(*ll.mesh("quad-sphere:3", noise=0.1), method="pia", max_iter=3)


def test_defects_are_data() -> None:
    V, F = ll.mesh("cube")
    with pytest.raises(ll.MeshError) as caught:
        ll.interpolate(V, np.vstack([F, F[:1]]))
    assert {"non-manifold-edge", "inconsistent-orientation"} & {defect["kind"] for defect in caught.value.defects}
    with pytest.raises(ll.MeshError) as caught:
        ll.interpolate(V, F + 1)
    assert caught.value.defects[0] == {"kind": "index-out-of-range", "face": 1, "vertex": 8, "count": 8}
    with pytest.raises(ll.MeshError, match="triangles only") as caught:
        ll.interpolate(V, F, "loop")
    assert caught.value.defects == [{"kind": "not-a-triangle", "face": 0}]
    with pytest.raises(ll.MeshError, match="finite"):
        ll.interpolate(V * np.nan, F)
    with pytest.raises(ll.MeshError, match="does not exist"):
        ll.interpolate(V, F, creases=[[0, 7]])
    with pytest.raises(ll.MeshError, match="does not exist"):
        ll.interpolate(V, F, corners=[8])


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda V, F: (V[:, :2], F), ValueError),
        (lambda V, F: (V.ravel(), F), ValueError),
        (lambda V, F: (V, F - 1), ValueError),
        (lambda V, F: (V, F.astype(float)), TypeError),
        (lambda V, F: (V, F.ravel()), ValueError),
        (lambda V, F: (V, (F.ravel(), [0, 8, 4, 24])), ValueError),
        (lambda V, F: (V, (F.ravel(), [4, 24])), ValueError),
        (lambda V, F: (V, (F.ravel(), [0, 30])), ValueError),
        (lambda V, F: (V, np.zeros((0, 4), int)), ll.MeshError),
        (lambda V, F: (V, []), ll.MeshError),
        (lambda V, F: (V, F[:, :2]), ll.MeshError),
        (lambda V, F: (np.zeros((0, 3)), F), ll.MeshError),
        (lambda V, F: (V, np.uint64(2**64 - 1) * np.ones((1, 4), np.uint64)), ValueError),
        (lambda V, F: (V, np.full((1, 4), 2**40)), ValueError),
        (lambda V, F: (V, [[0, 1, 2], ["a", 1, 2]]), (TypeError, ValueError)),
        (lambda V, F: (["x"], F), ValueError),
    ],
)
def test_arrays_that_are_no_mesh(change: Callable[..., Any], error: type[Exception]) -> None:
    V, F = ll.mesh("cube")
    V, F = change(V, F)
    for function in (ll.interpolate, ll.assemble, ll.subdivide, ll.limit, ll.normals):
        with pytest.raises(error):
            function(V, F, "catmull-clark")


def test_an_interpolator_goes_on_from_where_it_is(sphere: ll.Mesh, sheet: ll.Mesh) -> None:
    for V, F in (sphere, sheet):
        interpolator = ll.Interpolator(F, "catmull-clark")
        out = np.empty_like(V)
        cold = interpolator.solve(V, out=out)
        assert cold.vertices is out and cold.converged
        expected = ll.interpolate(V, F).vertices
        np.testing.assert_allclose(out, expected, atol=1e-8)
        moved = V.copy()
        moved[3] += 0.01
        warm = interpolator.solve(moved, out=out)
        assert warm.iterations < cold.iterations
        np.testing.assert_allclose(ll.limit(out, F), moved, atol=2 * warm.tolerance)
        assert interpolator.solve(V, warm=False).iterations == cold.iterations
        # Of another size, and so in another frame.
        tiny = interpolator.solve(1e-200 * V)
        np.testing.assert_allclose(1e200 * tiny.vertices, expected, atol=1e-8)
    with pytest.raises(ValueError, match="part of P"):
        interpolator.solve(V, out=V)
    with pytest.raises(ValueError, match="finite"):
        interpolator.solve(V * np.inf)
    with pytest.raises(ValueError, match="entries"):
        interpolator.solve(V[:-1])
    some = ll.Interpolator(F, points=V, vertices=[0, 1, 2])
    np.testing.assert_array_equal(some.solve(V).vertices[4:], V[4:])
    assert len(some) == len(V) and "catmull-clark" in repr(some)


def test_other_threads_run_meanwhile() -> None:
    V, F = ll.mesh("torus:300x300", noise=0.1)
    system = ll.assemble(V, F)
    done, ticks = threading.Event(), 0

    def work() -> None:
        system.solve(method="pia", tol=1e-12)
        done.set()

    thread = threading.Thread(target=work)
    begin = time.perf_counter()
    thread.start()
    while not done.is_set():
        ticks += 1
        time.sleep(1e-3)
    thread.join()
    assert ticks > 20 * (time.perf_counter() - begin)


def test_several_threads_share_a_system_and_an_interpolator(sphere: ll.Mesh) -> None:
    V, F = sphere
    system, interpolator = ll.assemble(V, F), ll.Interpolator(F)
    exact = system.solve(method="lu").vertices
    found: list[np.ndarray] = []

    def work() -> None:
        for _ in range(5):
            found.append(system.solve(method="cg", callback=lambda step: None).vertices)
            found.append(interpolator.solve(V, callback=lambda step: None).vertices)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 40
    for vertices in found:
        np.testing.assert_allclose(vertices, exact, atol=1e-8)


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
@pytest.mark.parametrize("run", ["interpolate", "system", "own"])
def test_ctrl_c_ends_a_long_run(run: str) -> None:
    V, F = ll.mesh("torus:150x150", noise=0.1)

    def forever(A: Any, h: Any, P: Any) -> Any:
        V = P.copy()
        while True:
            V += 1e-4 * (P - A @ V)
            yield V

    def long() -> None:
        # Far below rounding, and so until stagnation or for ever.
        options = {"method": "jacobi", "omega": 1e-4, "max_iter": 10**9}
        if run == "interpolate":
            ll.interpolate(V, F, **options)
        elif run == "system":
            ll.assemble(V, F).solve(**options)
        else:
            ll.compare(V, F, methods=[forever], max_iter=10**9)

    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            long()
    finally:
        timer.cancel()
        timer.join()


def test_files_come_back_as_they_were(tmp_path: pathlib.Path, sheet: ll.Mesh) -> None:
    V, F = sheet
    sharp = edges(F)[5:9]
    for ending in ("obj", "off", "ply", "usda"):
        path = tmp_path / f"mesh.{ending}"
        ll.write(path, V, F, creases=(sharp, 3.5), corners=[7], boundary="edge-only", scheme="catmull-clark", comments=["made"])
        found = ll.read(path)
        np.testing.assert_array_equal(found.faces, F)
        if ending == "usda":
            np.testing.assert_allclose(found.vertices, V, rtol=1e-8)
        else:
            np.testing.assert_array_equal(found.vertices, V)
        assert (found.creases is None) == (ending in ("off", "ply"))
        if found.creases:
            np.testing.assert_array_equal(np.sort(found.creases[0], axis=1), np.sort(sharp, axis=1))
            np.testing.assert_array_equal(found.creases[1], 3.5)
            np.testing.assert_array_equal(found.corners[0], [7])
            # What was read goes on as arguments.
            tagged = ll.limit(*found, "catmull-clark", **found.tags)
            expected = ll.limit(V, F, "catmull-clark", creases=(sharp, 3.5), corners=[7], boundary=found.boundary)
            np.testing.assert_allclose(tagged, expected, atol=1e-7)
        if ending == "usda":
            assert found.tags["boundary"] == "edge-only"
    ll.write(tmp_path / "normals.ply", V, F, normals=V)
    np.testing.assert_array_equal(ll.read(tmp_path / "normals.ply").normals, V)


def test_files_that_cannot_be(tmp_path: pathlib.Path) -> None:
    V, F = ll.mesh("cube")
    with pytest.raises(FileNotFoundError) as caught:
        ll.read(tmp_path / "nothing.obj")
    assert caught.value.filename == str(tmp_path / "nothing.obj")
    with pytest.raises(FileNotFoundError):
        ll.write(tmp_path / "no" / "mesh.obj", V, F)
    (tmp_path / "bad.obj").write_text("v 0 0 0\nv 1 x 0\n")
    with pytest.raises(ll.FormatError, match="line 2") as format_error:
        ll.read(tmp_path / "bad.obj")
    assert format_error.value.line == 2 and format_error.value.filename.endswith("bad.obj")
    for wrong in ({"comments": ["a\nb"]}, {"normals": V[:3]}, {"corners": [8]}, {"boundary": "open"}, {"scheme": "chaikin"}):
        with pytest.raises(ValueError):
            ll.write(tmp_path / "mesh.obj", V, F, **wrong)
    with pytest.raises(ValueError, match="vertex 8"):
        ll.write(tmp_path / "mesh.obj", V, F + 1)
    with pytest.raises(ll.FormatError, match="name must end"):
        ll.read(tmp_path / "mesh.3ds")
    with pytest.raises(ValueError, match="torus"):
        ll.mesh("bagel")
    with pytest.raises(ValueError, match="noise"):
        ll.mesh("cube", noise=-1)


def test_triangles_of_stl_are_joined(tmp_path: pathlib.Path) -> None:
    V, F = ll.mesh("icosphere:1")
    facets = ["facet normal 0 0 0 outer loop " + " ".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in V[f].tolist()) for f in F]
    (tmp_path / "ball.stl").write_text(
        "solid ball\n" + "\n".join(f + " endloop endfacet" for f in facets) + "\nendsolid ball\n"
    )
    found = ll.read(tmp_path / "ball.stl")
    assert len(found.vertices) == len(V)
    np.testing.assert_array_equal(found.vertices[found.faces], V[F])


def test_refinement_of_meshes(sheet: ll.Mesh) -> None:
    V, F = sheet
    fine = ll.subdivide(V, F, levels=2)
    assert len(fine.faces) == 16 * len(F) and fine.boundary == "edge-and-corner"
    assert len(ll.subdivide(V, F, "doo-sabin").vertices) > len(V)
    # Limit points of the refined mesh are limit points.
    control = ll.interpolate(V, F).vertices
    np.testing.assert_allclose(ll.limit(*ll.subdivide(control, F), boundary="edge-and-corner")[: len(V)], V, atol=1e-8)
    flat = np.column_stack([V[:, :2], np.zeros(len(V))])
    found = ll.normals(*ll.mesh("quad-sphere:3"))
    sphere = ll.mesh("quad-sphere:3").vertices
    assert np.all(np.sum(found * sphere, axis=1) > 0.99) and flat.shape == V.shape
    with pytest.raises(ValueError, match="levels"):
        ll.subdivide(V, F, levels=-1)
    with pytest.raises(MemoryError, match="fewer levels"):
        ll.subdivide(V, F, levels=30)


def test_pictures_and_tables(sphere: ll.Mesh) -> None:
    found = ll.interpolate(*sphere, method="pia")
    assert found.to_pandas().shape == (found.iterations + 1, 2)
    axes = found.plot()
    np.testing.assert_array_equal(axes.lines[0].get_xdata(), found.history[:, 0])
    assert "converged after" in repr(found) and found.scheme in repr(found)
