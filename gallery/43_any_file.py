"""Skin in files of any kind.

An avatar has skin, eyes, a sweater that a mask cuts at the neck, and cards of hair, brows and lashes. One
scan has three materials, another has vertex colours and no uv; a hand and a body get default pigments.

Deck: +
Columns: 4
"""

import tempfile
import warnings
from pathlib import Path

import dermis
from dermis.apps.gallery import example_files as examples
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    scan = studio.head_with_colour_map()
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # notes on what is skin, and of which size
        folder = Path(name)
        files = [examples.write_avatar(studio, folder), examples.write_skin_as_three_meshes(scan, folder)]
        files += [examples.write_vertex_colours(scan, folder), examples.unpack_mesh("hand", folder)]
        files.append(examples.unpack_mesh("body", folder))
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
    run_gallery_script(draw)
