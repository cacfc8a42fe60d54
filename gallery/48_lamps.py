"""One face rendered in red, green and blue, and in the light of five lamps.

White is white in each picture. The first picture is rendered in three channels; the colours of the others are
computed from spectra in bands of 10 nm.

Deck: S24
Columns: 3
Sources: MallettYuksel2019, CIE2018, DonnerJensen2006
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

LAMPS = {"daylight D65": "D65", "incandescent A": "A", "fluorescent FL11": "FL11", "LED-B3": "LED-B3"}
LAMPS |= {"equal energy": "E"}


def draw(studio):
    head = dermis.Human(age=26, skin_ancestry="caucasian", hair=dermis.HairLook("cropped")).head()
    scene = dermis.Scene(head, lights="portrait", camera=dermis.headshot(head))
    settings = studio.settings(0.75, background="gradient", exposure="skin")
    picture = dermis.render_spectrum(studio.renderer, scene, settings)
    panels = {"red, green and blue": picture.rgb + picture.backdrop}
    return panels | {title: picture.linear(lamp) for title, lamp in LAMPS.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
