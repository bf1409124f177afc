"""Documentation, stubs and examples are what the package is."""

from __future__ import annotations

import doctest
import importlib
import pathlib
import runpy
import subprocess
import sys
from importlib import metadata

import numpy as np
import pytest

import limitlab as ll

HERE = pathlib.Path(__file__).parent
MODULES = ["limitlab", *(f"limitlab.{name}" for name in ("analysis", "errors", "gallery", "meshes", "plots", "solving"))]
EXAMPLES = sorted((HERE.parent / "examples").glob("*.py"))


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_the_documentation_are_so(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_examples_in_the_readme_are_so() -> None:
    found = doctest.testfile(str(HERE.parent / "README.md"), module_relative=False)
    assert found.failed == 0 and found.attempted > 5


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_gallery_runs(path: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [str(path), str(tmp_path)])
    runpy.run_path(str(path), run_name="__main__")
    pictures = list(tmp_path.iterdir())
    for picture in pictures:
        assert picture.stat().st_size > 5000, picture


def test_what_is_exported_is_documented_and_there() -> None:
    assert len(EXAMPLES) == 5
    for name in ll.__all__:
        assert getattr(ll, name).__doc__ or name == "__version__", name
    assert metadata.version("limitlab") == ll.__version__
    assert {"Requires-Dist", "License-Expression"} <= set(metadata.metadata("limitlab"))


@pytest.mark.parametrize("name", ["matplotlib", "pandas"])
def test_nothing_is_imported_that_is_not_needed(name: str) -> None:
    code = f"import sys, limitlab; sys.exit({name!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_types_and_stubs_hold(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("mypy")
    settings = str(HERE.parent / "pyproject.toml")
    for command in (["mypy", "--config-file", settings, "-p", "limitlab"], ["mypy.stubtest", "limitlab._limitlab"]):
        done = subprocess.run(
            [sys.executable, "-m", *command], check=False, cwd=tmp_path, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr


def test_a_vertex_is_a_row(sphere: ll.Mesh) -> None:
    V, F = sphere
    assert V.dtype == np.float64 and F.dtype == np.int32 and next(iter(sphere)) is V
