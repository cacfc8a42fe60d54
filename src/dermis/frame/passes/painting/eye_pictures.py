"""Eyes painted as pictures, for programs that have no shader of their own for them."""

from __future__ import annotations

import numpy as np

from dermis.frame.passes import program
from dermis.frame.surface import fill_eye
from dermis.gpu import CommandList, Device, download, make_texture
from dermis.mesh.eyeball import FALLING, RIM, EyePictures
from dermis.mesh.eyes import EyeLook

SIDE = 1024
"""Of the pictures [texels]; a texel of the iris is a fortieth of a millimetre."""


def eye_pictures(device: Device, look: EyeLook, side: int = SIDE) -> EyePictures:
    """What an eye looks like, seen along its axis through the cornea."""
    shader = program(device, "painting/eye_pictures.wgsl")
    asked = shader.record("Asked", rim=RIM, falling=FALLING)
    fill_eye(asked["eye"], look)
    made = {name: make_texture(device, (side, side), "rgba32float") for name in ("colours", "normals")}
    frame = CommandList(device, timed=False)
    frame.compute("paint", shader, {"asked": asked, **made}, (side, side))
    frame.submit()
    colours, normals = (download(device, texture)[..., :3] for texture in made.values())
    return EyePictures(np.ascontiguousarray(colours, np.float32), np.ascontiguousarray(normals, np.float32))
