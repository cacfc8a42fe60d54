"""Ladder of ten measured tones.

One face in one light, with the median pigments of the cheek of ten groups of measured people; beside each,
the median colour of their cheeks as measured, without surface reflection.

Deck: +
Columns: 5
Sources: Lu2025
"""

from dataclasses import replace

import numpy as np

import dermis
from dermis.apps.gallery.script import draw_script
from dermis.frame.features.post.meter import METER_KEY
from dermis.human.skin.measured import measured_cells
from dermis.images.colour import encode_srgb8, linear_of_lab

GROUPS = (  # group and sex in the archive
    ("japanese", "F"),
    ("caucasian", ""),
    ("chinese", ""),
    ("iraqi", ""),
    ("southeast asian", ""),
    ("southeast asian", "M"),
    ("south asian", "M"),
    ("african", "F"),
    ("african", ""),
    ("african", "M"),
)
PERSON = dermis.Human(age=32)


def draw(studio):
    cells = {
        (one.group, one.sex): one for one in measured_cells() if one.site == "cheek" and not one.age_group
    }
    head, panels = PERSON.head(), {}
    for group, sex in GROUPS:
        cell = cells[group, sex]
        sites = dermis.Human(skin_ancestry=group).look.sites
        look = replace(PERSON.look, **cell.pigments._asdict(), sites=sites)
        own = replace(PERSON, skin=look).on(head)
        face = studio.render(dermis.Scene(own, camera=dermis.portrait(head)), 0.6, exposure="auto")
        patch = encode_srgb8(METER_KEY * np.clip(linear_of_lab(cell.cielab), 0.0, 1.0))
        beside = np.broadcast_to(patch, (len(face), len(face) // 4, 3))
        people = {"F": " women", "M": " men", "": ""}[sex]
        panels[f"{group}{people}, L* {cell.cielab[0]:.0f}"] = np.hstack([face, beside])
    return panels


if __name__ == "__main__":
    draw_script(draw)
