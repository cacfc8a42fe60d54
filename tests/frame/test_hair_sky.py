"""Light of the sky on skin under hair."""

from __future__ import annotations

import os

from dermis.apps.validation.comparisons.person_views import VIEWS, view_scene
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.scene.environment import Environment
from dermis.scene.settings import Settings


def test_hair_hides_the_sky_from_skin() -> None:
    renderer, human = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu")), Human()
    settings = Settings(size=(48, 48), atlas=128, strands=False, occlusion="rest", subsamples=1)
    pictures = {}
    for style in ("none", "long"):
        head = replace(human, hair=HairLook(style)).head(subdivide=0)
        scene = view_scene(head, VIEWS["portrait"])
        scene = scene.replace(lights=(), environment=Environment(name="uniform"))
        pictures[style] = renderer.draw(scene, settings).linear()
