"""Brows and lashes.

Single hairs, generated on the human and rendered by compute shaders: their scattering follows from their
pigments, and they cast shadows on the skin. Hairs move with the skin.

Deck: +
Equation: L = Σ_lobes A M N E
Sources: Marschner2003, dEon2011, Chiang2016
Columns: 2
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.human.expressions import expression

BLINK = expression("closed-eyes")
PEOPLE = {
    "brown": (dermis.Human(), None),
    "closed": (dermis.Human(), BLINK),
    "black, a man of 40": (
        dermis.Human(african=1, asian=0, caucasian=0, sex=1, age=40, hair_eumelanin=8),
        None,
    ),
    "red": (dermis.Human(hair_eumelanin=0.6, hair_pheomelanin=2.0), None),
}


def draw(studio):
    panels = {}
    for name, (person, pose) in PEOPLE.items():
        head = person.head()
        x, y, z = (-c for c in head.centre_mm)  # the middle between the eyes
        camera = dermis.Camera(position=(x + 90, y, z + 700), target=(x + 19, y + 7, z + 10), frame_mm=80)
        panels[name] = studio.render(dermis.Scene(head, camera=camera, pose=pose))
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
