"""Hair styles, straight to coiled.

Tens of thousands of hairs grow on any person between combed guides, cut, gathered, twisted or braided. They
cast shadows on each other and scatter light between them.

Deck: +
Equation: T = exp(-n (1 - a_f))
Sources: Zinke2008, YukselKeyser2008, Marschner2003
Columns: 4
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

GROUPS = {  # by ancestry: curl, eumelanin and pheomelanin of the styles
    "asian": (0.0, 5.0, 0.3, "bob fringe bun swept-back"),
    "caucasian": (0.3, 0.9, 0.6, "long shoulder-length ponytail short cropped receding"),
    "african": (0.95, 6.0, 0.3, "afro box-braids cornrows twists fade buzz"),
}
MEN = "swept-back short cropped receding twists fade buzz"
FROM_THE_SIDE = "bun ponytail cornrows"


def draw(studio):
    panels = {}
    for ancestry, (curl, eumelanin, pheomelanin, styles) in GROUPS.items():
        for style in styles.split():
            hair = dermis.HairLook(style, curl=curl, eumelanin=eumelanin, pheomelanin=pheomelanin)
            weights = {"african": 0, "asian": 0, "caucasian": 0} | {ancestry: 1}
            head = dermis.Human(**weights, sex=float(style in MEN), age=30, hair=hair).head()
            camera = (dermis.side if style in FROM_THE_SIDE else dermis.three_quarter)(head)
            panels[style] = studio.render(
                dermis.Scene(head, camera=camera), background="gradient", exposure="auto"
            )
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
