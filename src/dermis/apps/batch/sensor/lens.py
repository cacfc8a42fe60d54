"""Lens distortion by the model of OpenCV: radial and tangential, with forward and inverse maps."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.quantities import checked_array
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel

_MAX_VALUE = 1e9
_MAX_NEWTON_STEPS = 60
_MAX_RESIDUAL = 1e-10  # in the plane at distance 1
_FOLD_MARGIN = 0.98  # fraction of the radius at which the distortion folds the picture
_Radial = Annotated[float, Field(ge=-5, le=5), BoundsReason("as OpenCV's calibration finds them")]
_Tangential = Annotated[float, Field(ge=-0.1, le=0.1), BoundsReason("lenses are centred better")]


class Lens(FrozenModel):
    """Distortion of a lens, with the coefficients of OpenCV. The defaults are a pinhole.

    A point at (x, y) in the plane at distance 1 in front of the camera, with r² = x² + y², is imaged at
    x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²) and
    y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y.

    Examples
    --------
    >>> from dermis.dataset import Lens
    >>> Lens(k1=-0.2).distort([[0.5, 0.0]]).tolist()
    [[0.475, 0.0]]
    """

    k1: _Radial = 0.0
    """Coefficient of r²: below 0 barrel distortion, above 0 pincushion distortion."""
    k2: _Radial = 0.0
    """Coefficient of r⁴."""
    p1: _Tangential = 0.0
    """First tangential coefficient."""
    p2: _Tangential = 0.0
    """Second tangential coefficient."""
    k3: _Radial = 0.0
    """Coefficient of r⁶."""

    @property
    def fold_radius(self) -> float:
        """Return the largest radius r up to which the radial distortion is increasing; may be infinite."""
        roots = np.roots([7.0 * self.k3, 5.0 * self.k2, 3.0 * self.k1, 1.0])
        squares = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
        return float(np.sqrt(min(squares))) if squares else np.inf

    def distort(self, points: ArrayLike) -> Doubles:
        """Return the images (..., 2) of points in the plane at distance 1.

        Points beyond the radius where the distortion would fold the picture are NaN. Source: [Brown1966].

        Parameters
        ----------
        points : array_like
            (..., 2) coordinates x to the right and y down.

        Returns
        -------
        ndarray
            (..., 2) distorted coordinates.
        """
        x, y = np.moveaxis(np.asarray(points, np.float64), -1, 0)
        square = x**2 + y**2
        radial = 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))
        distorted_x = x * radial + 2.0 * self.p1 * x * y + self.p2 * (square + 2.0 * x**2)
        distorted_y = y * radial + self.p1 * (square + 2.0 * y**2) + 2.0 * self.p2 * x * y
        distorted = np.stack([distorted_x, distorted_y], axis=-1)
        return np.where((np.sqrt(square) < _FOLD_MARGIN * self.fold_radius)[..., None], distorted, np.nan)

    def undistort(self, points: ArrayLike) -> Doubles:
        """Return the points (..., 2) in the plane at distance 1 whose images are given, by Newton's method.

        Parameters
        ----------
        points : array_like
            (..., 2) distorted coordinates.

        Returns
        -------
        ndarray
            (..., 2) coordinates; NaN where the lens images no point.
        """
        targets = np.asarray(points, np.float64)
        found = targets.copy()
        with np.errstate(all="ignore"):  # points that do not converge become NaN
            for _ in range(_MAX_NEWTON_STEPS):
                residual = self.distort(found) - targets
                if np.nanmax(np.abs(residual), initial=0.0) < _MAX_RESIDUAL:
                    break
                found = found - self._newton_step(found, residual)
            valid = np.abs(self.distort(found) - targets).max(axis=-1) < _MAX_RESIDUAL
        return np.where(valid[..., None], found, np.nan)

    def distort_pixels(self, pixels: ArrayLike, K: ArrayLike) -> Doubles:
        """Return the pixels (..., 2) of a picture with distortion for those of a pinhole with the same K.

        Parameters
        ----------
        pixels : array_like
            (..., 2) pixels, x to the right and y down.
        K : array_like
            (3, 3) intrinsic matrix [pixel].

        Returns
        -------
        ndarray
            (..., 2) pixels; NaN where the distortion would fold the picture.
        """
        return to_pixels(self.distort(to_plane(pixels, K)), K)

    def undistort_pixels(self, pixels: ArrayLike, K: ArrayLike) -> Doubles:
        """Return the pixels (..., 2) of a pinhole with the same K for those of a picture with distortion.

        Parameters
        ----------
        pixels : array_like
            (..., 2) pixels, x to the right and y down.
        K : array_like
            (3, 3) intrinsic matrix [pixel].

        Returns
        -------
        ndarray
            (..., 2) pixels; NaN where the lens images no point.
        """
        return to_pixels(self.undistort(to_plane(pixels, K)), K)

    def _newton_step(self, points: Doubles, residual: Doubles) -> Doubles:
        x, y = np.moveaxis(points, -1, 0)
        square = x**2 + y**2
        radial = 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))
        slope = 2.0 * (self.k1 + square * (2.0 * self.k2 + 3.0 * square * self.k3))
        xx = radial + slope * x**2 + 2.0 * self.p1 * y + 6.0 * self.p2 * x
        xy = slope * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        yy = radial + slope * y**2 + 6.0 * self.p1 * y + 2.0 * self.p2 * x
        dx, dy = np.moveaxis(residual, -1, 0)
        steps = np.stack([yy * dx - xy * dy, xx * dy - xy * dx], axis=-1)
        return np.asarray(steps / (xx * yy - xy**2)[..., None])


def view_scale(lens: Lens, K: Doubles, picture_size: tuple[int, int]) -> float:
    """Return the size of the pinhole picture that a picture with distortion shows, relative to its own.

    It is the larger of `view_scales`.
    """
    return max(view_scales(lens, K, picture_size))


def view_scales(lens: Lens, K: Doubles, picture_size: tuple[int, int]) -> tuple[float, float]:
    """Return the relative width and height of the pinhole picture that contains a picture with distortion.

    Its principal point is in its middle.

    K : intrinsic matrix of the picture with distortion [pixel]
    picture_size : width and height [pixel]

    Raises DermisError if the lens cannot image the corners of the picture.
    """
    width, height = picture_size
    x, y = np.arange(-1.0, width + 1.0), np.arange(-1.0, height + 1.0)  # a border of one pixel
    sides = [np.stack(np.broadcast_arrays(x, end), -1) for end in (-1.0, float(height))]
    sides += [np.stack(np.broadcast_arrays(end, y), -1) for end in (-1.0, float(width))]
    seen = lens.undistort_pixels(np.concatenate(sides), K)
    if not np.isfinite(seen).all():
        corner = float(np.linalg.norm(to_plane([-1.0, -1.0], K)))
        expected = f"a lens that images the corners of the picture, at r = {corner:.3g}"
        advice = "Bring k1, k2 and k3 closer to 0, or show a smaller angle"
        refuse("lens", expected, f"its distortion folds the picture at r = {lens.fold_radius:.3g}", advice)
    scale_x, scale_y = (np.abs(seen - K[:2, 2]) / (0.5 * np.array([width, height]))).max(axis=0).tolist()
    return scale_x, scale_y


def to_plane(pixels: ArrayLike, K: ArrayLike) -> Doubles:
    """Return the points (..., 2) in the plane at distance 1 of pixels (..., 2)."""
    matrix = checked_array("K", K, (3, 3), -_MAX_VALUE, _MAX_VALUE)
    return np.asarray((np.asarray(pixels, np.float64) - matrix[:2, 2]) / np.diag(matrix)[:2])


def to_pixels(points: ArrayLike, K: ArrayLike) -> Doubles:
    """Return the pixels (..., 2) of points (..., 2) in the plane at distance 1."""
    matrix = checked_array("K", K, (3, 3), -_MAX_VALUE, _MAX_VALUE)
    return np.asarray(np.asarray(points, np.float64) * np.diag(matrix)[:2] + matrix[:2, 2])
