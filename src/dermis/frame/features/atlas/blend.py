"""Two layouts blended so that neither's seams show: the talk's several uv sets."""

from __future__ import annotations

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.programs import program
from dermis.frame.seams import FEATHER_MM
from dermis.gpu import Recorder, Texture


def draw(graph: Recorder, first: LitAtlas, second: LitAtlas, into: Texture) -> None:
    """Blend the first layout's light, near its edges the second's, into a texture of the first's atlas."""
    bound = {
        **second.lit,  # whose triangle table has places in the second layout
        **first.atlas.resources,
        "first": first.scattered,
        "second": second.scattered,
        "blended": into,
    }
    shader = program(graph.device, "atlas/blend.wgsl", (("FADE_MM", FEATHER_MM),))
    graph.compute("blend", shader, bound, into.size[:2])
