"""Ears lit from behind.

Light that enters behind an ear leaves in front. Red light penetrates deepest, so the glow is red, and
strongest where the ear is thinnest. Above the head of this gallery, below the human of the package.

Deck: +
Equation: E_through = Σ_cells A (R(straight distance) − R(distance along the surface)) E_cell
Sources: dEonLuebke2007
Columns: 2
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    panels = {}
    bald = dermis.Human(hair=dermis.HairLook()).head()
    for name, head in ((studio.name, studio.head()), ("human", bald)):
        positions = head.mesh.positions - head.centre_mm
        upper = positions[abs(positions[:, 1]) < 60]
        x, y, z = (float(part) for part in upper[upper[:, 0].argmax()])
        lamp = dermis.PointLight(position=(x + 150, y + 60, z - 600), target=(x, y, z), irradiance=(9, 9, 9))
        fill = dermis.RectangleLight(position=(600, 200, 700), irradiance=(0.35, 0.37, 0.4))
        camera = dermis.Camera(position=(x + 420, y + 20, z + 420), target=(x - 12, y, z), frame_mm=110)
        scene = dermis.Scene(head, lights=[lamp, fill], camera=camera, skin=dermis.Skin(profile="skin1"))
        panels[f"{name}, thick everywhere"] = studio.render(scene, transmission="none")
        panels[f"{name}, with light through it"] = studio.render(scene, transmission="thin")
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
