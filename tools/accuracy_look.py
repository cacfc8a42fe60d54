"""Sets skins beside Cycles, with the specular's share of light: python tools/accuracy_look.py [ADAPTER].

DERMIS_BLENDER_PYTHON names a Python with bpy. Writes docs/images/look.webp and benchmarks/results/look.json,
from which tools/accuracy.py takes its rows, so that only this needs Blender.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from accuracy_person import sheet_bytes
from numpy.typing import NDArray

import dermis
from dermis.apps.truths.cycles import cycles_passes
from dermis.apps.truths.cycles_scene import Coated
from dermis.atlas.build import build_atlas
from dermis.frame.painted import with_painted_maps
from dermis.mesh.head import Head
from dermis.optics.profiles import load_profile
from dermis.scene import Scene, Settings, Skin
from dermis.scene.camera import PRESETS

ROOT = Path(__file__).parent.parent
PICTURE = ROOT / "docs" / "images" / "look.webp"
RESULTS = ROOT / "benchmarks" / "results" / "look.json"
HEADS = {"scan": "lee_perry_smith", "human": "human"}
VIEWS = ("portrait", "three-quarter", "cheek", "profile")
COLUMNS = ("deck-2007", "default", "Cycles")
SIDE, PATHS, PATHS_OF_SURFACE = 256, 64, 16
MAP_SIDE = 1024
ROUGHNESS = 0.3

Picture = NDArray[np.float32]


class Look(NamedTuple):
    """A picture in linear light, and the share of its light that the surface reflects [-]."""

    picture: Picture
    share: float


def of_frame(renderer: dermis.Renderer, scene: Scene) -> Look:
    """The scene by the frame."""
    how = {"size": (SIDE, SIDE), "atlas": 1024, "strands": False}
    settings = Settings.model_validate(how), Settings.model_validate(how | {"parts": "specular"})
    picture, surface = (renderer.draw(scene, one).linear() for one in settings)
    return Look(picture, float(surface.sum() / picture.sum()))


def of_cycles(scene: Scene, skin: Coated) -> Look:
    """The scene by Cycles; once more over black, which leaves what the surface reflects."""
    settings = Settings(size=(SIDE, SIDE))
    black = replace(skin, colour=np.zeros_like(skin.colour))
    (whole,) = cycles_passes(scene, skin, [PATHS], settings)
    (surface,) = cycles_passes(scene, black, [PATHS_OF_SURFACE], settings)
    return Look(whole.image, float(surface.image.sum() / whole.image.sum()))


def fewer(values: Picture) -> Picture:
    """A map (h, w, ...) in means of squares of texels, so that it has `MAP_SIDE` rows at most."""
    step = max(1, len(values) // MAP_SIDE)
    blocks = values.reshape(len(values) // step, step, values.shape[1] // step, step, *values.shape[2:])
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)


def bumpy(head: Head) -> Head:
    """The head with its relief as one normal map."""
    height = head.maps.height
    if height is None:
        return head
    height = fewer(height)
    down, right = np.gradient(height)
    stretch = build_atlas(head.mesh, len(height)).stretch.astype(np.float32)
    slopes = np.asarray(np.stack([right, -down], axis=-1) * stretch, np.float32)
    return replace(head, maps=replace(head.maps, normal=slopes, height=None))


def coated(head: Head) -> Coated:
    """Cycles' skin of a head: its colours, and light that leaves as far off as in the frame.

    By Burley's profile that is 2.5 d, d the mean free path over a factor of the colour.
    """
    assert head.maps.colour is not None and head.maps.mean_colour is not None
    profile, colour = load_profile(Skin().profile), head.maps.mean_colour
    spread_mm = (profile.weight * np.sqrt(0.5 * np.pi * profile.variance_mm2[:, None])).sum(axis=0)
    walk_mm = spread_mm / 2.5 * (1.9 - colour + 3.5 * (colour - 0.8) ** 2)
    red, green, blue = (float(part) for part in 4.0 * np.pi * walk_mm)
    return Coated(fewer(head.maps.colour), (red, green, blue), ROUGHNESS)


def looks(renderer: dermis.Renderer, called: str) -> dict[str, list[Look]]:
    """The columns of a head's views."""
    name = HEADS[called]
    usual, alike = (dermis.load_head(name, subdivide=1, regions=regions) for regions in ("auto", "none"))
    plain = bumpy(with_painted_maps(renderer.device, usual, MAP_SIDE))
    skin, found = coated(plain), dict[str, list[Look]]()
    for view in VIEWS:
        camera = PRESETS[view](usual)
        deck = of_frame(renderer, Scene(alike, camera=camera, skin=Skin.preset("deck-2007")))
        ours = of_frame(renderer, Scene(usual, camera=camera))
        found[view] = [deck, ours, of_cycles(Scene(plain, camera=camera), skin)]
        sys.stdout.write(f"{called} {view} {' '.join(f'{one.share:.3f}' for one in found[view])}\n")
        sys.stdout.flush()
    return found


def table() -> str:
    """Rows of the page, of what was measured last."""
    rows = json.loads(RESULTS.read_text(encoding="utf-8"))["rows"]
    shares = (" | ".join(f"{100 * share:.1f} %" for share in row["shares"]) for row in rows)
    return "\n".join(
        f"| {row['head']} | {row['view']} | {told} |" for row, told in zip(rows, shares, strict=True)
    )


def main(adapter: str = "auto") -> None:
    """Draw, trace, write."""
    renderer, rows, panels = dermis.Renderer(adapter), list[dict[str, object]](), dict[str, Picture]()
    found = {head: looks(renderer, head) for head in HEADS}
    for view in VIEWS:
        for head in HEADS:
            rows.append({"head": head, "view": view, "shares": [one.share for one in found[head][view]]})
            for column, one in zip(COLUMNS, found[head][view], strict=True):
                panels[f"{head} {view}, {column}: {100 * one.share:.1f} %"] = one.picture
    found_by = {"paths": PATHS, "rows": rows}
    RESULTS.write_text(json.dumps(found_by, indent=1) + "\n", encoding="utf-8")
    PICTURE.write_bytes(sheet_bytes(panels, 2 * len(COLUMNS)))


if __name__ == "__main__":
    main(*sys.argv[1:])
