"""The scan with other skin.

Melanin and blood of each texel are estimated from its colour alone, changed, and converted back to colour.
Brows, lips and stubble, which the skin model does not describe, remain.

Deck: S24
Columns: 4
Sources: DonnerJensen2006, Jacques1998
"""

from dataclasses import replace

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.inverse.unmixing.unmix import FractionChange, PigmentChange

SKINS = {
    "as scanned": PigmentChange(),
    "pale": PigmentChange(blood=FractionChange(0.3)),
    "flushed": PigmentChange(blood=FractionChange(2.5)),
    "cold: little oxygen": PigmentChange(oxygen=0.2, blood=FractionChange(1.4)),
}
for median in (0.05, 0.12, 0.25, 0.4):
    SKINS[f"{100 * median:g} % melanosomes"] = PigmentChange(melanin=FractionChange(median=median))


def draw(studio):
    head = studio.head_with_colour_map()
    skin, panels = dermis.unmix(head.maps.colour, adapter=studio.adapter), {}
    for name, change in SKINS.items():
        colour = skin.recoloured(change, studio.adapter).clip(0.0, 1.0)
        recoloured = replace(head, maps=replace(head.maps, colour=colour))
        panels[name] = studio.render(dermis.Scene(recoloured, camera=dermis.portrait(head)), scale=0.75)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
