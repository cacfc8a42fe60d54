"""Registry of export targets; the module of each target defines the registered object as `TARGET`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dermis.base.registry import Registry

if TYPE_CHECKING:
    from dermis.apps.export.target import Target

_TARGETS_PACKAGE = "dermis.apps.export.targets"
TARGETS: Registry[Target] = Registry(
    "target",
    {
        "arnold": f"{_TARGETS_PACKAGE}.arnold:TARGET",
        "babylon": f"{_TARGETS_PACKAGE}.babylon.target:TARGET",
        "blender": f"{_TARGETS_PACKAGE}.blender.target:TARGET",
        "gltf": f"{_TARGETS_PACKAGE}.gltf.target:TARGET",
        "maps": f"{_TARGETS_PACKAGE}.maps:TARGET",
        "mitsuba": f"{_TARGETS_PACKAGE}.mitsuba.target:TARGET",
        "openpbr": f"{_TARGETS_PACKAGE}.openpbr.target:TARGET",
        "pbrt": f"{_TARGETS_PACKAGE}.pbrt.target:TARGET",
        "renderman": f"{_TARGETS_PACKAGE}.renderman:TARGET",
        "three": f"{_TARGETS_PACKAGE}.three.target:TARGET",
        "unity": f"{_TARGETS_PACKAGE}.unity.target:TARGET",
        "unreal": f"{_TARGETS_PACKAGE}.unreal.target:TARGET",
        "usd": f"{_TARGETS_PACKAGE}.usd.target:TARGET",
        "web": f"{_TARGETS_PACKAGE}.web.target:TARGET",
    },
)
