"""Clothing and glasses.

Garments are cut from the skin of the bust: cloth is stretched over it, folded, and closed by collars, cords
and buttons. Frames are fitted to nose, brows and ears of each person.

Columns: 4
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

PEOPLE = {
    7: {"clothing": "navy crew neck", "glasses": "square"},
    10: {"clothing": "burgundy v-neck"},
    16: {"clothing": "cream high neck", "glasses": "round"},
    21: {"clothing": "sky linen shirt"},
    3: {"clothing": "indigo denim shirt", "glasses": "aviator"},
    5: {"clothing": "grey hoodie"},
    12: {"clothing": "mustard hoodie", "glasses": "rimless"},
    18: {"clothing": "white crew neck", "glasses": "sunglasses"},
}
HAIR = {"style": "cropped", "length_mm": 8.0}


def draw(studio):
    panels = {}
    for index, (seed, worn) in enumerate(PEOPLE.items()):
        head = dermis.Human.sampled(seed, hair=HAIR, **worn).head(subdivide=1)
        camera = dermis.Camera(position=(300 - 200 * (index % 4), 0, 1250), target=(0, -75, 0), frame_mm=390)
        lights = "studio" if index < 4 else "window"
        scene = dermis.Scene(head, lights=lights, camera=camera)
        settings = {"atlas": 1024, "background": "gradient", "exposure": "auto", "samples": 8}
        panels[", ".join(worn.values())] = studio.render(scene, **settings)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
