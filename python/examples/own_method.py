"""A method of one's own beside those of the library: the same start, norm, tolerance, table and plot.

python own_method.py [OUT]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import limitlab


def nesterov(A, h, P):
    """PIA with Nesterov's momentum, restarted where it points uphill."""
    V, before, k = P.copy(), P.copy(), 0
    while True:
        ahead = V + k / (k + 3) * (V - before)
        step = P - A @ ahead
        before, V = V, ahead + step
        # In the inner product that A is symmetric in.
        uphill = np.sum((step * (V - before)) / h[:, None]) < 0
        k = 0 if uphill else k + 1
        yield V


def every_other(A, h, P):
    """Jacobi that relaxes even and odd vertices in turn."""
    V, diagonal = P.copy(), A.diagonal()[:, None]
    while True:
        for half in (slice(0, None, 2), slice(1, None, 2)):
            V[half] += (P[half] - A[half] @ V) / diagonal[half]
        yield V


out = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
V, F = limitlab.mesh("irregular-quad:1000", noise=0.1)
ours = ["jacobi", "gauss-seidel", "pia", "w-pia", "chebyshev", "cg"]
rows = limitlab.compare(V, F, "catmull-clark", methods=[*ours, nesterov, ("every other", every_other)])
print(rows)
axes = rows.plot()
axes.figure.savefig(out / "own-method.png", dpi=120)
plt.close(axes.figure)
