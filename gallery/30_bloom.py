"""Light that the lens scatters.

A fraction of the light is spread by wider and wider Gaussians, as lens and eye do around bright spots.
Exaggerated here to be visible.

Deck: +
Sources: dEonLuebke2007
Slider: without | a tenth of the light
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    head = studio.head()
    lights = dermis.load_lights("rim")
    scene = dermis.Scene(
        head, lights=lights, camera=dermis.three_quarter(head), skin=dermis.Skin(oiliness=0.4)
    )
    shares = {"without": 0.0, "a tenth of the light": 0.1}
    shown = {"exposure": 2.4, "tone": "filmic"}
    return {label: studio.render(scene, 1.4, bloom=share, **shown) for label, share in shares.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
