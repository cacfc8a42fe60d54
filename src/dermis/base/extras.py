"""Packages that only some tasks need, and the extras that bring them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from dermis.base.errors import refuse

EXTRAS = {
    "av": "video",
    "matplotlib": "plots",
    "numba": "truth",
    "mitsuba": "truth",
    "flip_evaluator": "truth",
    "isal": "batch",
    "pyarrow": "batch",
    "webdataset": "batch",
    "distributed": "cluster",
    "pxr": "engines",
    "MaterialX": "engines",
}
"""Extra by module, for those that `needed` is asked for."""
_CALLED = {"pxr": "usd-core"}  # what is called otherwise where it is installed from


def needed(module: str, task: str) -> Any:
    """The module, one of a package in `EXTRAS` or one inside it.

    task : what needs it, for the message

    Raises DermisError when it is not installed.
    """
    package = module.partition(".")[0]
    try:
        return import_module(module)
    except ImportError as fault:
        remedy = f'Install it: pip install "dermis[{EXTRAS[package]}]", or ".[{EXTRAS[package]}]" in a clone'
        name = distribution(package)
        refuse(task, f"the package {name}", f"it cannot be imported ({fault})", remedy)


def distribution(module: str) -> str:
    """What the package of a module is called where it is installed from."""
    return _CALLED.get(module, module.replace("_", "-"))
