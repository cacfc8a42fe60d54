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
from dermis.apps.gallery.script import run_gallery_script
from dermis.frame.features.post.meter import METERED_IRRADIANCE
from dermis.human.skin.measured import measured_medians
from dermis.images.colour import encode_srgb8, linear_of_lab

TEN = "japanese F,caucasian,arabian,chinese,southeast asian,iraqi,south asian M,african F,african,african M"
PERSON = dermis.Human(age=32)


def draw(studio):
    cheeks = [one for one in measured_medians() if one.site == "cheek" and not one.age_group]
    cells, head, panels = {f"{one.group} {one.sex}".strip(): one for one in cheeks}, PERSON.head(), {}
    for name in TEN.split(","):
        cell = cells[name]
        sites = dermis.Human(skin_ancestry=cell.group).look.sites
        person = replace(PERSON, skin=replace(PERSON.look, **cell.pigments._asdict(), sites=sites))
        scene = dermis.Scene(person.transfer_skin_to(head), camera=dermis.portrait(head))
        face = studio.render(scene, 0.6, exposure="auto")
        patch = encode_srgb8(METERED_IRRADIANCE * np.maximum(linear_of_lab(cell.cielab), 0.0))
        panels[name] = np.hstack([face, np.broadcast_to(patch, (len(face), len(face) // 4, 3))])
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
