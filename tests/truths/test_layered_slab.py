"""Nested media of the path tracer on a flat slab, compared with the package's photon counter."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.mitsuba_scene import layer_interfaces, load_mitsuba, mitsuba_variant
from dermis.apps.truths.scene_description import mitsuba_rgb
from dermis.apps.truths.slab_mc import trace_medium
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS
from dermis.optics.media import published_media

pytest.importorskip("mitsuba")
RADII_MM = 0.6, 1.0, 3.0, 8.0
DISC_HEIGHT_MM = 0.012  # above the outermost surface, which is 0.005 mm above the skin
HALF_WIDTH_MM = 60.0
PATHS, PHOTONS = 120_000, 400_000
"""Standard errors of a total of 0.4: 0.35 % by paths and 0.2 % by photons."""


def cube() -> Mesh:
    """Return a cube whose faces are fans, so that its faces stay parallel when they are offset."""
    positions, triangles = [], []
    for axis, side in np.ndindex(3, 2):
        sign = 2 * side - 1
        square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, 0.0]])
        face = np.insert(square, axis, sign, axis=1)
        first = len(positions)
        turn = sign if axis != 1 else -sign
        for k in range(4):
            edge = (first + k, first + (k + 1) % 4)
            triangles.append((*(edge if turn > 0 else edge[::-1]), first + 4))
        positions.extend(face)
    points, point = np.unique(np.array(positions), axis=0, return_inverse=True)
    vertices = HALF_WIDTH_MM * points[point.ravel()]
    uv = 0.5 + 0.5 * vertices[:, :2] / HALF_WIDTH_MM
    return build_mesh(
        vertices, uv, np.array(triangles), np.zeros(len(triangles)), SKIN_MATERIALS, point=point.ravel()
    )


def disc_light(radius_mm: float, middle_mm: tuple[float, float, float]) -> dict[str, object]:
    """Return a disc just above the middle of a face of the slab that emits a radiance of 1 downwards."""
    mi = load_mitsuba()
    x, y, z = middle_mm
    place = mi.ScalarTransform4f().translate([x, y, z + DISC_HEIGHT_MM])
    return {
        "type": "disk",
        "to_world": place.rotate([1.0, 0.0, 0.0], 180.0).scale(radius_mm),
        "bsdf": {"type": "null"},
        "emitter": {"type": "area", "radiance": mitsuba_rgb((1.0, 1.0, 1.0))},
    }


def leaving_fractions() -> np.ndarray:
    """Return the light (k + 1, 3) that leaves within each radius and in all, for a beam at normal incidence.

    Paths start at a camera above the middle of the slab; those that leave within the radius meet the disc.
    """
    mi, head = load_mitsuba(), Head("slab", cube(), Maps())
    medium = published_media()["dj3"].with_eta(1.0)
    found = []
    with mitsuba_variant(mi, "scalar_rgb"):
        shapes, _ = layer_interfaces(mi, head, medium)
        x, y, top = np.array([0.0, 0.0, HALF_WIDTH_MM]) - head.centre_mm
        camera = {
            "type": "perspective",
            "fov": 0.001,
            "to_world": mi.ScalarTransform4f().look_at([x, y, 500.0], [x, y, top], [0.0, 1.0, 0.0]),
            "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
        }
        sky = {"type": "constant", "radiance": mitsuba_rgb((1.0, 1.0, 1.0))}
        for light in (*(disc_light(radius, (x, y, top)) for radius in RADII_MM), sky):
            scene = mi.load_dict(
                {
                    "type": "scene",
                    "integrator": {"type": "volpathmis", "rr_depth": 100, "hide_emitters": True},
                    "sensor": camera,
                    "light": light,
                    **shapes,
                }
            )
            found.append(np.array(mi.render(scene, spp=PATHS, seed=len(found)))[0, 0, :3])
    return np.array(found)


def test_nested_layers_agree_with_photon_counts() -> None:
    paths = leaving_fractions()
    edges = np.array([0.0, *RADII_MM])
    runs = trace_medium(published_media()["dj3"].with_eta(1.0), PHOTONS, edges_mm=edges)
    rings = np.array([run.reflectance * np.pi * np.diff(edges**2) for run in runs])
    total = np.array([run.total_reflectance for run in runs])
    np.testing.assert_allclose(paths[-1], total, rtol=0.01)
    np.testing.assert_allclose(paths[:-1] / total, (np.cumsum(rings, axis=1) / total[:, None]).T, atol=0.02)
