"""Which place of the head a pixel shows."""

from __future__ import annotations

import numpy as np

from dermis.mesh.head import Head
from dermis.scene.camera import Camera
from dermis.viewer.orbit import Floats, axes


def pick(head: Head, camera: Camera, x: float, y: float, aspect: float) -> Floats | None:
    """The place of the surface, relative to the head's centre [mm]; None beside the head.

    x, y : in the image, from -1 (left, bottom) to 1
    aspect : width of the image over its height

    Source: [MollerTrumbore1997].
    """
    right, up, forward = axes(camera)
    half = 0.5 * camera.frame_mm / float(np.linalg.norm(np.subtract(camera.target, camera.position)))
    ray = forward + half * (aspect * x * right + y * up)
    eye = np.array(camera.position) + head.centre_mm
    a, b, c = (head.mesh.positions[head.mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    e1, e2, s = b - a, c - a, eye - a
    p, q = np.cross(ray, e2), np.cross(s, e1)
    det = (e1 * p).sum(axis=1)
    meets = np.abs(det) > 1e-12
    inverse = 1.0 / np.where(meets, det, 1.0)
    u, v, t = (inverse * (pair[0] * pair[1]).sum(axis=1) for pair in ((s, p), (q, ray), (q, e2)))
    hit = meets & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    if not hit.any():
        return None
    return np.asarray(eye + t[hit].min() * ray - head.centre_mm)
