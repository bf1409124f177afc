"""Meshes that several tests use."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest

import limitlab as ll

matplotlib.use("agg")


@pytest.fixture
def sphere() -> ll.Mesh:
    """A closed mesh of quads, with noise."""
    return ll.mesh("quad-sphere:3", noise=0.1)


@pytest.fixture
def sheet() -> ll.Mesh:
    """An open mesh: a torus of quads without those at one vertex."""
    V, F = ll.mesh("torus:8x7", noise=0.1)
    kept = F[~np.any(F == 20, axis=1)]
    number = np.cumsum(np.arange(len(V)) != 20) - 1
    return ll.Mesh(np.delete(V, 20, axis=0), number[kept].astype(np.int32))


def edges(F: np.ndarray) -> np.ndarray:
    """All edges, each in the direction of one of its faces."""
    sides = np.stack([F, np.roll(F, -1, axis=1)], axis=2).reshape(-1, 2)
    return sides[np.unique(np.sort(sides, axis=1), axis=0, return_index=True)[1]]
