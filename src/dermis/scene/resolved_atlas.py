"""Choice of an atlas size for a picture. The atlas is the square texture in which light is diffused.

On software adapters, where diffusion is slow, the size chosen here is the default.
"""

from __future__ import annotations

import math

import numpy as np

from dermis.mesh.geometry import cross_columns, dot_columns
from dermis.mesh.mesh import Mesh
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_ATLAS_TEXELS_PER_PIXEL = 1 / 3  # light in skin is smooth; shading reads normals and maps at each pixel
_FILLED_ATLAS_FRACTION = 0.5  # part of an atlas that shows skin
_MIN_ATLAS_SIDE = 1024  # coarser texels would blur the light of the narrowest profiles


def atlas_side_for_picture(scene: Scene, settings: Settings) -> int:
    """Return the side of the smallest atlas whose texels are at most as long as three pixels [texel].

    The atlas is the square texture in which light is diffused. Its side is a power of two, at least 1024 and
    at most the side in `settings`, even if texels are then longer. The lengths of pixels and texels on the
    skin are estimated from the height visible at the camera's target and from the area of the skin.
    """
    pixels_per_mm = settings.size[1] / scene.camera.frame_mm
    side = (
        _ATLAS_TEXELS_PER_PIXEL
        * pixels_per_mm
        * math.sqrt(_skin_area_mm2(scene.head.mesh) / _FILLED_ATLAS_FRACTION)
    )
    return min(1 << math.ceil(math.log2(max(side, _MIN_ATLAS_SIDE))), settings.atlas)


def _skin_area_mm2(mesh: Mesh) -> float:
    is_skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    a, b, c = mesh.positions.T[:, mesh.triangles[is_skin].T].swapaxes(0, 1)
    across = cross_columns(b - a, c - a)
    return float(0.5 * np.sqrt(dot_columns(across, across)).sum(dtype=np.float64))
