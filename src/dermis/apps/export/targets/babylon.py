"""Babylon.js: a page with the head, lit and turned, whose skin scatters light on the screen."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dermis.apps.export.inlining import hash_of, inline
from dermis.apps.export.lobe import fit_d
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, numbers_of
from dermis.apps.export.targets.babylon_spiral import TOO_WIDE, spiral_curve
from dermis.apps.export.targets.web_library import Script
from dermis.apps.export.targets.web_page import linked
from dermis.apps.export.targets.web_target import WebPage, surface_rows
from dermis.optics.curve import Curve

_PROFILE = "subSurface.scatteringDiffusionProfile"
_SCALE = "subSurfaceConfiguration.metersPerUnit"
_CORE = "4Kbm3nj4VMzMufY0FYM9DactmO8CluLjEAe0W1BzVo7hlKEswOLkl46FLI6mxZmx"
_LOADERS = "4FQhr/DrxLfjm5tCJq7Cs1uJIC29544DNb4rVCt4qVzXM7rw07KsDYgdH8/ayoss"


class Babylon(WebPage):
    """A page that runs."""

    name: ClassVar[str] = "babylon"
    title: ClassVar[str] = "Babylon.js"
    versions: ClassVar[tuple[str, ...]] = ("9.28.0",)
    licence: ClassVar[str] = "Apache-2.0"
    draw: ClassVar[str] = "babylon.js"
    wrong: ClassVar[str] = (
        "Forty samples of one lobe a channel, the same in every pixel: shadows' edges show steps of a "
        "fortieth, and the narrower channels have fewer of them. Light spreads on the "
        "screen only, not through thin parts; slopes count twice in depth; diffuse light above 1 is "
        "cut off. Lights are parallel here."
    )
    scripts: ClassVar[dict[str, tuple[Script, ...]]] = {
        "9.28.0": (
            Script("babylonjs", "9.28.0", "babylon.js", _CORE),
            Script("babylonjs-loaders", "9.28.0", "babylonjs.loaders.min.js", _LOADERS),
        )
    }

    def parameters(self, subject: Subject, version: str) -> Rows:
        """A profile of 1/d, and a scale that has the widest channel's lobe drawn from.

        A channel c is 1/c wide and all are drawn from a lobe of width max(c), both times 2/metersPerUnit mm.
        So with k = sqrt(d_min d_max) the colour k/d and metersPerUnit 2/k, both are true.
        """
        d = fit_d(subject.curve)
        k = float(np.sqrt(d.min() * d.max()))
        return _rows(subject, k / d, TOO_WIDE / k)

    def naive(self, subject: Subject, version: str) -> Rows:
        """Widths in mm as the colour, as in the engine that the shader comes from; the file is in metres."""
        return _rows(subject, fit_d(subject.curve), 1.0)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """What its samples add up to."""
        return spiral_curve(numbers_of(rows, _PROFILE), numbers_of(rows, _SCALE)[0], subject.curve.energy)

    def loaded(self, version: str) -> tuple[str, list[str]]:
        """Two scripts."""
        scripts = self.scripts[version]
        if self.installed is None:
            return "\n".join(map(linked, scripts)), [script.url for script in scripts]
        texts = [inline(script.read(self.installed)) for script in scripts]
        return "\n".join(f"<script>{text}</script>" for text in texts), [hash_of(text) for text in texts]


def _rows(subject: Subject, profile: np.ndarray, metres: float) -> Rows:
    colour = tuple(float(x) for x in profile)
    return (
        Row(_PROFILE, colour, "-", "1/width: a smaller number spreads farther"),
        Row(_SCALE, metres, "m", "widths are 2 mm by this and by the colour; no length of the scene's"),
        *surface_rows(subject),
    )


TARGET = Babylon()
