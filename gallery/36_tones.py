"""One person with different skin tones.

From the least to the most measured melanin, all with the same blood.

Deck: S24
Columns: 4
Sources: DonnerJensen2006, Jacques1998
"""

from dataclasses import replace

import dermis
from dermis.apps.gallery.script import run_gallery_script

MELANIN = (0.003, 0.008, 0.02, 0.045, 0.09, 0.16, 0.26, 0.4)
PERSON = dermis.Human(age=32)


def draw(studio):
    head, panels = PERSON.head(), {}
    for share in MELANIN:
        person = replace(PERSON, skin=replace(PERSON.look, melanin=share))
        own = person.transfer_skin_to(head)
        scene = dermis.Scene(own, camera=dermis.portrait(head))
        panels[f"{100 * share:g} % melanosomes"] = studio.render(scene, scale=0.75)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
