"""Version of the package."""

from __future__ import annotations

import tomllib
from importlib import metadata
from pathlib import Path

_PROJECT_FILE = Path(__file__).parents[3] / "pyproject.toml"


def version() -> str:
    """Return the version of the installed package; if it is not installed, the version in pyproject.toml."""
    try:
        return metadata.version("dermis")
    except metadata.PackageNotFoundError:
        return str(tomllib.loads(_PROJECT_FILE.read_text("utf-8"))["project"]["version"])
