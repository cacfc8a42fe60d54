"""The sections of the panel, from top to bottom.

A section is a module with `TITLE`, `OPEN` (whether it is open at first) and `draw(desk)`; to add one, write
the module and name it in `SECTIONS`.
"""

from __future__ import annotations

from dermis.viewer.panel.sections import (
    compare,
    light,
    picture,
    profile,
    scene,
    surface,
    technique,
    timing,
    view,
)

SECTIONS = (view, compare, profile, surface, light, technique, picture, timing, scene)
