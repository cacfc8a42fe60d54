"""Targets by name: each module of `dermis.apps.export.targets` without an underscore in its name."""

from __future__ import annotations

from pkgutil import iter_modules
from typing import TYPE_CHECKING

import dermis.apps.export.targets as home
from dermis.base.registry import Registry

if TYPE_CHECKING:
    from dermis.apps.export.target import Target

TARGETS: Registry[Target] = Registry(
    "target",
    {
        one.name: f"{home.__name__}.{one.name}:TARGET"
        for one in iter_modules(home.__path__)
        if "_" not in one.name
    },
)
