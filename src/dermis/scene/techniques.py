"""Registry of techniques for subsurface scattering."""

from __future__ import annotations

from typing import Any

from dermis.base.registry import Registry

_TECHNIQUE_PACKAGE = "dermis.frame.techniques"

TECHNIQUES: Registry[Any] = Registry("technique")
for _name, _summary in {
    "none": "no scattering",
    "one-blur": "a single blur of the light map",
    "gpu-gems-3": "the original passes of 2007",
    "texture-space": "blurs of irradiance in the atlas",
    "screen-space": "blurs in the picture, as in game engines",
    "pre-integrated": "tables by curvature, as in game engines",
}.items():
    TECHNIQUES.register(_name, f"{_TECHNIQUE_PACKAGE}.{_name.replace('-', '_')}:TECHNIQUE", _summary)
