"""The techniques that scatter light below the skin, by name."""

from __future__ import annotations

from typing import Any

from dermis.base.registry import Registry

_HOME = "dermis.frame.techniques"

TECHNIQUES: Registry[Any] = Registry("technique")
for _name, _summary in {
    "none": "dry skin, without scattering",
    "one-blur": "a single blur of the light map",
    "gpu-gems-3": "the passes of 2007 as they were",
    "texture-space": "blurs light over the atlas",
    "screen-space": "blurs the picture, as engines do",
    "pre-integrated": "tables over curvature, as engines use them",
}.items():
    TECHNIQUES.register(_name, f"{_HOME}.{_name.replace('-', '_')}:TECHNIQUE", _summary)
