"""Pictures with matplotlib, which is imported when one is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import Floats

if TYPE_CHECKING:
    from .analysis import OmegaSweep, Spectrum

__all__: list[str] = []


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def histories(runs: Iterable[tuple[str, Floats, str]], ax: Any = None) -> Any:
    """Maximum errors over iterations; an open end where a run did not converge."""
    ax = _axes(ax)
    lines = ["-", "--", "-.", ":"]
    for k, (name, history, status) in enumerate(runs):
        errors = np.where(history[:, 1] > 0, history[:, 1], np.nan)
        end = {} if status == "converged" else {"marker": ">", "markevery": [len(history) - 1]}
        ax.semilogy(history[:, 0], errors, label=name, linestyle=lines[k // 10 % len(lines)], **end)
    ax.set_xlabel("iterations")
    ax.set_ylabel("max error")
    if ax.get_legend_handles_labels()[1]:
        ax.legend(fontsize="small")
    return ax


def sweep(found: OmegaSweep, ax: Any = None) -> Any:
    """Predicted rates as lines, observed ones as dots."""
    ax = _axes(ax)
    for k, method in enumerate(dict.fromkeys(row.method for row in found.rows)):
        rows = found.of(method)
        omegas = [row.omega for row in rows]
        ax.plot(omegas, [row.predicted_rho for row in rows], color=f"C{k}", label=method)
        seen = [(row.omega, row.observed_rate) for row in rows if row.observed_rate is not None]
        if seen:
            ax.plot(*zip(*seen, strict=True), "o", color=f"C{k}", markersize=4)
    ax.axhline(1.0, color="0.6", linewidth=1)
    ax.set_xlabel("ω")
    ax.set_ylabel("factor per iteration")
    ax.set_title("lines: predicted, dots: observed", fontsize="medium")
    ax.legend()
    return ax


def eigenvalues(found: Spectrum, ax: Any = None) -> Any:
    """How many eigenvalues of A lie where, with the proven bounds, or the complex plane."""
    if found.eigenvalues is None:
        raise ValueError("not all eigenvalues are known: ask for full=True")
    ax = _axes(ax)
    if np.iscomplexobj(found.eigenvalues):
        ax.plot(found.eigenvalues.real, found.eigenvalues.imag, ".")
        ax.set_ylabel("imaginary part")
    else:
        ax.hist(found.eigenvalues, bins=60)
        ax.axvline(found.bounds.lambda_min, color="C1", label="proven bounds")
        ax.axvline(found.bounds.lambda_max, color="C1")
        ax.set_ylabel("eigenvalues")
        ax.legend()
    ax.set_xlabel("eigenvalue of A")
    return ax
