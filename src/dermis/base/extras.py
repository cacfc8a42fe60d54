"""Optional dependencies, and the extras of this package that install them."""

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
    "pi_heif": "formats",
    "DracoPy": "formats",
}
"""Name of the extra that installs each optional module."""
_DISTRIBUTION_OF_MODULE = {"pxr": "usd-core"}  # distributions with other names than their modules


def import_extra(module_name: str, task_noun: str) -> Any:
    """Import and return a module of an optional dependency that is listed in `EXTRAS`.

    task_noun : task that needs the module, as a noun phrase for the error, such as "writing MaterialX"

    Raises DermisError when the dependency is not installed.
    """
    package = module_name.partition(".")[0]
    try:
        return import_module(module_name)
    except ImportError as fault:
        advice = (
            f'Install it: pip install "dermis[{EXTRAS[package]}]", or -e ".[{EXTRAS[package]}]" in a clone'
        )
        name = distribution_name(package)
        refuse(task_noun, f"the package {name}", f"it cannot be imported ({fault})", advice)


def distribution_name(module_name: str) -> str:
    """Return the name on PyPI of the package that contains a module."""
    return _DISTRIBUTION_OF_MODULE.get(module_name, module_name.replace("_", "-"))
