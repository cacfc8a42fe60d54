"""The atlas stretches skin, so blurs must be stretched too.

A fine grid of light on the ear, blurred by the same Gaussians: with one width for the whole atlas, with
widths corrected along u and v, and with the full metric, because u and v are rarely perpendicular. Then the
stretch of the atlas.

Deck: S17
Equation: σ_u = σ |∂(u,v)/∂x|, sheared where u and v are oblique
Sources: dEonLuebke2007, Geusebroek2003
Columns: 4
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

MODES = {"uniform": "none", "corrected along u and v": "axes", "full metric": "full"}


def draw(studio):
    head = studio.head()
    lines = [{"position": (0.0, y, 0.0), "up": (0, 0, 1)} for y in (-40.0, -20.0, 0.0, 20.0)]
    lines += [{"position": (0.0, 0.0, z), "up": (0, 1, 0)} for z in (-20.0, 0.0, 20.0, 40.0, 60.0)]
    stripes = [dermis.StripeLight(direction=(-1, 0, 0), irradiance=(30, 30, 30), **line) for line in lines]
    camera = dermis.side(head).model_copy(update={"frame_mm": 130})
    skin = dermis.Skin(profile="skin1", specular="none")
    scene = dermis.Scene(head, lights=stripes, camera=camera, skin=skin)
    panels = {name: studio.render(scene, stretch=mode, transmission="none") for name, mode in MODES.items()}
    return panels | {"stretch": studio.render_view(scene, "stretch")}


if __name__ == "__main__":
    run_gallery_script(draw)
