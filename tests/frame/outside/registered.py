"""Register a light, a lobe, a technique and an output after some imports and before others, and use them.

python registered.py [MODULE ...]: modules to import before anything is registered
"""

# ruff: noqa: E402 (imports are what is tested)
from __future__ import annotations

import os
import sys
import warnings
from importlib import import_module

for module in sys.argv[1:]:
    import_module(module)

from outside.glow_light import GlowLight

from dermis.scene.lights import LIGHTS

LIGHTS.register("after-glow", GlowLight)  # before any other module knows it

from outside.chalk import CHALK
from outside.dim import TECHNIQUE
from outside.glow import GLOW
from outside.uv_sum import UV_SUM

from dermis.frame.lights.kind import KINDS
from dermis.scene.outputs import OUTPUTS
from dermis.scene.techniques import TECHNIQUES
from dermis.specular.models import MODELS

KINDS.register("after-glow", GLOW)
MODELS.register("blue-chalk", CHALK)
TECHNIQUES.register("dim", TECHNIQUE)
OUTPUTS.register("uv_sum", UV_SUM)

import numpy as np
from setups import frontal, head_of, place, scene_of, settings_of

from dermis.apps.export.targets.pbrt.scene import light_directives
from dermis.apps.truths.lights import cycles_lamp
from dermis.base.errors import DermisError
from dermis.cli import main
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import plane

floor = head_of(plane(200.0, 4))
glow = GlowLight(position=place(floor, (0, 0, 150)), target=place(floor, (0, 0, 0)), power=6)
settings = settings_of(technique="dim", transmission="none")
renderer = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


def drawn(light: GlowLight, power: float) -> np.ndarray:
    """Return the picture in a light with another power."""
    scene = scene_of(floor, frontal(0.1), light.replace(power=power), specular="blue-chalk", rho_s=0.4)
    rendered = renderer.draw(scene, settings, outputs=("uv", "uv_sum"))
    assert np.allclose(rendered.output("uv_sum"), rendered.output("uv").sum(axis=-1), atol=1e-6)
    return rendered.linear()


picture = drawn(glow, 1.0) - drawn(glow, 64.0)
assert picture[24, 24].max() < 1e-3 * 3.14 and picture[0, 0].min() > 0.01, "the frame draws the light"
with warnings.catch_warnings(record=True) as notes:
    warnings.simplefilter("always")
    lines = light_directives([glow], None)
assert [str(one.message) for one in notes] == [
    "light 1: pbrt has no after-glow light, so it becomes a point light"
]
assert any(line.startswith('LightSource "point"') for line in lines)
try:
    cycles_lamp(glow, 1)
except DermisError as error:
    assert (
        "got 'after-glow'. Leave the light out, or register in dermis.apps.truths.lights.CYCLES_LIGHTS"
        in str(error)
    )
else:
    raise AssertionError("a truth takes a light that it does not know")
sys.argv = ["dermis", "cite", "--technique", "dim", "--specular", "blue-chalk"]
main()
