"""Public names have complete docstrings, and the examples in them run."""

from __future__ import annotations

import doctest
import inspect
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dermis
from dermis.apps.export.target import Target
from dermis.frame.lights.kind import LightKind
from dermis.frame.techniques.technique import Technique
from dermis.scene.outputs import Output
from dermis.specular.models import SpecularModel

PUBLIC = {name: getattr(dermis, name) for name in dermis.__all__}
ENTRIES = {one.__name__: one for one in (Target, LightKind, Technique, Output, SpecularModel)}
"""Types of the entries of registries."""


def sections(thing: Any) -> set[str]:
    """Return the titles of the numpydoc sections of a docstring."""
    lines = (inspect.getdoc(thing) or "").splitlines()
    return {a for a, b in pairwise(lines) if b and set(b) == {"-"}}


@pytest.mark.parametrize("name", sorted(PUBLIC | ENTRIES))
def test_docstrings_have_examples(name: str) -> None:
    assert "Examples" in sections((PUBLIC | ENTRIES)[name])


@pytest.mark.parametrize("name", sorted(n for n, thing in PUBLIC.items() if inspect.isfunction(thing)))
def test_functions_describe_parameters_and_results(name: str) -> None:
    signature = inspect.signature(PUBLIC[name])
    doc, found = inspect.getdoc(PUBLIC[name]) or "", sections(PUBLIC[name])
    assert "Parameters" in found or not signature.parameters
    assert [p for p in signature.parameters if p not in doc] == []
    assert "Returns" in found or signature.return_annotation in (None, "None")


@pytest.mark.parametrize("name", sorted(PUBLIC | ENTRIES))
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = {"dermis": dermis, "np": np}
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    tests = doctest.DocTestFinder(recurse=False).find((PUBLIC | ENTRIES)[name], name, globs=names)
    for test in tests:
        runner.run(test)
    assert runner.summarize(verbose=False).failed == 0 and any(test.examples for test in tests)
