"""Render every rig and environment on several heads as one contact sheet."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dermis.base.command_line import run_script
from dermis.formats.samples import SAMPLES, is_available
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.images.io import write_png
from dermis.mesh.head import Head
from dermis.scene import Environment, Scene, Settings, load_lights
from dermis.scene.camera import camera_preset
from dermis.scene.heads import HUMAN, load_head
from dermis.scene.lights import NO_LIGHTS, light_presets
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

TURNS = (0.0, 90.0, 180.0, -90.0)


def heads() -> dict[str, Head]:
    """Return the human with light and with dark skin, and the sample heads that are available on disk."""
    own = {"usual": load_head(HUMAN)}
    own["light"] = Human(african=0.0, asian=0.0, caucasian=1.0).head()
    own["dark"] = Human(african=1.0, asian=0.0, caucasian=0.0).head()
    samples = [name for name, sample in SAMPLES.items() if sample.kind == "head" and is_available(name)]
    return own | {name: load_head(name, subdivide=1) for name in samples}


def lighting_options() -> Iterator[dict[str, object]]:
    """Yield lighting options: each rig alone, each environment rotated, and a rig in each environment."""
    for rig in light_presets():
        if rig != NO_LIGHTS:
            yield {"lights": load_lights(rig)}
    rooms = [name for name, sample in SAMPLES.items() if sample.kind == "environment" and is_available(name)]
    yield {"lights": (), "environment": Environment(name="uniform")}
    for room in rooms:
        for turn in TURNS:
            yield {"lights": (), "environment": Environment(name=room, rotation_degrees=turn)}
        yield {"lights": load_lights("rim"), "environment": Environment(name=room)}


def main(output: Path, *, side: int = 160, camera: str = "portrait", adapter: str = "auto") -> None:
    """Render the sheet with one row per light and one column per head.

    Parameters
    ----------
    output:
        PNG file to write.
    side:
        Side of each picture [pixel].
    """
    settings = Settings(size=(side, side), atlas=512, shadow_size=1024, **PHOTOGRAPHIC_SETTINGS)
    renderer, columns = Renderer(adapter), []
    for head in heads().values():
        scenes = [Scene(head, camera=camera_preset(camera, head), **light) for light in lighting_options()]  # type: ignore[arg-type]
        columns.append(np.concatenate([renderer.draw(scene, settings).srgb8() for scene in scenes]))
    write_png(output, np.concatenate(columns, axis=1))


if __name__ == "__main__":
    run_script(main)
