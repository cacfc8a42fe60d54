"""Names of earlier releases, which work for one release more and warn.

To rename a public name or a module, add it to `NAMES` or `MODULES`; remove the entry one release later.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, cast

NAMES: Mapping[str, str] = {
    "profile": "side",
    "scene.profile": "scene.side",
}
"""Old to new names of objects, both without the package's name."""

MODULES: Mapping[str, str] = {
    "batch": "apps.batch",
    "batch.samples": "apps.batch.reader",
    "benchmark": "apps.validation.benchmarks",
    "comparison": "apps.validation.comparisons",
    "errors": "base.errors",
    "export": "apps.export",
    "fitting": "apps.inverse.fitting",
    "frame.outputs": "scene.outputs",
    "gallery": "apps.gallery",
    "reference": "apps.truths",
    "registry": "base.registry",
    "unmixing": "apps.inverse.unmixing",
    "unmixing.change": "apps.inverse.unmixing.unmix",
    "viewer": "apps.viewer",
}
"""Old to new paths of modules and packages, both without the package's name."""

_PACKAGE = __name__.partition(".")[0]


def successor(module: str, name: str) -> str | None:
    """Return the new name of an object of a module, after a DeprecationWarning; None for all other names."""
    old = f"{module}.{name}".removeprefix(f"{_PACKAGE}.")
    if old not in NAMES:
        return None
    _warn(old, NAMES[old], stacklevel=4)
    return NAMES[old].rpartition(".")[2]


def find_renamed_modules() -> None:
    """Let the import system find modules by their old paths."""
    sys.meta_path.insert(0, _Finder())


class _Finder:
    """Import of a module by its old path: the module of the new path, under both names."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(fullname, cast(Any, self)) if _moved(fullname) else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to the import system, whose module `exec_module` replaces."""

    def exec_module(self, module: ModuleType) -> None:
        old = module.__name__
        new = _moved(old)
        assert new is not None
        sys.modules[old] = import_module(f"{_PACKAGE}.{new}")
        _warn(old.removeprefix(f"{_PACKAGE}."), new, stacklevel=3)


def _moved(fullname: str) -> str | None:
    """Return the new path of a module, without the package's name; None for one that is where it was."""
    package, _, path = fullname.partition(".")
    if package != _PACKAGE:
        return None
    for old in sorted(MODULES, reverse=True):  # longer paths first
        if path == old or path.startswith(f"{old}."):
            return MODULES[old] + path[len(old) :]
    return None


def _warn(old: str, new: str, stacklevel: int) -> None:
    text = f"{_PACKAGE}.{old} is now {_PACKAGE}.{new}; the old name goes with the next release"
    warnings.warn(text, DeprecationWarning, stacklevel)
