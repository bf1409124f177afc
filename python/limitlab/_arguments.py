"""Whatever people have for points, faces, creases and marks, as the few arrays that the extension takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _limitlab

__all__: list[str] = []

Floats: TypeAlias = NDArray[np.float64]
"""Doubles."""
Faces: TypeAlias = ArrayLike | tuple[ArrayLike, ArrayLike] | Sequence[Sequence[int]]
"""Faces: an (m, k) array of integers, a pair (corners, offsets), or a list of lists."""
Tagged: TypeAlias = ArrayLike | tuple[ArrayLike, ArrayLike]
"""Creases or corners: vertices alone, which are sharp for ever, or vertices and sharpness."""
Parts: TypeAlias = tuple[NDArray[np.integer[Any]], int, NDArray[np.int64] | None]

SHARP = 10.0
"""From this sharpness on, an edge or a vertex is sharp at every level of refinement."""


def points(given: ArrayLike, name: str = "V") -> Floats:
    """(n, 3) doubles, contiguous; the array itself if it is that."""
    array = np.asarray(given, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} has the shape {array.shape}: (n, 3) is needed")
    return np.ascontiguousarray(array)


def _integers(array: NDArray[Any], name: str) -> NDArray[np.integer[Any]]:
    """int32 or int64, contiguous, without a copy where the bits are the same."""
    if array.dtype.kind not in "iu":
        if array.size:
            raise TypeError(f"{name} are integers, not {array.dtype}")
        array = array.astype(np.int64)
    array = np.ascontiguousarray(array)
    if not array.dtype.isnative or array.dtype.itemsize < 4:
        return array.astype(np.int64)
    # Unsigned numbers beyond the signed ones become negative, which no index is.
    return array.view(np.int32 if array.dtype.itemsize == 4 else np.int64)


def faces(given: Faces) -> Parts:
    """Corners, and the size of all faces or the offset of each."""
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1 and np.ndim(given[1]) == 1:
        corners = _integers(np.asarray(given[0]), "the corners of faces")
        offsets = _integers(np.asarray(given[1]), "the offsets of faces").astype(np.int64)
        # Blender's loop_start lacks the end.
        if not len(offsets) or offsets[-1] < len(corners):
            offsets = np.append(offsets, len(corners))
        return corners, 0, offsets
    if not isinstance(given, np.ndarray):
        lists = list(given)  # type: ignore[arg-type]
        sizes = {np.size(face) for face in lists}
        if len(sizes) != 1:
            flat = [np.asarray(face).ravel() for face in lists]
            corners = np.concatenate(flat) if flat else np.empty(0, np.int64)
            offsets = np.concatenate([[0], np.cumsum([len(face) for face in flat], dtype=np.int64)])
            return _integers(corners, "faces"), 0, offsets.astype(np.int64)
        given = np.asarray(lists)
    if given.ndim != 2 or given.shape[1] == 0:
        raise ValueError(f"faces have the shape {given.shape}: (m, k) is needed, or a pair (corners, offsets), or lists")
    return _integers(given, "faces").reshape(-1), given.shape[1], None


def of_parts(corners: NDArray[np.int32], second: int | NDArray[np.int32]) -> Any:
    """Faces as the extension has them: (m, k), or (corners, offsets) where sizes differ."""
    if isinstance(second, int):
        return corners.reshape(-1, second)
    return corners, second


def _with_sharpness(given: Tagged, width: int, name: str) -> tuple[NDArray[np.int64], Floats]:
    sharpness: Any = SHARP
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == width:
        given, sharpness = given
    array = np.asarray(given)
    if array.ndim == 2 and array.shape[1] == width + 1:
        array, sharpness = array[:, :width], array[:, width]
        if not np.all(array == np.trunc(array)):
            raise ValueError(f"{name}: vertices are whole numbers")
        array = array.astype(np.int64)
    array = array.reshape(-1, width)
    whole = _integers(array, f"the vertices of {name}").astype(np.int64)
    filled = np.broadcast_to(np.asarray(sharpness, dtype=np.float64), (len(whole),))
    return np.ascontiguousarray(whole), np.ascontiguousarray(filled)


def creases(given: Tagged | None) -> tuple[NDArray[np.int64], Floats] | None:
    """(k, 2) edges and their sharpness."""
    return None if given is None else _with_sharpness(given, 2, "creases")


def corners(given: Tagged | None) -> tuple[NDArray[np.int64], Floats] | None:
    """Vertices and their sharpness."""
    if given is None:
        return None
    vertices, sharpness = _with_sharpness(given, 1, "corners")
    return vertices.reshape(-1), sharpness


def marks(given: ArrayLike | None, n: int) -> NDArray[np.bool_] | None:
    """One mark a vertex, of marks or of the numbers of vertices."""
    if given is None:
        return None
    array = np.asarray(given)
    if array.dtype == np.bool_:
        return np.ascontiguousarray(array)
    numbers = _integers(array.reshape(-1), "vertices")
    if len(numbers) and (numbers.min() < 0 or numbers.max() >= n):
        raise ValueError(f"vertices are numbered from 0 to {n - 1}")
    found = np.zeros(n, dtype=np.bool_)
    found[numbers] = True
    return found


def numbers(given: ArrayLike | None) -> Floats | None:
    """One number a vertex, or one for all."""
    return None if given is None else np.atleast_1d(np.asarray(given, dtype=np.float64))


def surface(
    V: ArrayLike | None,
    F: Faces,
    boundary: str | None = None,
    creased: Tagged | None = None,
    cornered: Tagged | None = None,
    crease_angle: float | None = None,
) -> _limitlab.Surface:
    """A valid mesh."""
    given = None if V is None else points(V)
    return _limitlab.Surface(given, faces(F), boundary, creases(creased), corners(cornered), crease_angle)


def asked(
    method: str = "auto",
    omega: float | None = None,
    order: str = "file",
    tol: float = 1e-10,
    atol: float | None = None,
    max_iter: int = 10_000,
    callback: Callable[..., Any] | None = None,
) -> dict[str, Any]:
    """What is asked of a solution."""
    return {
        "method": method,
        "omega": omega,
        "order": order,
        "tol": tol,
        "atol": atol,
        "max_iter": max_iter,
        "callback": callback,
    }
