"""Caches of a renderer never change the picture."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import bent_plane, front_camera, frontal, head_of, joined, scene_of, settings_of

from dermis.base.errors import DermisError
from dermis.frame import allocation
from dermis.frame.renderer import Renderer, render
from dermis.frame.seams import SEAM_METHODS
from dermis.gpu import CommandList, download
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene

Image = NDArray[np.float32]
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
BALL = head_of(uv_sphere(30.0, 24, 12))
SLAB = head_of(
    bent_plane(50.0, [[0.5, 0, 0.2], [0, 0.9, 0]], 2), colour=np.random.default_rng(0).random((16, 16, 3))
)
FLAT = uv_sphere(30.0, 24, 12)
LEAF = head_of(
    build_mesh(FLAT.positions * (1, 1, 0.1), FLAT.uv, FLAT.triangles, FLAT.material, SKIN_MATERIALS)
)
LEANING = head_of(
    bent_plane(50.0, [[0.5, 0.3, 0.1], [0, 0.9, 0]], 2), colour=np.random.default_rng(1).random((16, 16, 3))
)
LIGHT = DirectionalLight(direction=(1, -0.4, -1), irradiance=(2.0, 1.5, 1.0))


def scene(head: Head = BALL, *lights: DirectionalLight, **skin: Any) -> Scene:
    return scene_of(head, *(lights or (LIGHT,)), camera=front_camera(head, frame_mm=70.0), **skin)


def drawn(renderer: Renderer, what: Scene, **settings: Any) -> Image:
    return renderer.draw(what, settings_of(**settings)).linear()


def test_the_same_scene_gives_the_same_bytes(renderer: Renderer) -> None:
    images = []
    for _ in range(2):
        one = renderer.draw(scene(), settings_of(samples=3))
        images.append((one.linear().tobytes(), one.srgb8().tobytes()))
    assert images[0] == images[1]
    assert one.linear().max() > 0.1


def test_older_image_keeps_its_pixels(renderer: Renderer) -> None:
    older = renderer.draw(scene(), settings_of())
    renderer.draw(scene(), settings_of(exposure=2.0))
    with pytest.raises(RuntimeError, match="newer frame"):
        older.linear()


def test_a_failed_frame_leaves_no_half_drawn_shadows(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = Renderer(ADAPTER)

    dispatch = CommandList.dispatch

    def fail(frame: CommandList, stage: str, *given: Any, **named: Any) -> None:
        if stage == "shade":
            raise ValueError
        dispatch(frame, stage, *given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(CommandList, "dispatch", fail)
        with pytest.raises(ValueError):
            renderer.draw(scene(), settings_of())
    assert drawn(renderer, scene()).tobytes() == drawn(Renderer(ADAPTER), scene()).tobytes()


def test_failed_map_reads_are_retried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Maps are read on another thread, and the result is cached."""
    renderer = Renderer(ADAPTER)

    def fail(*_: Any) -> None:
        raise MemoryError("no more of it")

    with monkeypatch.context() as patch:
        patch.setattr(allocation, "upload_maps", fail)
        for _ in range(2):
            with pytest.raises(DermisError, match="no more of it"):
                renderer.draw(scene(), settings_of())
    assert drawn(renderer, scene()).tobytes() == drawn(Renderer(ADAPTER), scene()).tobytes()


CHANGES: dict[str, tuple[Callable[[], Scene], dict[str, Any]]] = {
    "head": (lambda: scene(SLAB), {}),
    "head back": (scene, {}),
    "size": (scene, {"size": (31, 57)}),
    "atlas": (scene, {"atlas": 100}),
    "lights": (lambda: scene(BALL, DirectionalLight(direction=(-1, 0, -1)), frontal(shadows=True)), {}),
    "brightness": (lambda: scene(BALL, LIGHT.model_copy(update={"irradiance": (9.0, 0.0, 3.0)})), {}),
    "softness": (lambda: scene(BALL, LIGHT.model_copy(update={"softness_mm": 6.0})), {}),
    "shadow size": (scene, {"shadow_size": 200}),
    "no shadows": (lambda: scene(BALL, frontal()), {}),
    "samples": (scene, {"samples": 4}),
    **{
        f"technique {name}": (scene, {"technique": name})
        for name in ("none", "one-blur", "gpu-gems-3", "screen-space", "pre-integrated")
    },
    **{f"seams {name}": (lambda: scene(LEANING), {"seams": name}) for name in SEAM_METHODS},
    "seam colour": (lambda: scene(LEANING), {"seams": "clear-colour", "seam_colour": (0.1, 0.2, 0.9)}),
    "published on two atlases": (scene, {"technique": "gpu-gems-3", "seams": "multi-uv"}),
    "axes": (lambda: scene(LEANING), {"stretch": "axes"}),
    "one density": (scene, {"stretch": "none"}),
    "thin": (lambda: scene(LEAF), {}),
    "thin taken for thick": (lambda: scene(LEAF), {"transmission": "none"}),
    "gamma": (lambda: scene(SLAB), {"gamma": "wrong"}),
    "skin": (lambda: scene(BALL, roughness=0.6, rho_s=0.9, mix=0.1), {}),
    "albedo": (lambda: scene(SLAB, albedo="profile"), {}),
    "albedo back": (lambda: scene(SLAB), {}),
    "background": (scene, {"background": (0.5, 0.0, 0.1), "exposure": 2.0}),
}


@pytest.fixture(scope="module")
def other(renderer: Renderer) -> Renderer:
    """Return a second renderer, whose cache is cleared before each frame."""
    return Renderer(renderer.device.adapter.name)


def fresh(other: Renderer, what: Scene, **settings: Any) -> Image:
    other.clear_cache()
    return drawn(other, what, **settings)


@pytest.mark.parametrize("name", CHANGES)
def test_reverted_changes_restore_the_picture(renderer: Renderer, other: Renderer, name: str) -> None:
    """After any other frame, the picture is that of a fresh renderer."""
    make, settings = CHANGES[name]
    what = make()
    made = drawn(renderer, what, **settings)
    assert made.tobytes() == fresh(other, what, **settings).tobytes()
    plain = drawn(renderer, scene())
    assert plain.tobytes() == drawn(renderer, scene()).tobytes()


def test_each_change_alters_the_picture(renderer: Renderer) -> None:
    """The changes give different pictures, else the tests above would prove nothing."""
    images = [drawn(renderer, make(), **settings).tobytes() for make, settings in CHANGES.values()]
    assert len(set(images)) == len(images) - 1  # "albedo back" is "head" once more


def test_light_of_another_head_does_not_linger(renderer: Renderer, other: Renderer) -> None:
    """Empty texels of the second head hold no light of the first."""
    from test_shade import tailed

    full = head_of(bent_plane(50.0, [[1, 0, 0], [0, 1, 0]]))
    drawn(renderer, scene(full, frontal(9.0)))
    made = drawn(renderer, scene(tailed(), frontal(1.0)))
    assert np.array_equal(made, fresh(other, scene(tailed(), frontal(1.0))))


def test_shadows_of_another_head_do_not_linger(renderer: Renderer, other: Renderer) -> None:
    """Heads of one size have one light matrix: only their content differs."""

    def under(x: float) -> Scene:
        corners = [(plane(4.0), (s * 25.0, s * 25.0, 20.0), (0.8, 0.4 + 0.4 * s, 0.1)) for s in (-1, 1)]
        shade = (plane(10.0), (x, 0.0, 20.0), (0.5, 0.5, 0.2))
        whole = head_of(joined((plane(60.0), (0, 0, 0), (0, 0, 0.5)), shade, *corners))
        return scene(whole, frontal(shadows=True))

    left, right, bare = under(-12.0), under(12.0), {"technique": "none"}
    for _ in range(2):
        drawn(renderer, left, **bare)
    made = drawn(renderer, right, **bare)
    assert np.array_equal(made, fresh(other, right, **bare))
    first, second = (renderer.prepare(one, settings_of(**bare)).shadow_views for one in (left, right))
    assert np.array_equal(first.clips, second.clips)
    assert not np.array_equal(made, drawn(renderer, left, **bare))


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (130, 3), (17, 40)])
def test_any_size_and_samples(renderer: Renderer, size: tuple[int, int], samples: int) -> None:
    rendered = renderer.draw(scene(), settings_of(size=size, samples=samples))
    linear, encoded = rendered.linear(), rendered.srgb8()
    assert linear.shape == (size[1], size[0], 3) and linear.dtype == np.float32
    assert encoded.shape == linear.shape and encoded.dtype == np.uint8
    assert np.isfinite(linear).all() and linear.max() > 0.01


@pytest.mark.parametrize("size", [(1, 1), (3, 1), (13, 7), (64, 40)])
def test_downloaded_bytes_equal_those_on_the_device(renderer: Renderer, size: tuple[int, int]) -> None:
    rendered = renderer.draw(scene(), settings_of(size=size))
    assert np.array_equal(rendered.srgb8(), download(renderer.device, rendered.picture.bytes)[..., :3])


def moving(count: int) -> list[Scene]:
    """Return scenes whose light and camera move."""
    lights = [DirectionalLight(direction=(1, -0.4, -1 - k), irradiance=(2.0, 1.5, 1.0)) for k in range(count)]
    camera = [front_camera(BALL, frame_mm=70.0 + 5 * k) for k in range(count)]
    return [scene_of(BALL, light, camera=one) for light, one in zip(lights, camera, strict=True)]


def test_sequence_equals_single_images(renderer: Renderer) -> None:
    scenes = moving(7)
    one_by_one = [renderer.draw(one, settings_of()).srgb8() for one in scenes]
    linear = [renderer.draw(one, settings_of()).linear() for one in scenes]
    many = list(renderer.render_many(iter(scenes), **settings_of().model_dump()))
    floats = list(renderer.render_many(iter(scenes), linear=True, **settings_of().model_dump()))
    assert [image.tobytes() for image in many] == [image.tobytes() for image in one_by_one]
    assert len({image.tobytes() for image in many}) == 7
    assert all(np.array_equal(*pair) for pair in zip(floats, linear, strict=True))


def test_more_floats_than_a_buffer_holds_are_refused(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_of().model_dump() | {"size": (20, 10)}
    next(renderer.render_many(moving(1), **settings))
    monkeypatch.setattr(renderer.device, "max_storage_bytes", 12 * 199)
    assert next(renderer.render_many(moving(1), **settings)).shape == (10, 20, 3)  # bytes are fewer
    with pytest.raises(DermisError, match=r"size: expected at most 199 pixels.* 200"):
        next(renderer.render_many(moving(1), linear=True, **settings))


def test_sequence_may_be_stopped_early(renderer: Renderer) -> None:
    """Pictures that are not read are harmless, and other frames may come in between."""
    scenes, chosen = moving(5), settings_of()
    expected = [renderer.draw(one, chosen).srgb8().tobytes() for one in scenes]
    for _ in range(3):
        images = renderer.render_many(scenes, **chosen.model_dump())
        assert next(images).tobytes() == expected[0]
        assert renderer.draw(scenes[4], chosen).srgb8().tobytes() == expected[4]
        assert next(images).tobytes() == expected[1]
        images.close()
    renderer.device.wait()
    assert not renderer.device.pending_readbacks


def test_the_image_does_not_depend_on_its_width(renderer: Renderer) -> None:
    """The height of the view is fixed: a wider picture shows more at its sides."""
    narrow, wide = (drawn(renderer, scene(), size=(w, 40)) for w in (20, 60))
    assert np.abs(wide[:, 20:40] - narrow).max() < 0.01 * narrow.max()


@pytest.mark.parametrize("option", ["atlas", "size"])
def test_sizes_over_the_device_limit_are_refused(
    renderer: Renderer, option: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(renderer.device, "max_texture_size", 100)
    over: dict[str, Any] = {"atlas": {"atlas": 101}, "size": {"size": (8, 101)}}[option]
    with pytest.raises(DermisError, match=rf"{option}: expected at most 100 .*101"):
        renderer.draw(scene(), settings_of(**over))


def test_too_many_lights_are_refused(renderer: Renderer) -> None:
    assert drawn(renderer, scene(BALL, *[frontal(0.1)] * 64)).max() > 0.1
    with pytest.raises(DermisError, match=r"lights: expected at most 64.*65"):
        drawn(renderer, scene(BALL, *[frontal()] * 65))


def test_more_lights_are_more_light(renderer: Renderer, close: float) -> None:
    """A picture under two lights is the sum of the pictures under each."""
    one, two = LIGHT, DirectionalLight(direction=(-1, 1, -2), irradiance=(0.5, 1.0, 1.5))
    parts = [drawn(renderer, scene(BALL, light)) for light in (one, two)]
    both = drawn(renderer, scene(BALL, one, two))
    assert np.abs(both - parts[0] - parts[1]).max() < close * both.max()


def test_exposure_scales_the_image(renderer: Renderer) -> None:
    plain, bright = (drawn(renderer, scene(), exposure=e) for e in (1.0, 2.5))
    assert np.abs(bright - 2.5 * plain).max() < 1e-6 * bright.max()


def test_frame_statistics_are_reported(renderer: Renderer) -> None:
    rendered = renderer.draw(scene(), settings_of(), run_all_passes=True)
    assert rendered.gaussians == 6
    assert rendered.frame_ms > 0 and rendered.setup_ms > 0
    if rendered.gpu_ms is not None:
        lit = {"surface", "irradiance", "diffuse", "translucency", "combine"}
        stages = lit | {"pairs", "shape", "stretch", "visibility", "shade", "post"}
        assert stages <= set(rendered.gpu_ms) <= stages | {"shadows", "total"}


def test_render_function_draws_in_one_call(renderer: Renderer) -> None:
    image = render(
        scene(), adapter=renderer.device.adapter.name, size=(24, 16), atlas=64, samples=1, shadow_size=64
    )
    assert image.shape == (16, 24, 3) and image.max() > 0.1


def test_more_than_the_memory_is_refused(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    if renderer.device.adapter.kind != "CPU":
        pytest.skip("a GPU's driver tells by itself")
    renderer.clear_cache()  # for what is there already there is space
    monkeypatch.setattr("os.sysconf", lambda name: 100)
    with pytest.raises(DermisError, match="GB"):
        renderer.draw(scene(), settings_of())
    monkeypatch.setattr("os.sysconf", lambda name: 10_000)
    shaded = scene(BALL, frontal(shadows=True))
    with pytest.raises(DermisError, match=r"shadow_size: expected a frame within 0 GB.* 1 maps of 8192"):
        renderer.draw(shaded, settings_of(shadow_size=8192))


def test_old_names_of_options_warn(renderer: Renderer) -> None:
    with pytest.warns(DeprecationWarning, match="is now run_all_passes"):
        renderer.draw(scene(), settings_of(), anew=True)  # type: ignore[call-arg]
    with pytest.warns(DeprecationWarning, match="depth is now cache_size"):
        Renderer(renderer.device.adapter.name, depth=2)  # type: ignore[call-arg]
