"""Six techniques of scattering, with their errors and times.

The shadow of the nose, compared with the same profile integrated over the surface by straight-line distance:
relative RMSE, and the milliseconds of a frame on this machine. Texture space as in this package; no
scattering; one blur for all colours; the passes of 2007; and the methods of engines, screen-space blurs and
tables over curvature.

Deck: S24, S25
Sources: Borshukov2003, Green2004, dEonLuebke2007, Jimenez2015, Penner2011, JensenBuhler2002
Columns: 4
"""

from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.validation.comparisons.compare import compare
from dermis.scene.techniques import TECHNIQUES


def draw(studio):
    settings = studio.settings(0.6)
    compared = compare(studio.head(), "surface-integral", TECHNIQUES.names, region="nose", settings=settings)
    images = {"the surface integral": compared.reference.image}
    for row in compared.rows:
        images[f"{row.technique}: {row.relrmse:.1%}, {row.ms:.0f} ms"] = compared.images[row.technique]
    return {name: (255 * compared.tone_mapped(one)).round().astype("uint8") for name, one in images.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
