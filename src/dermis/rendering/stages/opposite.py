"""What lies opposite each place of the surface through the flesh; found once for a mesh and an atlas."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.mesh import Mesh
from dermis.assets.smooth_normals import smooth_normals
from dermis.assets.triangle_grid import build_grid
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.program import Resources
from dermis.rendering.stages import SHARED_SHADERS, STAGES

FORM = "8"
"""Differs when finding gives other results."""
_JUDGED = 0.7  # of the widest one is the Gaussian that judges: its few rays step less for those that matter
_CREASE_MM = 1.0  # over which normals are smoothed: in a crease thick and thin would meet without it
_REACH = 4.0  # standard deviations of the widest Gaussian: a three-thousandth of it passes
_WIDEST_MM = 10.0  # rays through wax, which spreads light farther, would take minutes


class Opposite:
    """Follows rays into the flesh around each texel, spread like a Gaussian.

    The shader is compiled when it is first wanted.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program: ComputeProgram | None = None

    def find(self, mesh: Mesh, geometry: Resources, atlas: Any, side: int, widest_mm: float) -> Any:
        """A texture of side x side of the atlas' texels: place there, thickness, distances to the rim.

        geometry : triangle_table and vertex_table
        widest_mm : standard deviation of the widest Gaussian; it sees four of them far, 40 mm at most [mm]
        """
        path = STAGES / "opposite.wgsl"
        self._program = self._program or ComputeProgram(self._device, path, (SHARED_SHADERS,))
        cells = build_grid(mesh)
        found = make_texture(self._device, (side, side), "rgba32uint")
        grid = self._program.record(
            "Grid",
            low=cells.low,
            cell_mm=cells.cell_mm,
            size=(*cells.size, 0),
            limit_mm=_REACH * min(widest_mm, _WIDEST_MM),
            sigma_mm=_JUDGED * min(widest_mm, _WIDEST_MM),
            side=side,
        )
        bound = {
            **geometry,
            "grid": grid,
            "first": self._device.buffer(cells.first, "STORAGE"),
            "listed": self._device.buffer(np.append(cells.triangle, np.uint32(0)), "STORAGE"),
            "atlas": atlas,
            "normals": self._device.buffer(_padded(smooth_normals(mesh, _CREASE_MM**2)), "STORAGE"),
            "opposite": found,
        }
        frame = Frame(self._device)
        frame.compute("opposite", self._program, bound, (side, side))
        frame.submit()
        return found


def _padded(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.pad(vectors, ((0, 0), (0, 1))).astype(np.float32)
