"""Six ways to scatter light, with their errors and times.

At the shadow of the nose, against the same profile summed over the surface by straight distance: relative
RMSE, and milliseconds of one frame here. None at all, one blur for all colours, the passes of 2007; texture
space as in this package, and what engines do: blurs over the picture, and tables over curvature.

Deck: S24, S25
Sources: Borshukov2003, Green2004, dEonLuebke2007, Jimenez2015, Penner2011, JensenBuhler2002
Columns: 4
"""

from dermis.comparison.compare import compare
from dermis.gallery.picture import main

TECHNIQUES = ("none", "one-blur", "gpu-gems-3", "texture-space", "screen-space", "pre-integrated")


def draw(studio):
    settings = studio.settings(0.6)
    made = compare(studio.head(), "surface-integral", TECHNIQUES, region="nose", settings=settings)
    panels = {"the surface integral": (255 * made.shown(made.truth.image)).round().astype("uint8")}
    for row in made.rows:
        image = (255 * made.shown(made.images[row.technique])).round().astype("uint8")
        panels[f"{row.technique}: {row.relrmse:.1%}, {row.ms:.0f} ms"] = image
    return panels


if __name__ == "__main__":
    main(draw)
