"""Iterations and rates over ω, observed and predicted.

python omega_sweep.py [OUT]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import limitlab

out = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
V, F = limitlab.mesh("torus:16x16", noise=0.1)
sweep = limitlab.sweep_omega(V, F, "catmull-clark")
print(sweep)
for method, omega in sweep.optimal.items():
    print(f"{method}: best by the spectrum at ω = {omega:.4f}, diverges from {sweep.critical[method]:.4f} on")

figure, (rates, iterations) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
sweep.plot(rates)
rates.set_ylim(0, 1.5)
for method in sweep.best:
    converged = [(row.omega, row.iterations) for row in sweep.of(method) if row.status == "converged"]
    iterations.semilogy(*zip(*converged, strict=True), "o-", markersize=3, label=method)
iterations.set_xlabel("ω")
iterations.set_ylabel("iterations to 10⁻¹⁰ of the diagonal")
iterations.legend()
figure.savefig(out / "omega-sweep.png", dpi=120)
plt.close(figure)
