"""Frames of scenes taken down for players elsewhere."""

from __future__ import annotations

from dermis.frame.frame import draw_frame
from dermis.frame.inputs import Inputs
from dermis.frame.renderer import Renderer
from dermis.gpu.tape import Take, Tape
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES


def taken(renderer: Renderer, tape: Tape, scene: Scene, settings: Settings) -> tuple[Inputs, Take]:
    """What a frame reads, and its passes; nothing of it runs.

    renderer : that has the tape's device
    """
    inputs = renderer.prepare(scene, settings)
    technique = TECHNIQUES[settings.technique]
    return inputs, tape.take(lambda graph: draw_frame(graph, inputs, technique))
