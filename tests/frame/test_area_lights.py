"""Rectangles, spheres, suns and stripes: irradiance, and shadows that are sharp at contact."""

from __future__ import annotations

from typing import Any

import light_twins
import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from setups import entered_light, head_of, joined, place, probe, run_frame, scene_of, settings_of
from tolerances import AREA_LIGHT, LIT, TWIN
from twins import surface

from dermis.atlas.build import cached_atlas
from dermis.base.errors import DermisError
from dermis.frame.features.irradiance.irradiance import LIGHT_FILTER_SIGMA_TEXELS
from dermis.frame.features.shading.shade import shade_program
from dermis.frame.lights import records as light_module
from dermis.frame.lights.records import light_records, light_sample_points, light_shadow_views
from dermis.frame.lights.rectangle import KIND, facing_irradiance
from dermis.frame.programs import device_constants, pixel_column_constants
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.gpu.textures import texture_from_array
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.lights import DirectionalLight, Light, RectangleLight, SphereLight, StripeLight

Floats = NDArray[np.float64]
SIZE = 32
FLOOR = head_of(plane(200.0, 4))
PLATE = head_of(
    joined((plane(120.0, 6), (0, 0, 0), (0, 0, 0.7)), (plane(30.0, 2), (-15, 0, 12), (0.75, 0.75, 0.2)))
)


def above(head: Any, height: float, **given: Any) -> dict[str, Any]:
    """Return the fields of a light above the origin that faces it."""
    return {"position": place(head, (0, 0, height)), "target": place(head, (0, 0, 0)), **given}


def polygon_irradiance(corners: Floats, normal: Floats) -> float:
    """Return the irradiance from a uniform polygon of radiance 1 on a surface at the origin [-].

    The polygon is above the horizon. Source: Lambert's formula, as in [Baum1989].
    """
    unit = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    after = np.roll(unit, -1, axis=0)
    edge = np.cross(unit, after)
    angle = np.arctan2(np.linalg.norm(edge, axis=1), (unit * after).sum(axis=1))
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    return abs(0.5 * float((angle * (edge @ normal)).sum()))


def from_rectangle(size: tuple[float, float], place: Floats) -> float:
    """Return the irradiance from a rectangle at (0, 0, 0) that faces +z, at a point of a facing floor."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [0.5 * size[0], 0.5 * size[1], 0.0]
    return polygon_irradiance(corners - place, np.array([0.0, 0.0, 1.0]))


def test_irradiance_on_the_axis_matches_lambert() -> None:
    for width, height, distance in ((1.0, 1.0, 1.0), (3.0, 0.5, 2.0), (10.0, 20.0, 0.7)):
        exact = from_rectangle((width, height), np.array([0.0, 0.0, distance]))
        assert facing_irradiance(width, height, distance) == pytest.approx(exact, rel=1e-12)
    assert facing_irradiance(1e6, 1e6, 1.0) == pytest.approx(np.pi, rel=1e-4)


@pytest.mark.parametrize("size", [(40, 40), (300, 200), (100, 900)])
def test_parts_of_a_rectangle_add_up(size: tuple[float, float]) -> None:
    light = RectangleLight(position=(200, 300, 400), target=(0, 10, 0), width_mm=size[0], height_mm=size[1])
    parts = KIND.light_parts(light)
    assert all(isinstance(part, RectangleLight) for part in parts)
    area = sum(part.width_mm * part.height_mm for part in parts if isinstance(part, RectangleLight))
    assert area == pytest.approx(size[0] * size[1])
    middle = np.mean([part.position for part in parts if isinstance(part, RectangleLight)], axis=0)
    assert np.allclose(middle, light.position)
    assert len(parts) <= 9 and (len(parts) == 1) == (max(size) < 0.35 * np.sqrt(200**2 + 290**2 + 400**2))


def entered(renderer: Renderer, head: Any, light: Light) -> tuple[Floats, Floats]:
    """Return the irradiance of each texel, and the positions of the texels."""
    inputs = run_frame(renderer, scene_of(head, light, rho_s=0.0, mix=0.0), atlas=64)
    made = entered_light(renderer, inputs)[..., :3]
    return made, surface(cached_atlas(head.mesh, 64), head)[0]


@pytest.mark.parametrize("size", [(30, 30), (240, 60), (400, 400)])
def test_irradiance_of_a_rectangle_matches_quadrature(renderer: Renderer, size: tuple[float, float]) -> None:
    """Compare a floor below the light, from a height of 300 mm and up to 100 mm off its axis."""
    given = {"width_mm": size[0], "height_mm": size[1], "irradiance": (1.0, 2.0, 3.0), "shadows": False}
    made, points = entered(renderer, FLOOR, RectangleLight(**above(FLOOR, 300.0, **given)))
    radiance = np.array([1.0, 2.0, 3.0]) / facing_irradiance(*size, 300.0)
    picked = [(y, x) for y in (2, 20, 31, 60) for x in (3, 32, 44, 61)]
    exact = [radiance * from_rectangle(size, points[at] - [0.0, 0.0, 300.0]) for at in picked]
    assert np.abs([made[at] for at in picked] - np.array(exact)).max() < AREA_LIGHT * np.max(exact)


@pytest.mark.parametrize("radius", [5.0, 80.0, 200.0])
def test_irradiance_of_a_sphere_matches_the_closed_form(renderer: Renderer, radius: float) -> None:
    """Compare with pi (r / d)^2 times the cosine, for spheres above the horizon."""
    made, points = entered(
        renderer, FLOOR, SphereLight(**above(FLOOR, 300.0, radius_mm=radius, shadows=False))
    )
    d2 = points[..., 0] ** 2 + points[..., 1] ** 2 + 300.0**2
    exact = 3.14 * 300.0**2 / d2 * 300.0 / np.sqrt(d2)
    assert np.abs(made[..., 0] - exact).max() < AREA_LIGHT * exact.max()


@pytest.fixture
def fine_sampling(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sample area lights as on GPUs: by 4 x 4 points and 64 shadow rays."""
    monkeypatch.setattr(light_module, "_SOFTWARE_SAMPLING", light_module._GPU_SAMPLING)


@pytest.mark.usefixtures("fine_sampling")
@pytest.mark.parametrize("part", [0, 3, 6, 15])
@pytest.mark.parametrize("kind", ["rectangle", "sphere"])
def test_visible_parts_match_numpy(renderer: Renderer, kind: str, part: int) -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-80, 80, (SIZE, SIZE, 3)).astype(np.float32)
    given = {"position": (150.0, 120.0, 260.0), "irradiance": (1.0, 2.0, 3.0), "shadows": False}
    light = {
        "rectangle": RectangleLight(**given, width_mm=60, height_mm=90),
        "sphere": SphereLight(**given, radius_mm=120),
    }[kind]
    inputs = run_frame(renderer, scene_of(FLOOR, light))
    textures = {
        name: texture_from_array(renderer.device, np.dstack([values, np.ones((SIZE, SIZE))]), "rgba32float")
        for name, values in {"points": points, "normals": np.broadcast_to([0, 0, 1.0], points.shape)}.items()
    }
    towards, arriving = probe(
        renderer.device,
        "light_probe",
        (SIZE, SIZE),
        ["towards", "arriving"],
        inputs.light_constants,
        **inputs.bindings,
        **textures,
        part={"index": part},
    )
    direction, irradiance = light_twins.part_of(
        inputs.bindings["lights"]["light"][0], points.astype(float), part
    )
    assert np.abs(towards[..., :3] - direction).max() < TWIN
    assert np.abs(arriving[..., :3] - irradiance).max() < TWIN * irradiance.max()
    assert (towards[..., 3] == 1).all()


def test_stripe_has_the_given_width(renderer: Renderer, close: float) -> None:
    """Expect 1/e^2 of the centre at half the width, and nothing beyond the ends, averaged over texels."""
    light = StripeLight(
        direction=(0, 0, -1),
        position=place(FLOOR, (10, 0, 0)),
        width_mm=24,
        length_mm=100,
        irradiance=(2, 2, 2),
        shadows=False,
    )
    made, points = entered(renderer, FLOOR, light)
    # As given, and as texels hold it.
    variance = np.array([6.0**2, 6.0**2 + (LIGHT_FILTER_SIGMA_TEXELS * 200 / 64) ** 2])
    exact = 2 * np.sqrt(variance[0] / variance[1]) * np.exp(-0.5 * (points[..., 0] - 10) ** 2 / variance[1])
    exact *= np.abs(points[..., 1]) < 50
    inside = np.abs(np.abs(points[..., 1]) - 50) > 3
    assert np.abs(made[..., 0] - exact)[inside].max() < close * 2


def visibility(
    renderer: Renderer, head: Any, light: Light, size: int = 1024, normal: ArrayLike = (0, 0, 1)
) -> tuple[Floats, Floats]:
    """Return positions along the middle of the floor on x, and the visibility of the light at each."""
    scene = scene_of(head, light)
    views = light_shadow_views(scene, scene.head.mesh.outline, size)
    inputs = run_frame(renderer, scene, shadow_size=size)
    x = np.linspace(-55, 55, 4 * SIZE * SIZE // 4).astype(np.float32).reshape(SIZE, SIZE)
    points = np.dstack([x, np.zeros_like(x), np.zeros_like(x), np.ones_like(x)])
    normals = np.broadcast_to(np.float32([*np.asarray(normal), 0]), points.shape)
    textures = {
        "points": texture_from_array(renderer.device, points, "rgba32float"),
        "normals": texture_from_array(renderer.device, normals, "rgba32float"),
    }
    seen = []
    records = light_records(shade_program(renderer.device), scene, views)
    for one in records["light"][: len(views)].copy():
        records["light"][0] = one
        towards, _ = probe(
            renderer.device,
            "light_probe",
            (SIZE, SIZE),
            ["towards", "arriving"],
            inputs.light_constants,
            **(inputs.bindings | {"lights": records}),
            **textures,
            part={"index": 0},
        )
        seen.append(towards[..., 3].ravel())
    return x.ravel().astype(float), np.mean(seen, axis=0)


@pytest.mark.parametrize("kind", ["rectangle", "sphere", "sun"])
def test_a_shadow_fades_as_the_light_is_wide(renderer: Renderer, kind: str) -> None:
    """A plate from x = -30 to 0 at 12 mm under a light 60 mm wide at 300 mm has a penumbra of 2.5 mm."""
    wide = 60.0 * 12.0 / (300.0 - 12.0)
    light: Light = {
        "rectangle": RectangleLight(**above(PLATE, 300.0, width_mm=60, height_mm=60, softness_mm=0.1)),
        "sphere": SphereLight(**above(PLATE, 300.0, radius_mm=30, softness_mm=0.1)),
        "sun": DirectionalLight(
            direction=(0, 0, -1), angle_degrees=2 * np.degrees(np.arctan(30 / 288)), softness_mm=0.1
        ),
    }[kind]
    x, seen = visibility(renderer, PLATE, light)
    right = x > -15
    fading = x[right][(seen[right] > 0.1) & (seen[right] < 0.9)]
    assert np.ptp(fading) == pytest.approx((0.8 if kind == "rectangle" else 0.69) * wide, abs=0.6)
    assert seen[(x > -25) & (x < -4)].max() < LIT
    assert seen[(x < -36) | (x > 4)].min() > 1 - LIT
    assert x[right][np.argmin(np.abs(seen[right] - 0.5))] == pytest.approx(0.0, abs=0.6)


@pytest.mark.parametrize("kind", ["rectangle", "sphere", "sun"])
def test_soft_visibility_matches_numpy(renderer: Renderer, kind: str) -> None:
    """Points in and above the shadow of a plate have their own normals; rounding decides at texel edges."""
    light: Light = {
        "rectangle": RectangleLight(**above(PLATE, 300.0, width_mm=70, height_mm=40)),
        "sphere": SphereLight(**above(PLATE, 300.0, radius_mm=30)),
        "sun": DirectionalLight(direction=(0.2, 0.1, -1), angle_degrees=8),
    }[kind]
    rng = np.random.default_rng(8)
    points = rng.uniform([-45, -25, -2], [15, 25, 9], (SIZE, SIZE, 3)).astype(np.float32)
    normals = light_twins.unit(rng.normal([0, 0, 2], 1, (SIZE, SIZE, 3))).astype(np.float32)
    inputs = run_frame(renderer, scene_of(PLATE, light), shadow_size=512)
    textures = {
        name: texture_from_array(renderer.device, np.dstack([values, np.ones((SIZE, SIZE))]), "rgba32float")
        for name, values in {"points": points, "normals": normals}.items()
    }
    towards, _ = probe(
        renderer.device,
        "light_probe",
        (SIZE, SIZE),
        ["towards", "arriving"],
        inputs.light_constants,
        **inputs.bindings,
        **textures,
        part={"index": 0},
    )
    depths = download(renderer.device, inputs.resources.shadow_maps.texture).astype(float)
    record = inputs.bindings["lights"]["light"][0]
    exact = light_twins.visibility(
        record, depths, points.reshape(-1, 3).astype(float), normals.reshape(-1, 3)
    )
    made = towards[..., 3].ravel()
    assert 0.1 < made.mean() < 0.9
    off = np.abs(made - exact) > TWIN
    assert off.mean() < 0.02 and np.abs(made - exact).max() < 0.15


def test_shadows_sharpen_towards_their_caster(renderer: Renderer) -> None:
    """The same light over plates at 4 and 24 mm: the penumbra grows with the height."""
    widths = []
    for height in (4.0, 24.0):
        head = head_of(
            joined(
                (plane(120.0, 6), (0, 0, 0), (0, 0, 0.7)),
                (plane(30.0, 2), (-15, 0, height), (0.75, 0.75, 0.2)),
            )
        )
        x, seen = visibility(renderer, head, SphereLight(**above(head, 300.0, radius_mm=40, softness_mm=0.1)))
        right = x > -15
        widths.append(np.ptp(x[right][(seen[right] > 0.1) & (seen[right] < 0.9)]))
    assert widths[1] > 4 * widths[0]


@pytest.mark.usefixtures("fine_sampling")
def test_shadow_on_an_oblique_surface_is_weighted_by_the_cosine(renderer: Renderer) -> None:
    """The edges of a plate hide the steep half of a light at one point, and its grazing half at another."""
    light = RectangleLight(**above(PLATE, 300.0, width_mm=100, height_mm=20, softness_mm=0.1))
    normal = light_twins.unit(np.array([0.94, 0.0, 0.34]))
    x, seen = visibility(renderer, PLATE, light, normal=normal)
    u = np.linspace(-50, 50, 2001)[None, :]
    cosine = np.maximum((u - x[:, None]) * normal[0] + 300 * normal[2], 0.0)
    crossing = x[:, None] + (u - x[:, None]) * 12 / 300
    open_ = ~((crossing > -30) & (crossing < 0))
    exact = (cosine * open_).sum(axis=1) / cosine.sum(axis=1)
    fading = (exact > 0.2) & (exact < 0.8) & (x < -10)
    assert np.abs(open_.mean(axis=1) - exact)[fading].mean() > 0.06  # without weights
    assert np.abs(seen - exact)[fading].mean() < 0.04, np.abs(seen - exact)[fading].mean()


@pytest.mark.parametrize("count", [12, 16, 32, 64])
def test_sample_points_are_balanced(count: int) -> None:
    """The first n points have the mean of a square and of a disc, and nearly their variances."""
    points = light_sample_points()[:count]
    assert np.abs(points.mean(axis=0)).max() < 1e-12
    assert np.abs((points[:, 2:] ** 2).mean(axis=0) - 1 / 3).max() < 0.04
    assert count == 12 or np.abs((points[:, :2] ** 2).mean(axis=0) - 1 / 4).max() < 0.04


def test_wide_rectangle_is_divided_into_shadow_maps(renderer: Renderer) -> None:
    """For a light as wide as its distance, the shadow's profile is the occluded fraction of the light."""
    light = RectangleLight(**above(PLATE, 300.0, width_mm=300, height_mm=40, softness_mm=0.1))
    x, seen = visibility(renderer, PLATE, light)
    # places u on the light that the plate hides from x: the line crosses z = 12 between -30 and 0
    u = np.linspace(-150, 150, 3001)[None, :]
    crossing = x[:, None] + (u - x[:, None]) * 12 / 300
    exact = 1.0 - ((crossing > -30) & (crossing < 0)).mean(axis=1)
    assert np.abs(seen - exact).max() < 0.12
    assert np.abs(seen - exact).mean() < 0.02


@pytest.mark.parametrize("kind", ["rectangle", "sphere", "sun"])
def test_a_ball_does_not_shade_itself(renderer: Renderer, kind: str) -> None:
    head = head_of(uv_sphere(80.0, 48, 24))
    light: Light = {
        "rectangle": RectangleLight(
            position=place(head, (200, 250, 400)), target=place(head, (0, 0, 0)), width_mm=150
        ),
        "sphere": SphereLight(
            position=place(head, (200, 250, 400)), target=place(head, (0, 0, 0)), radius_mm=60
        ),
        "sun": DirectionalLight(direction=(-2, -2.5, -4), angle_degrees=2),
    }[kind]
    plain, shaded = (
        entered(renderer, head, light.model_copy(update={"shadows": shadows}))[0][..., 0]
        for shadows in (False, True)
    )
    assert (shaded <= plain + 1e-6).all()
    assert (plain - shaded).max() < AREA_LIGHT * plain.max()  # also where a part of the light has set


def test_a_sphere_around_the_head_is_refused(renderer: Renderer) -> None:
    """A sphere radiates outwards: inside it there is no light."""
    light = SphereLight(position=(0, 0, 900), target=(0, 0, -5000), radius_mm=1000, shadows=False)
    with pytest.raises(DermisError, match=r"light 2: expected a head outside the sphere of 1000 mm"):
        renderer.draw(scene_of(FLOOR, DirectionalLight(direction=(0, 0, -1)), light), settings_of())


def test_far_too_many_lights_are_refused_before_their_maps_are_made(renderer: Renderer) -> None:
    lights = [DirectionalLight(direction=(0, 0, -1))] * 300
    with pytest.raises(DermisError, match="lights: expected at most 64, but there are 300"):
        renderer.draw(scene_of(FLOOR, *lights), settings_of())


def test_too_many_parts_are_refused(renderer: Renderer) -> None:
    wide = RectangleLight(position=(0, 0, 700), width_mm=2000, height_mm=2000, shadows=False)
    with pytest.raises(DermisError, match="72"):
        renderer.draw(scene_of(FLOOR, *[wide] * 8), settings_of())


@pytest.mark.parametrize("samples", [1, 4, 5, 16, 64])
def test_samples_per_strip_stay_below_driver_loop_limits(renderer: Renderer, samples: int) -> None:
    """Under three rectangles of 500 mm with 16 samples, strips of 256 samples left 4 % of a face black."""
    usual = dict(device_constants(renderer.device)).get("STRIP", 1)
    strip = (dict(pixel_column_constants(renderer.device, samples)) or {"STRIP": usual})["STRIP"]
    assert 1 <= strip <= usual and strip * samples <= 64
