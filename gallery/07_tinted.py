"""White reflections and tinted ones.

Skin is not a metal: its surface reflects in the colour of the light. Multiplied by the colour map, it looks
like painted clay. Shown on oily skin.

Deck: S7
Sources: Dudash2007
Slider: white (correct) | tinted (wrong)
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    head = studio.head()
    camera = dermis.three_quarter(head)
    ways = {"white (correct)": "white", "tinted (wrong)": "wrong"}
    return {
        name: studio.render(
            dermis.Scene(head, camera=camera, skin=dermis.Skin(specular_colour=colour, oiliness=0.5)), 1.4
        )
        for name, colour in ways.items()
    }


if __name__ == "__main__":
    run_gallery_script(draw)
