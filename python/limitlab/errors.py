"""Exceptions of this package. A missing file is Python's own `FileNotFoundError`, a lack of memory its `MemoryError`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .solving import Solution

__all__ = ["ComputationError", "ConvergenceError", "FormatError", "MeshError"]


class MeshError(ValueError):
    """A mesh that cannot be used: defects, boundaries, faces that a scheme is not defined on, creases of no edge.

    Attributes
    ----------
    defects
        One dictionary a defect: its `kind`, and what it is at: `face`, `vertex`, `other_vertex`, `count`, …, numbered from 0.
        Empty where the error is not at a place.
    report
        All that the validator found, where it was the validator: `defects`, `counts`, `orientation`, `remarks`.
    """

    def __init__(self, message: str, report: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.report: dict[str, Any] = report or {}
        self.defects: list[dict[str, Any]] = list(self.report.get("defects", []))


class FormatError(ValueError):
    """A file that is not what its format says.

    Attributes
    ----------
    filename
        The file.
    line
        Where, from 1; `None` where the place is no line.
    """

    def __init__(self, message: str, filename: str, line: int | None) -> None:
        super().__init__(message)
        self.filename = filename
        self.line = line


class ComputationError(RuntimeError):
    """A computation that has no result to give."""


class ConvergenceError(RuntimeError):
    """A run that ended without a solution.

    Attributes
    ----------
    solution
        What it came to, with its status and its history.
    """

    def __init__(self, message: str, solution: Solution) -> None:
        super().__init__(message)
        self.solution = solution
