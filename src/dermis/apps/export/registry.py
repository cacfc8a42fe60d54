"""Registry of export targets, by name; the module of each target defines its instance `TARGET`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dermis.base.registry import Registry

if TYPE_CHECKING:
    from dermis.apps.export.target import Target

_HOME = "dermis.apps.export.targets"
TARGETS: Registry[Target] = Registry(
    "target",
    {
        "arnold": f"{_HOME}.arnold:TARGET",
        "babylon": f"{_HOME}.babylon.target:TARGET",
        "blender": f"{_HOME}.blender.target:TARGET",
        "gltf": f"{_HOME}.gltf.target:TARGET",
        "maps": f"{_HOME}.maps:TARGET",
        "mitsuba": f"{_HOME}.mitsuba.target:TARGET",
        "openpbr": f"{_HOME}.openpbr.target:TARGET",
        "pbrt": f"{_HOME}.pbrt.target:TARGET",
        "renderman": f"{_HOME}.renderman:TARGET",
        "three": f"{_HOME}.three.target:TARGET",
        "unity": f"{_HOME}.unity.target:TARGET",
        "unreal": f"{_HOME}.unreal.target:TARGET",
        "usd": f"{_HOME}.usd.target:TARGET",
        "web": f"{_HOME}.web.target:TARGET",
    },
)
