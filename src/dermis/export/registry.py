"""Targets by name: each module of `dermis.export.targets` without an underscore in its name."""

from __future__ import annotations

from pkgutil import iter_modules
from typing import TYPE_CHECKING

import dermis.export.targets as home
from dermis.registry import Registry

if TYPE_CHECKING:
    from dermis.export.target import Target

TARGETS: Registry[Target] = Registry(
    "target",
    {
        one.name: f"{home.__name__}.{one.name}:TARGET"
        for one in iter_modules(home.__path__)
        if "_" not in one.name
    },
)
