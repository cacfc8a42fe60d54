"""The atlas as a flat picture: which layer of it is looked at, and which part."""

from __future__ import annotations

from dataclasses import dataclass, replace

ATLAS = "atlas"
"""The view that shows it."""
_LEAST_SPAN, _MOST_SPAN = 2.0**-10, 2.0


@dataclass(frozen=True)
class Chart:
    """A part of the atlas, over the whole picture.

    layer : one of `views.LAYERS`
    centre : place in the middle of the picture, u to the right and v down [-]
    span : sides of the atlas that the picture's shorter side shows [-]
    """

    layer: str = "irradiance"
    centre: tuple[float, float] = (0.5, 0.5)
    span: float = 1.05

    def panned(self, right: float, down: float) -> Chart:
        """The atlas dragged along, by shares of the picture's shorter side."""
        u, v = self.centre
        return self._at(u - self.span * right, v - self.span * down)

    def zoomed(self, factor: float, x: float, y: float) -> Chart:
        """Nearer (factor under 1) or farther, while the place under the cursor stays there.

        x, y : of the cursor from the picture's middle, right and down, by shares of its shorter side
        """
        span = min(_MOST_SPAN, max(_LEAST_SPAN, factor * self.span))
        (u, v), less = self.centre, self.span - span
        return replace(self, span=span)._at(u + less * x, v + less * y)

    def whole(self) -> Chart:
        """All of the layer."""
        return Chart(self.layer)

    def _at(self, u: float, v: float) -> Chart:
        return replace(self, centre=(min(1.0, max(0.0, u)), min(1.0, max(0.0, v))))
