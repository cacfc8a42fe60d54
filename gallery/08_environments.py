"""Image-based light.

A hall with many lamps and a room with one large window, each rotated about the head. Reflections use a
panorama prefiltered for each roughness, scattered light its irradiance; small bright peaks such as the sun
become lights with shadows.

Deck: S8
Sources: KautzMcCool2000, RamamoorthiHanrahan2001
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

SEEN = {"background": "environment", "background_blur": 0.05}


def draw(studio):
    head = studio.head()
    panels = {}
    for name in ("royal_esplanade", "lebombo"):
        for turn in (0, 120, 240):
            around = dermis.Environment(name=name, rotation_degrees=turn)
            scene = dermis.Scene(head, camera=dermis.three_quarter(head), environment=around)
            panels[f"{name}, {turn}°"] = studio.render(scene, tone="filmic", **SEEN)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
