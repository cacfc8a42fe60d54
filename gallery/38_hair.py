"""Short hair and beards.

Tens of thousands of hairs on any person, cropped, combed or coiled, coloured by their pigments. They cast
shadows on each other and scatter light between them.

Deck: +
Equation: T = exp(-n (1 - a_f))
Sources: Zinke2008, YukselKeyser2008, Marschner2003
Columns: 2
"""

import math

import dermis
from dermis.apps.gallery.script import draw_script
from dermis.human.hair.look import HairLook

PEOPLE = {
    "short": (dermis.Human(), 25),
    "coiled": (dermis.Human(african=1, asian=0, caucasian=0, sex=1, hair_eumelanin=8), 40),
    "cropped, with a beard": (
        dermis.Human(caucasian=1, african=0, asian=0, sex=1, age=62, hair=HairLook("cropped", beard_mm=11)),
        20,
    ),
    "from behind": (dermis.Human(asian=1, african=0, caucasian=0, hair_eumelanin=7), 145),
}


def draw(studio):
    panels = {}
    for name, (person, turn) in PEOPLE.items():
        around = 1100 * math.sin(math.radians(turn)), 20.0, 1100 * math.cos(math.radians(turn))
        camera = dermis.Camera(position=around, target=(0, 0, 0), frame_mm=285)
        panels[name] = studio.render(dermis.Scene(person.head(), camera=camera))
    return panels


if __name__ == "__main__":
    draw_script(draw)
