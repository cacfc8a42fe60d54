"""Skin in files of any kind.

An avatar (.glb) has skin, eyes, a sweater that a mask cuts at the neck, and cards of hair, brows and lashes.
Only the skin scatters light. A scan has three materials with a picture each; another has colours at its
vertices and no uv. A hand and a body (.obj) have no colour at all: they get that of the default pigments.

Deck: +
Columns: 4
"""

import tempfile
import warnings
from pathlib import Path

import dermis
from dermis.apps.gallery.example_files import (
    unpack_mesh,
    write_avatar,
    write_three_meshes,
    write_vertex_colours,
)
from dermis.apps.gallery.script import draw_script


def draw(studio):
    scan = studio.coloured_head()
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # notes on what is skin, and of which size
        folder = Path(name)
        files = [write_avatar(studio, folder), write_three_meshes(scan, folder)]
        files += [write_vertex_colours(scan, folder), *(unpack_mesh(one, folder) for one in ("hand", "body"))]
        avatar, three, coloured, hand, body = (studio.head(str(file)) for file in files)
    side = dermis.Camera(position=(600, 40, 620), target=(0, -35, -50), frame_mm=330)
    near = dermis.Camera(position=(60, 20, 500), target=(4, 0, 0), frame_mm=95)
    scenes = {"avatar": (avatar, dermis.portrait(avatar)), "from the side": (avatar, side)}
    scenes["cards of lashes and brows"] = avatar, near
    scenes["a picture for each of three materials"] = three, dermis.portrait(three)
    scenes["colours of vertices, no uv"] = coloured, dermis.portrait(coloured)
    scenes |= {name: (one, dermis.full_body(one)) for name, one in (("hand", hand), ("body", body))}
    scenes["its face"] = body, dermis.portrait(body)
    return {name: studio.render(dermis.Scene(head, camera=camera)) for name, (head, camera) in scenes.items()}


if __name__ == "__main__":
    draw_script(draw)
