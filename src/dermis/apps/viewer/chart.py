"""The atlas as a flat picture: which layer is shown, and which part of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

ATLAS = "atlas"
"""The name of this view."""
_LEAST_SPAN, _MOST_SPAN = 2.0**-10, 2.0


@dataclass(frozen=True)
class Chart:
    """The part of the atlas that fills the picture.

    layer : one of `views.LAYERS`
    centre : uv at the middle of the picture, u to the right and v down [-]
    span : extent of the picture's shorter side, in sides of the atlas [-]
    """

    layer: str = "irradiance"
    centre: tuple[float, float] = (0.5, 0.5)
    span: float = 1.05

    def panned(self, right: float, down: float) -> Chart:
        """Drag the atlas, in fractions of the picture's shorter side."""
        u, v = self.centre
        return self._at(u - self.span * right, v - self.span * down)

    def zoomed(self, factor: float, x: float, y: float) -> Chart:
        """Zoom in (factor below 1) or out, keeping the point under the cursor fixed.

        x, y : of the cursor from the picture's middle, right and down, in fractions of its shorter side
        """
        span = min(_MOST_SPAN, max(_LEAST_SPAN, factor * self.span))
        (u, v), shrunk = self.centre, self.span - span
        return replace(self, span=span)._at(u + shrunk * x, v + shrunk * y)

    def _at(self, u: float, v: float) -> Chart:
        return replace(self, centre=(min(1.0, max(0.0, u)), min(1.0, max(0.0, v))))
