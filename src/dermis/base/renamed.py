"""Renamed objects and modules, whose old names keep working for one release, with a warning.

To rename a public name or a module, add it to `RENAMED_OBJECTS` or `RENAMED_MODULES`; remove the entry one
release later.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, ParamSpec, TypeVar, cast

RENAMED_OBJECTS: Mapping[str, str] = {
    "profile": "side",
    "scene.profile": "scene.side",
    "frame.lights.kind.Kind": "frame.lights.kind.LightKind",
    "specular.models.Model": "specular.models.SpecularModel",
    "apps.truths.lights.CYCLES": "apps.truths.lights.CYCLES_LIGHTS",
    "apps.truths.lights.MITSUBA": "apps.truths.lights.MITSUBA_LIGHTS",
    "apps.inverse.unmixing.unmix.Change": "apps.inverse.unmixing.unmix.PigmentChange",
    "apps.inverse.unmixing.unmix.Share": "apps.inverse.unmixing.unmix.FractionChange",
    "scene.smoothness.SmoothIn": "scene.smoothness.SmoothOutlineLevels",
}
"""Dictionary from the old to the new name of each renamed object, without the package's name."""

RENAMED_MODULES: Mapping[str, str] = {
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
    "scene.talk": "scene.talk_comparisons",
    "unmixing": "apps.inverse.unmixing",
    "unmixing.change": "apps.inverse.unmixing.unmix",
    "viewer": "apps.viewer",
}
"""Dictionary from the old to the new path of each renamed module or package, without the package's name."""

P = ParamSpec("P")
R = TypeVar("R")
_PACKAGE_NAME = __name__.partition(".")[0]
_REMOVAL_NOTICE = "the old name will be removed in the next release"


def successor(module_name: str, old_name: str) -> str | None:
    """Return the new name of a renamed object and issue a DeprecationWarning; None for any other name.

    module_name : module of the object
    old_name : old name of the object
    """
    old = f"{module_name}.{old_name}".removeprefix(f"{_PACKAGE_NAME}.")
    if old not in RENAMED_OBJECTS:
        return None
    _warn_renamed(old, RENAMED_OBJECTS[old], stacklevel=4)
    return RENAMED_OBJECTS[old].rpartition(".")[2]


def renamed_keywords(**new_names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator that lets a function accept the old names of keyword arguments, with a warning.

    new_names : new name of each argument, passed as old_name="new_name"
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def with_new_names(*args: P.args, **kwargs: P.kwargs) -> R:
            for old, new in new_names.items():
                if old in kwargs:
                    text = f"{function.__qualname__}: {old} is now {new}"
                    warnings.warn(f"{text}; {_REMOVAL_NOTICE}", DeprecationWarning, stacklevel=2)
                    kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return with_new_names

    return decorate


def renamed_attribute(old_name: str, new_name: str) -> property:
    """Return a property for the old name of an attribute; it warns and returns the renamed attribute."""

    def get_renamed_attribute(instance: Any) -> Any:
        text = f"{type(instance).__name__}.{old_name} is now {new_name}"
        warnings.warn(f"{text}; {_REMOVAL_NOTICE}", DeprecationWarning, stacklevel=2)
        return getattr(instance, new_name)

    return property(get_renamed_attribute)


def renamed_classmethod(old_name: str, new_name: str) -> classmethod[Any, ..., Any]:
    """Return a class method for the old name of a class method; it warns and calls the renamed method."""

    def call(cls: type[Any], *args: Any, **kwargs: Any) -> Any:
        text = f"{cls.__name__}.{old_name} is now {new_name}"
        warnings.warn(f"{text}; {_REMOVAL_NOTICE}", DeprecationWarning, stacklevel=2)
        return getattr(cls, new_name)(*args, **kwargs)

    return classmethod(call)


def install_renamed_module_finder() -> None:
    """Install an import hook, so that renamed modules can be imported by their old paths."""
    sys.meta_path.insert(0, _RenamedModuleFinder())


class _RenamedModuleFinder:
    """Import hook that finds a renamed module by its old path and imports the module from the new path."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(fullname, cast(Any, self)) if _new_module_path(fullname) else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Let the import system create a module, which `exec_module` then replaces by the renamed module."""

    def exec_module(self, module: ModuleType) -> None:
        old = module.__name__
        new = _new_module_path(old)
        assert new is not None
        sys.modules[old] = import_module(f"{_PACKAGE_NAME}.{new}")
        _warn_renamed(old.removeprefix(f"{_PACKAGE_NAME}."), new, stacklevel=3)


def _new_module_path(fullname: str) -> str | None:
    """Return the new path of a renamed module, without the package's name; None for other modules.

    fullname : old path of the module, with the package's name
    """
    package, _, path = fullname.partition(".")
    if package != _PACKAGE_NAME:
        return None
    for old in sorted(RENAMED_MODULES, reverse=True):  # longer paths first
        if path == old or path.startswith(f"{old}."):
            return RENAMED_MODULES[old] + path[len(old) :]
    return None


def _warn_renamed(old_name: str, new_name: str, stacklevel: int) -> None:
    text = f"{_PACKAGE_NAME}.{old_name} is now {_PACKAGE_NAME}.{new_name}"
    warnings.warn(f"{text}; {_REMOVAL_NOTICE}", DeprecationWarning, stacklevel)
