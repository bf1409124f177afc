"""Table 1 of the paper on PIA: vertices, passes, largest and mean error at a largest error of 10⁻³.

    python pia_table1.py [OUT [MESH.off …]]

The paper's models may not be redistributed; built-in meshes stand in unless files are named. A pass more than updates are
counted, as the paper counts.
"""

import sys
from pathlib import Path

import limitlab

print(f"{'mesh':24}{'scheme':16}{'vertices':>9}{'passes':>8}{'max error':>12}{'mean error':>12}")
for name in sys.argv[2:] or ["icosphere:3", "torus:32x32", "irregular-quad:1000", "irregular-tri:1000"]:
    V, F = limitlab.read(name) if Path(name).exists() else limitlab.mesh(name, noise=0.1)
    found = limitlab.interpolate(V, F, method="pia", atol=1e-3)
    errors = f"{found.max_error:12.3e}{found.mean_error:12.3e}"
    print(f"{name:24}{found.scheme:16}{len(V):9}{found.iterations + 1:8}{errors}")
