"""Regions of a picture of a person, by part of the face and by lighting, for tables of errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import Estimate, energy_ratio
from dermis.apps.validation.comparisons.person import PersonComparison
from dermis.base.tables import float_columns, read_rows
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import surface_points
from dermis.human.skin.surface import painted_surface
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
ZONES_BY_REGION: dict[str, tuple[str, ...]] = {
    "forehead": ("forehead", "side of the forehead", "glabella", "temple"),
    "cheek": ("apple of the cheek", "cheek", "cheekbone", "jaw", "beside the mouth"),
    "nose side": ("wing of the nose", "inner cheek", "nasolabial"),
    "nose": ("nose", "tip of the nose", "bridge of the nose"),
    "chin": ("chin", "below the lip", "above the lip", "jaw in front"),
    "ear": ("ear", "rim of the ear", "lobe"),
    "neck": ("throat", "neck", "nape", "breast", "shoulder"),
    "scalp": ("scalp", "crown"),
}
"""Zones of human/skin/zones.csv that form each region of the skin."""
_LID_RANGE_MM = -0.6, 7.0  # distances from the edges of the lids
_RIM_COSINE, _TERMINATOR_COSINE = 0.35, 0.2
_LIPS_COLUMN, _LIDS_COLUMN = 8, 10  # columns of `PaintedSurface.vertices`
_POSITION_COLUMNS, _MIN_REGION_PIXELS = slice(2, 5), 12


@dataclass(frozen=True, eq=False)
class Regions:
    """Masks (h, w) of the pixels of each region, by name."""

    masks: dict[str, Mask]

    def light_ratios(self, comparison: PersonComparison) -> dict[str, Estimate]:
        """Return the light in the frame divided by that in the reference, for each region [-].

        Regions with few pixels are left out.
        """
        found = {}
        for name, mask in self.masks.items():
            inside = mask & comparison.mask
            if inside.sum() >= _MIN_REGION_PIXELS:
                found[name] = energy_ratio(comparison.ours, comparison.reference, inside, comparison.variance)
        return found


def picture_regions(renderer: Renderer, scene: Scene, picture_side: int) -> Regions:
    """Return the regions of the skin that a square picture of a parametric human shows.

    Most regions are parts of the head, such as "nose". The region "rim" is skin seen at a grazing angle. In
    "lit side", skin faces the first light of the scene; in "shadowed side", it faces away; "terminator" is
    the skin in between.

    picture_side : side of the picture [pixel]
    """
    head, mesh = scene.head, scene.head.mesh
    visible = surface_points(
        renderer, scene, Settings(size=(picture_side, picture_side), atlas=256, samples=1)
    )
    corners = mesh.triangles[visible.triangle]
    on_skin = np.array([one.kind == "skin" for one in mesh.materials])[mesh.material[visible.triangle]]
    attributes = painted_surface(mesh, head.control_rig.stencils).vertices.astype(np.float64)
    placed, normals, positions = (
        np.einsum("nk,nkc->nc", visible.barycentric, values[corners])
        for values in (attributes, mesh.normals.astype(np.float64), mesh.positions.astype(np.float64))
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lips = placed[:, _LIPS_COLUMN] > 0.0
    lids = (placed[:, _LIDS_COLUMN] > _LID_RANGE_MM[0]) & (placed[:, _LIDS_COLUMN] < _LID_RANGE_MM[1])
    zone = _nearest_zone(placed[:, _POSITION_COLUMNS])
    found = {name: on_skin & (zone == k) & ~lips & ~lids for k, name in enumerate(ZONES_BY_REGION)}
    found |= {"lips": on_skin & lips, "lids": on_skin & lids, "eyes and mouth": ~on_skin}
    centre = np.array(head.centre_mm)
    facing = _cosines_to_normals(normals, np.array(scene.camera.position) + centre - positions)
    found["rim"] = on_skin & (facing < _RIM_COSINE)
    if scene.lights:
        key = np.array(getattr(scene.lights[0], "position", (0.0, 0.0, 0.0))) + centre
        cosine = _cosines_to_normals(normals, key - positions)
        found["lit side"] = on_skin & (cosine > _TERMINATOR_COSINE)
        found["terminator"] = on_skin & (np.abs(cosine) <= _TERMINATOR_COSINE)
        found["shadowed side"] = on_skin & (cosine < -_TERMINATOR_COSINE)
    return Regions({name: _picture_mask(visible.mask, inside) for name, inside in found.items()})


def _nearest_zone(positions_mm: Floats) -> NDArray[np.int64]:
    """Return the index (n,) of the region in `ZONES_BY_REGION` to which each point belongs.

    A region consists of ellipsoidal zones. A point belongs to the region of the zone whose centre is nearest;
    distances are divided by the radii of the zone.

    positions_mm : (n, 3) points
    """
    rows = {row["zone"]: row for row in read_rows("dermis.human.skin", "zones")}
    mirrored = np.abs(positions_mm[:, :1])
    points = np.concatenate([mirrored, positions_mm[:, 1:]], axis=1)
    distances = []
    for names in ZONES_BY_REGION.values():
        zones = [rows[name] for name in names]
        centres, radii = float_columns(zones, "x y z"), float_columns(zones, "rx ry rz")
        distances.append((((points[:, None] - centres) / radii) ** 2).sum(axis=-1).min(axis=1))
    return np.asarray(np.argmin(distances, axis=0))


def _cosines_to_normals(normals: Floats, directions: Floats) -> Floats:
    return np.asarray((normals * directions).sum(axis=1) / np.linalg.norm(directions, axis=1))


def _picture_mask(visible_pixels: Mask, region_points: Mask) -> Mask:
    mask = np.zeros(visible_pixels.shape, bool)
    mask[visible_pixels] = region_points
    return mask
