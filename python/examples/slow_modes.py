"""The spectrum of a mesh, and the modes that iterations leave to the end, drawn on it.

    python slow_modes.py [OUT] [--polyscope]

With --polyscope the modes are shown in a window of Polyscope, where that is installed (pip install polyscope).
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import limitlab

names = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
out = Path(names[0] if names else ".")
V, F = limitlab.mesh("irregular-quad:500", noise=0.05)
found = limitlab.spectrum(V, F, "catmull-clark", full=True, modes=3)
print(found)

# Neighbours have opposite signs: each vertex colours the quarters of the faces around it, of which it is the only old vertex.
fine = limitlab.subdivide(V, F)
corner = fine.faces.min(axis=1)
figure = plt.figure(figsize=(12, 3.4), layout="constrained")
found.plot(figure.add_subplot(1, 4, 1))
for k, (value, mode) in enumerate(zip(found.mode_eigenvalues, found.modes.T, strict=True)):
    axes = figure.add_subplot(1, 4, k + 2, projection="3d", box_aspect=np.ptp(V, axis=0))
    colours = plt.get_cmap("coolwarm")(0.5 + 0.5 * mode[corner])
    axes.add_collection3d(Poly3DCollection(fine.vertices[fine.faces], facecolors=colours))
    axes.set(xlim=(V[:, 0].min(), V[:, 0].max()), ylim=(V[:, 1].min(), V[:, 1].max()), zlim=(V[:, 2].min(), V[:, 2].max()))
    # From where it is largest.
    x, y, z = V[np.argmax(abs(mode))] - V.mean(axis=0)
    axes.view_init(np.degrees(np.arctan2(z, np.hypot(x, y))), np.degrees(np.arctan2(y, x)))
    axes.set_title(f"λ = {value:.4f}", y=0.93)
    axes.set_axis_off()
figure.savefig(out / "slow-modes.png", dpi=120)
plt.close(figure)

if "--polyscope" in sys.argv:
    import polyscope

    polyscope.init()
    shown = polyscope.register_surface_mesh("mesh", V, F)
    for value, mode in zip(found.mode_eigenvalues, found.modes.T, strict=True):
        shown.add_scalar_quantity(f"mode of {value:.4f}", mode, cmap="coolwarm")
    polyscope.show()
