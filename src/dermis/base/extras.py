"""Optional dependencies, and the extras of this package that install them."""

from __future__ import annotations

import sys
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
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
_CHECKOUT = Path(__file__).parents[3]
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
        name = distribution_name(package)
        problem = f"it cannot be imported ({fault})"
        refuse(task_noun, f"the package {name}", problem, extra_advice(EXTRAS[package]))


def extra_advice(extra_name: str) -> str:
    """Return advice to install an extra of this package, as a command for the running interpreter.

    If dermis is installed, pip keeps it and adds the packages of the extra, whether it came from an index, a
    wheel or a checkout. Otherwise the command installs the checkout that contains this module.
    """
    python = sys.executable or "python"
    python = f'"{python}"' if " " in python else python
    command = f"{python} -m pip install" if find_spec("pip") else f"uv pip install --python {python}"
    try:
        metadata.distribution("dermis")
        requirement = f'"dermis[{extra_name}]"'
    except metadata.PackageNotFoundError:
        requirement = f'-e "{_CHECKOUT}[{extra_name}]"'
    return f"Install it: {command} {requirement}"


def distribution_name(module_name: str) -> str:
    """Return the name on PyPI of the package that contains a module."""
    return _DISTRIBUTION_OF_MODULE.get(module_name, module_name.replace("_", "-"))
