"""One person with a blush in four steps from none to full, and in four other states.

Blood volume and oxygen saturation change by zones of the face; sweat and tears make the skin smoother.

Deck: S24
Columns: 4
Sources: DonnerJensen2006, Jacques1998
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

PERSON = dermis.Human(age=26, skin_ancestry="caucasian", hair=dermis.HairLook("cropped"))
STATES = {f"blush {weight:g}": {"blush": weight} for weight in (0.0, 0.33, 0.67, 1.0)}
STATES |= {name: {name: 1.0} for name in ("pallor", "cold", "exertion", "crying")}


def draw(studio):
    head, panels = PERSON.head(), {}
    for title, state in STATES.items():
        scene = dermis.Scene(head, lights="studio", camera=dermis.headshot(head), state=state)
        panels[title] = studio.render(scene, scale=0.75)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
