"""Reflected light does not enter the skin.

With the surface of the 2007 talk. Above, the head without an energy term, with the published one, and with
the full one. Below, the same head in white under uniform light: it should return exactly what it receives,
shown as grey; blue is up to 10 % too dark, red up to 10 % too bright.

Deck: S22
Equation: E_in = Σ_lights E max(N·L, 0) (1 − ρ_s ρ_dt(N·L, m))
Sources: dEonLuebke2007, Dudash2007
Columns: 3
"""

from dataclasses import replace

import numpy as np
from matplotlib import colormaps

import dermis
from dermis.apps.gallery.script import run_gallery_script

TERMS = ("none", "published", "full")


def draw(studio):
    head, deck = studio.head(regions="none"), dermis.Skin.preset("deck-2007")
    camera, even = dermis.three_quarter(head), dermis.Environment(name="uniform")
    white = replace(head, maps=replace(head.maps, colour=np.ones((4, 4, 3), np.float32)))
    skins = {name: deck.model_copy(update={"energy": name}) for name in TERMS}
    heads = {name: dermis.Scene(head, camera=camera, skin=skin) for name, skin in skins.items()}
    panels = {name: studio.render(scene) for name, scene in heads.items()}
    for name, skin in skins.items():
        furnace = dermis.Scene(white, camera=camera, skin=skin, environment=even)
        returned = studio.render_linear(furnace, occlusion="none")[..., 1]
        tinted = colormaps["coolwarm"](np.clip((returned - 0.9) / 0.2, 0, 1))[..., :3]
        panels[f"{name}: light returned"] = np.uint8(255 * tinted * (returned > 0.2)[..., None])
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
