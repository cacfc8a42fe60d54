"""Hair styles, straight to coiled.

Tens of thousands of hairs grow on any person between combed guides, cut, gathered, twisted or braided. They
cast shadows on each other and scatter light between them.

Deck: +
Equation: T = exp(-n (1 - a_f))
Sources: Zinke2008, YukselKeyser2008, Marschner2003
Columns: 4
"""

import math

import dermis
from dermis.apps.gallery.script import draw_script

LIGHT_BROWN, BROWN, BLACK, RED, BLOND = (0.9, 0.2), (1.6, 0.3), (6.0, 0.3), (0.3, 1.6), (0.35, 0.15)
COILED = {"african": 1, "asian": 0, "caucasian": 0}
STRAIGHT = {"african": 0, "asian": 1, "caucasian": 0}
WAVY = {"african": 0, "asian": 0, "caucasian": 1}
STYLES = {  # ancestry, sex, curl, pigments and turn of the head to the camera
    "long": (WAVY, 0, 0.05, BROWN, 30),
    "long, wavy": (WAVY, 0, 0.3, RED, 30),
    "shoulder-length": (WAVY, 0, 0.6, BLOND, 25),
    "bob": (STRAIGHT, 0, 0.0, BLACK, 25),
    "fringe": (STRAIGHT, 0, 0.0, BROWN, 15),
    "ponytail": (WAVY, 0, 0.1, BLOND, 75),
    "bun": (STRAIGHT, 0, 0.05, BLACK, 110),
    "afro": (COILED, 0, 0.95, BLACK, 25),
    "box-braids": (COILED, 0, 0.95, BLACK, 30),
    "cornrows": (COILED, 0, 0.95, BLACK, 40),
    "twists": (COILED, 1, 0.95, BLACK, 20),
    "fade": (COILED, 1, 0.9, BLACK, 50),
    "short": (WAVY, 1, 0.15, BROWN, 25),
    "swept-back": (STRAIGHT, 1, 0.0, BLACK, 55),
    "cropped": (WAVY, 1, 0.1, LIGHT_BROWN, 30),
    "receding": (WAVY, 1, 0.1, BROWN, 20),
}


def draw(studio):
    panels = {}
    for name, (ancestry, sex, curl, (eumelanin, pheomelanin), turn) in STYLES.items():
        style = name.partition(",")[0]
        hair = dermis.HairLook(style, curl=curl, eumelanin=eumelanin, pheomelanin=pheomelanin)
        around = 1100 * math.sin(math.radians(turn)), 20.0, 1100 * math.cos(math.radians(turn))
        camera = dermis.Camera(position=around, target=(0, -25, -40), frame_mm=330)
        person = dermis.Human(**ancestry, sex=sex, age=30, hair=hair)
        panels[name] = studio.render(dermis.Scene(person.head(), camera=camera))
    return panels


if __name__ == "__main__":
    draw_script(draw)
