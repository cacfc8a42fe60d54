"""Screen-space scattering: against NumPy, closed forms, and without leaks."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import FLAT, TWIN

from dermis.frame.techniques.screen_space import (
    draw,
    kernel_integral_table,
    make_kernel,
    make_subsurface_layers,
)
from dermis.gpu import CommandList, Device, download, make_texture, upload
from dermis.optics.fits.separable import SeparableKernel, preintegrated_kernel
from dermis.optics.profiles import load_profile
from dermis.scene.camera import ImageRectangle

Floats = NDArray[np.float64]
PROFILE = load_profile("gpu-gems-3")
KERNEL = preintegrated_kernel(PROFILE)
TABLE, REACH = kernel_integral_table(KERNEL)
TAPS, STEEPEST = 16, 4.0


class View(NamedTuple):
    """Camera: tangents of the half angles, and the size of the picture."""

    half: tuple[float, float]
    size: tuple[int, int]

    @classmethod
    def over(cls, width_mm: float, depth_mm: float, side: int) -> View:
        """Return a square picture of part of a plane that faces the camera."""
        return cls((0.5 * width_mm / depth_mm,) * 2, (side, side))

    def places(self, depth: Floats) -> Floats:
        """Return (h, w, 3) positions in camera space [mm]."""
        width, height = self.size
        y, x = np.indices(depth.shape)
        right = (2 * (x + 0.5) / width - 1) * self.half[0]
        up = (1 - 2 * (y + 0.5) / height) * self.half[1]
        return np.asarray(depth[..., None] * np.stack([right, up, np.ones(depth.shape)], axis=-1))


def spread(device: Device, view: View, light: Floats, depth: Floats) -> Floats:
    """Return (h, w, 3) light after both passes, with a transmittance of 1 and no other light."""
    apart = make_subsurface_layers(device, view.size)
    upload(device, apart.layers, np.dstack([light, depth]), layer=0)
    upload(device, apart.layers, np.ones((*depth.shape, 4)), layer=1)
    over, frame = make_texture(device, view.size, "rgba32float"), CommandList(device)
    result = draw(frame, apart, make_kernel(device, PROFILE), ImageRectangle(view.half, (0.0, 0.0)), over)
    frame.submit()
    return download(device, result)[..., :3].astype(float)


def share_within(distance: float) -> Floats:
    """Interpolate the table of the stage."""
    at = (TABLE.shape[1] - 1) * np.sqrt(min(distance / REACH, 1.0))
    low = min(int(at), TABLE.shape[1] - 2)
    return np.asarray(TABLE[0, low, :3] + (at - low) * (TABLE[0, low + 1, :3] - TABLE[0, low, :3]))


def twin_side(
    view: View, places: Floats, light: Floats, here: tuple[int, int], step: tuple[int, int]
) -> Floats:
    """Return the light from one side of a pixel.

    places : (h, w, 3) positions of the pixels in camera space, 0 without skin
    """
    depth = places[..., 2]
    pixel = float(
        depth[here] * (2 * view.half[0] / view.size[0] if step[1] else 2 * view.half[1] / view.size[1])
    )
    taps, before = [(here, 0.0, 0.5 * pixel)], 0  # pixel, distance, half the way from the tap before
    for k in range(1, TAPS + 1):
        n = max(k, round(REACH / pixel * (k / TAPS) ** 2))
        y, x = here[0] + n * step[0], here[1] + n * step[1]
        if not (0 <= y < depth.shape[0] and 0 <= x < depth.shape[1]):
            break
        away = float(np.linalg.norm(places[here] - places[y, x]))
        taps.append(((y, x), away, 0.5 * pixel * (n - before)))
        before = n
    near, far = [0.0], []  # what each tap stands for
    for (one, at, _), (other, away, half) in pairwise(taps):
        joined = min(depth[one], depth[other]) > 0 and at < away <= at + 2 * STEEPEST * half
        far.append(0.5 * (at + away) if joined else at + half)
        near.append(0.5 * (at + away) if joined else max(away - half, 0.0))
    far.append(taps[-1][1] + taps[-1][2])
    shares = [
        (share_within(b) - share_within(a)) * (depth[pixel] > 0)
        for (pixel, *_), a, b in zip(taps, near, far, strict=True)
    ]
    total = np.sum(shares, axis=0)
    seen = np.sum([share * light[tap[0]] for share, tap in zip(shares, taps, strict=True)], axis=0)
    return np.asarray(seen * np.minimum(0.5 / total, 1.0) + np.maximum(0.5 - total, 0.0) * light[here])


def twin(view: View, light: Floats, depth: Floats) -> Floats:
    """Return the result of both passes, along rows and then along columns."""
    places = view.places(depth)
    for step in ((0, 1), (1, 0)):
        back, source, light = (-step[0], -step[1]), light, light.copy()
        for y, x in np.argwhere(depth > 0):
            sides = (twin_side(view, places, source, (y, x), way) for way in (step, back))
            light[y, x] = sum(sides)
    return light


def rough_depth(size: tuple[int, int]) -> Floats:
    """Return a wavy surface with a step in depth and holes."""
    rng = np.random.default_rng(3)
    y, x = np.indices(size[::-1])
    depth = 400 + 2 * np.sin(x / 5) + 3 * np.cos(y / 3) + np.where(x > size[0] // 2, 12.0, 0.0)
    return np.where(rng.random(depth.shape) < 0.1, 0.0, depth).astype(np.float32).astype(float)


@pytest.mark.parametrize("width_mm", [4.0, 24.0, 150.0])
def test_screen_space_blur_matches_numpy(device: Device, width_mm: float) -> None:
    """Compare close by, where taps are far apart; at a portrait's distance; and far away."""
    view = View((0.5 * width_mm / 400, 0.5 * width_mm / 400 * 20 / 28), (28, 20))
    depth = rough_depth(view.size)
    light = np.random.default_rng(4).random((*depth.shape, 3)).astype(np.float32) * (depth > 0)[..., None]
    made = spread(device, view, light.astype(float), depth)
    assert np.abs(made - twin(view, light.astype(float), depth)).max() < TWIN


@pytest.mark.parametrize("width_mm", [4.0, 24.0, 150.0])
def test_even_light_stays_even(device: Device, width_mm: float) -> None:
    """Uniform light stays uniform on a plane and on any other skin, up to the rims of holes."""
    view = View.over(width_mm, 400.0, 48)
    for depth in (np.full((48, 48), 400.0), rough_depth(view.size)):
        made = spread(device, view, (depth > 0)[..., None] * np.array([1.0, 0.3, 2.7]), depth)
        assert np.abs(made[depth > 0] / [1.0, 0.3, 2.7] - 1).max() < FLAT
        assert not made[depth == 0].any()


def test_sample_table_matches_the_kernel() -> None:
    """Interpolated values agree too; the light beyond the reach, less than 0.1 %, is added within it."""
    for distance in np.geomspace(1e-3, REACH, 40):
        assert np.abs(share_within(distance) - KERNEL.half_line_integral(distance)).max() < 6e-4
    assert (share_within(REACH) == 0.5).all()
    assert np.allclose(KERNEL.half_line_integral(1e3), 0.5)


def across(kernel: SeparableKernel, pixel_mm: float, side: int) -> Floats:
    """Return the (side, side, 3) light from the middle pixel: the kernel integrated over pixels."""
    edges = (np.arange(side + 1) - side // 2 - 0.5) * pixel_mm
    line = np.diff(kernel.half_line_integral(edges), axis=0)
    return np.asarray(line[:, None] * line[None, :])


@pytest.mark.parametrize("pixel_mm", [0.45, 1.0])
def test_point_of_light_spreads_as_the_profile(device: Device, pixel_mm: float) -> None:
    """With taps on neighbouring pixels each gets the light of the kernel, and nothing is lost."""
    side = 63
    view = View.over(side * pixel_mm, 500.0, side)
    light = np.zeros((side, side, 3))
    light[31, 31] = 1.0
    made = spread(device, view, light, np.full((side, side), 500.0))
    exact = across(KERNEL, pixel_mm, side)
    assert np.abs(made - exact).max() < 1e-3 * exact.max()
    assert np.abs(made.sum(axis=(0, 1)) - 1).max() < 2e-3


@pytest.mark.parametrize("pixel_mm", [0.05, 0.1, 0.2])
def test_close_spot_of_light_spreads_as_the_profile(device: Device, pixel_mm: float) -> None:
    """A spot of sigma 1 mm under taps up to 0.8 mm apart: energy and shape against the analytic sum."""
    side = int(20.0 / pixel_mm) | 1
    view = View.over(side * pixel_mm, 500.0, side)
    axis = (np.arange(side) - side // 2) * pixel_mm
    x, y = np.meshgrid(axis, axis)
    bell = np.exp(-0.5 * (x**2 + y**2))
    made = spread(device, view, np.repeat(bell[..., None], 3, axis=2), np.full(bell.shape, 500.0))
    wide = KERNEL.variance_mm2[:, 0] + 1.0
    line = (
        KERNEL.weight[:, None]
        * (np.exp(-(axis**2) / (2 * wide[:, None])) / np.sqrt(wide)[:, None])[..., None]
    ).sum(0)
    exact = line[:, None] * line[None, :]
    assert np.abs(made - exact).max() < 0.01 * exact.max()
    assert np.abs(made.sum(axis=(0, 1)) / exact.sum(axis=(0, 1)) - 1).max() < 0.01


def test_line_of_light_follows_the_line_profile(device: Device) -> None:
    """The separable kernel is exact for a line of light."""
    profile, pixel_mm, side = load_profile("gpu-gems-3"), 0.45, 63
    light = np.zeros((side, side, 3))
    light[:, 31] = 1.0 / pixel_mm
    made = spread(device, View.over(side * pixel_mm, 500.0, side), light, np.full((side, side), 500.0))
    edges = (np.arange(side + 1) - 31.5) * pixel_mm
    y = np.linspace(-40, 40, 8001)
    fine = np.linspace(0.0, 12.0, 241)
    line = profile.radiant_exitance(np.hypot(fine[:, None], y)).sum(axis=1) * (y[1] - y[0]) / profile.albedo
    middle = 0.5 * (edges[1:] + edges[:-1])
    exact = np.stack([np.interp(np.abs(middle), fine, channel) for channel in line.T], axis=1)
    off = np.abs(middle) > 1.0  # nearer, a pixel is not its middle
    assert np.abs(made[31] - exact)[off & (np.abs(middle) < 12)].max() < 0.01 * exact[off].max()


def test_tilted_skin_spreads_as_far_on_its_surface(device: Device) -> None:
    """On a plane turned by 60 degrees about the vertical, the width of a stripe is measured on the plane."""
    side, tilt = 201, np.radians(60.0)
    view = View.over(40.0, 5000.0, side)
    slope = (2 * (np.arange(side) + 0.5) / side - 1) * view.half[0]
    depth = np.repeat((5000.0 / (1 - slope * np.tan(tilt)))[None], side, axis=0)
    places = view.places(depth)[side // 2]
    along = np.linalg.norm(places - places[side // 2], axis=-1) * np.sign(np.arange(side) - side // 2)
    bell = np.exp(-0.5 * (along / 2.0) ** 2)
    light = np.repeat(np.repeat(bell[None, :, None], side, axis=0), 3, axis=2)
    made = spread(device, view, light, depth)[side // 2]
    wide = KERNEL.variance_mm2[:, 0] + 4.0
    exact = (
        KERNEL.weight[None] * (np.exp(-(along[:, None] ** 2) / (2 * wide)) * np.sqrt(4.0 / wide))[..., None]
    ).sum(1)
    flat = (KERNEL.weight[None] * bell[:, None, None]).sum(1)
    assert np.abs(made - exact).max() < 0.01
    assert np.abs(flat - exact).max() > 0.1  # which separates skin from background


@pytest.mark.parametrize(("gap_mm", "leak"), [(20.0, 0.0), (8.0, 2e-4), (4.0, 0.02)])
def test_light_stays_on_its_own_surface(device: Device, gap_mm: float, leak: float) -> None:
    """A lit surface before a dark one leaks only what the straight distance between them allows."""
    side = 64
    view = View.over(side * 0.25, 500.0, side)
    front = np.arange(side) < 32
    depth = np.repeat(np.where(front, 500.0, 500.0 + gap_mm)[None], side, axis=0)
    light = np.repeat(np.repeat(front.astype(float)[None, :, None], side, axis=0), 3, axis=2)
    made = spread(device, view, light, depth)[32]
    assert made[32:].max() <= leak + 1e-6
    assert (1 - made[:32]).max() <= leak + 1e-6


@pytest.mark.parametrize("gap_mm", [2.0, 90.0])
def test_light_passes_a_slit(device: Device, gap_mm: float) -> None:
    """A pixel that shows a dark background takes no light from the skin on its sides."""
    side, middle = 64, 32
    view = View.over(side * 0.1, 500.0, side)
    x = np.broadcast_to(np.arange(side), (side, side))
    light = np.repeat((x > middle).astype(float)[..., None], 3, axis=2)
    whole, slit = np.full((side, side), 500.0), np.where(x == middle, 500.0 + gap_mm, 500.0)
    closed, open_ = (spread(device, view, light, depth)[middle] for depth in (whole, slit))
    dark = slice(middle - 8, middle)
    assert closed[dark, 0].min() > 0.1
    assert np.abs(open_ - closed)[dark].max() < 0.01


def test_other_materials_do_not_exchange_light(device: Device) -> None:
    """Pixels without skin (depth 0) may hold anything."""
    side = 48
    view = View.over(side * 0.25, 500.0, side)
    depth = np.full((side, side), 500.0)
    depth[20:28, 20:28] = 0.0
    rng = np.random.default_rng(1)
    light = rng.random((side, side, 3))
    marked = np.where((depth > 0)[..., None], light, 100.0)
    one, other = (spread(device, view, source, depth) for source in (light, marked))
    assert np.array_equal(one[depth > 0], other[depth > 0])


def test_rings_of_the_separable_kernel(device: Device) -> None:
    """Against the radial profile, within 1 mm of a point of light the kernel, a cross, lacks 6 % of red."""
    profile, pixel_mm, side = load_profile("gpu-gems-3"), 0.45, 63
    light = np.zeros((side, side, 3))
    light[31, 31] = 1.0
    view = View.over(side * pixel_mm, 500.0, side)
    made = spread(device, view, light, np.full((side, side), 500.0))
    y, x = np.indices((side, side)) - 31
    radius = np.hypot(x, y) * pixel_mm
    found = np.array([made[radius <= r].sum(axis=0) for r in (1.0, 2.0, 3.0, 5.0, 8.0)])
    exact = profile.energy_within([1.0, 2.0, 3.0, 5.0, 8.0]) / profile.albedo
    assert np.abs(found - exact).max() < 0.07
    assert np.abs(found - exact)[1:].max() < 0.01  # from 2 mm on
