"""Strands in the frame: lobe, cover, order, and shadows on the skin."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, probe, run_frame, scene_of
from strand_setups import hairy, shuffled
from tolerances import FURNACE, LOBE_TWIN, TWIN

from dermis.base.errors import DermisError
from dermis.frame.features.hair import resources as hair_resources
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.gpu.textures import texture_from_array
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, PointLight, RectangleLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES
from dermis.specular.hair import fibre_parameters, fibre_scattering, lobe_fractions

Floats = NDArray[np.float64]
FRAME_MM, SIZE = 40.0, 40  # a pixel is a millimetre, at the sheet
ABOVE = 0.5  # of hairs over it [mm]
BLACK = 1e5  # absorption [1/mm]


def picture(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    """Return the (h, w, 4) picture with its coverage."""
    given = {"size": (SIZE, SIZE), "technique": "none"} | settings
    made = run_frame(renderer, scene, **given).resources.post.picture
    return download(renderer.device, made.exposed).astype(float)


def lit(head: Head, **more: Any) -> Scene:
    return scene_of(head, frontal(), camera=front_camera(head, frame_mm=FRAME_MM), **more)


def one(radius_mm: float, *, slope: float = 0.3, absorption: float = BLACK) -> Head:
    """Return a sheet with a single sloping strand across its middle."""
    ends = np.array([[-12.0, -12.0 * slope + 0.2, ABOVE], [12.0, 12.0 * slope + 0.2, ABOVE]])
    return hairy(ends[:1], ends[1:], radius_mm, absorption)


def tangle(count: int, absorption: float = 0.0, radius_mm: float = 0.2) -> Head:
    """Return a sheet with overlapping strands."""
    rng = np.random.default_rng(3)
    begins, ends = rng.uniform(-6, 6, (2, count, 3))
    begins[:, 2], ends[:, 2] = rng.uniform(0.3, 4.0, (2, count))
    return hairy(begins, ends, radius_mm, absorption)


def test_strand_lobe_matches_numpy(renderer: Renderer) -> None:
    rng = np.random.default_rng(0)
    sines = rng.uniform(-0.98, 0.98, (24, 24, 2))
    drawn = np.dstack([sines, rng.uniform(-np.pi, np.pi, (24, 24)), rng.uniform(0, 2, (24, 24))])
    drawn = drawn.astype(np.float32).astype(float)
    bound = {"directions": texture_from_array(renderer.device, drawn, "rgba32float")}
    seen, white = probe(renderer.device, "hair_probe", (24, 24), ["seen", "white"], **bound)
    depth = drawn[..., 3:] * [0.5, 1.0, 2.0]
    twin = np.array(
        [
            [fibre_scattering(*d[:3], depth[i, j], fibre_parameters()) for j, d in enumerate(row)]
            for i, row in enumerate(drawn)
        ]
    )
    assert np.abs(seen[..., :3] - twin).max() < LOBE_TWIN * twin.max()
    h = (np.arange(16) + 0.5) / 8 - 1
    for i, j in ((0, 0), (5, 9), (20, 3)):
        mean = sum(lobe_fractions(drawn[i, j, 1], np.broadcast_to(depth[i, j], (16, 3)), h)).mean(axis=0)
        assert white[i, j, :3] == pytest.approx(mean, abs=LOBE_TWIN)


@pytest.mark.parametrize("slope", [0.0, 0.3, 2.5])
@pytest.mark.parametrize("radius_mm", [0.04, 0.3, 1.4])
def test_hair_coverage_equals_its_width(renderer: Renderer, radius_mm: float, slope: float) -> None:
    """Compare the coverage of columns of pixels beside the sheet with the width of a strand."""
    ends = np.array([[-12.0, -12.0 * slope + 80.2, 0.0], [12.0, 12.0 * slope + 80.2, 0.0]])
    head = hairy(ends[:1], ends[1:], radius_mm, BLACK)
    scene = scene_of(head, frontal(), camera=front_camera(head, (0.0, 80.0, 0.0), frame_mm=FRAME_MM))
    cover = picture(renderer, scene)[..., 3]
    axis, lean = (0, np.hypot(1.0, slope)) if slope < 1 else (1, np.hypot(1.0, 1 / slope))
    found = cover.sum(axis=axis)[16:24]
    assert found.mean() == pytest.approx(2 * radius_mm * lean, rel=0.01)
    assert found == pytest.approx(np.full(8, found.mean()), rel=0.06)  # as wide in each


def test_the_order_of_hairs_does_not_matter(renderer: Renderer) -> None:
    """The picture is independent of the order even if a pixel has more fragments than it keeps."""
    head = tangle(80, absorption=3.0)
    first, second = (picture(renderer, lit(each)) for each in (head, shuffled(head, 1)))
    assert np.array_equal(first, second)
    assert np.array_equal(first, picture(renderer, lit(head)))


def test_any_number_of_hairs_may_share_a_tile(renderer: Renderer) -> None:
    """Thousands of nearly invisible strands change no pixel much, and no pixel is lost."""
    head = tangle(3000, radius_mm=1e-5)
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=60.0))
    made, bare = (picture(renderer, scene, size=(24, 24), strands=on)[..., :3] for on in (True, False))
    assert (made != bare).any()
    assert np.abs(made / bare - 1.0).max() < 0.05


def test_without_hairs_nothing_changes(renderer: Renderer) -> None:
    """A head without strands and one with hidden strands give identical pictures by the same passes."""
    head = tangle(20)
    ran = []
    for scene, strands in ((lit(head), False), (lit(replace(head, strands=None)), True)):
        renderer.graph.invalidate()
        made = picture(renderer, scene, strands=strands, technique="texture-space")
        ran.append((list(renderer.graph.executed_stages), made))
    assert ran[0][0] == ran[1][0] and "strands" not in ran[0][0]
    assert np.array_equal(ran[0][1], ran[1][1])


@pytest.mark.parametrize("absorption", [0.0, 8.0])
def test_white_hairs_vanish_in_a_furnace(renderer: Renderer, absorption: float) -> None:
    head = tangle(120, absorption)
    scene = replace(lit(head, rho_s=0.0), lights=(), environment=Environment(name="uniform"))
    made = picture(renderer, scene, occlusion="none", samples=4)[..., :3]
    assert made.max() < 1.0 + FURNACE
    if absorption == 0.0:
        assert made.min() > 1.0 - FURNACE
    else:
        assert made.min() < 0.8


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_every_technique_has_hairs(renderer: Renderer, technique: str) -> None:
    made, bare = (
        picture(renderer, lit(one(0.4)), technique=technique, strands=on)[..., :3].sum()
        for on in (True, False)
    )
    assert 0.5 * bare < made < 0.99 * bare


def test_hairs_behind_the_skin_are_hidden(renderer: Renderer) -> None:
    head = hairy([[-12, 0, -3]], [[12, 0, -3]], 0.5, BLACK)
    made, bare = (picture(renderer, lit(head), strands=on) for on in (True, False))
    assert np.array_equal(made, bare)


def test_hairs_outside_the_head_count_as_coverage(renderer: Renderer) -> None:
    """Over an empty background strands count as coverage."""
    head = hairy([[-90, 0, 1]], [[90, 0, 1]], 3.0, BLACK)
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=160.0))
    covered = picture(renderer, scene)[..., 3]
    assert covered[:, 1].sum() == pytest.approx(1.5, rel=0.01)  # pixels of 4 mm
    assert covered.max() <= 1.0 and covered[SIZE // 2, SIZE // 2] == 1.0
    assert picture(renderer, scene, strands=False)[SIZE // 2, 1, 3] == 0.0


def test_hairs_shade_the_skin_softly(renderer: Renderer) -> None:
    """A row of thin strands in oblique light casts a band that is as dark as their cover."""
    y = np.arange(-1.95, 2.0, 0.1)
    begins = np.column_stack([np.full(40, -30.0), y, np.full(40, 8.0)])
    head = hairy(begins, begins * [-1, 1, 1], 0.025, BLACK)
    slanted = frontal(shadows=True).model_copy(update={"direction": (0.0, -1.0, -1.0)})
    scene = replace(lit(head), lights=(slanted,))
    made, bare = (picture(renderer, scene, strands=on, shadow_size=512)[..., 0] for on in (True, False))
    share = (made / bare)[:, 20]
    cover = 0.05 / 0.1 * np.sqrt(2.0)  # and texels are as wide as hairs are apart
    assert share[27:29] == pytest.approx(np.full(2, np.exp(-cover)), abs=0.04)  # 8 mm below it
    assert share[32:] == pytest.approx(1.0, abs=TWIN) and share[:17] == pytest.approx(1.0, abs=TWIN)


def test_area_lights_soften_shadows_of_hairs(renderer: Renderer) -> None:
    """A rectangle shades like many point lights all over it."""
    y = np.arange(-1.95, 2.0, 0.1)
    begins = np.column_stack([np.full(40, -30.0), y, np.full(40, 8.0)])
    head = hairy(begins, begins * [-1, 1, 1], 0.025, BLACK)
    centre, along = np.array([0.0, 283.0, 283.0]), np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    offsets = np.linspace(-90.0, 90.0, 10)
    points = [PointLight(position=tuple(centre + each * along), irradiance=(1, 1, 1)) for each in offsets]
    area = RectangleLight(position=tuple(centre), irradiance=(1, 1, 1), width_mm=40, height_mm=200)

    def share(*lights: Light) -> Floats:
        pictures = [
            sum(
                picture(renderer, replace(lit(head), lights=(light,)), strands=on, shadow_size=512)
                for light in lights
            )
            for on in (True, False)
        ]
        return np.asarray(pictures[0] / pictures[1])[:, 20, 0]

    one, soft, exact = share(points[4]), share(area), share(*points)
    assert np.abs(soft - exact).max() < 0.3 * np.abs(one - exact).max()


@pytest.mark.parametrize("behind_mm", [20.0, 60.0])
def test_hairs_behind_the_head_do_not_shade_its_front(renderer: Renderer, behind_mm: float) -> None:
    """Strands behind the head cast no shadow on its front at any distance."""
    y = np.arange(-1.95, 2.0, 0.1)
    ends = np.column_stack([np.full(40, -30.0), y, np.full(40, 25.0)])
    far = ends - np.array([0.0, 0.2, 1.0]) * (25.0 + behind_mm)  # along the light
    slanted = frontal(shadows=True).model_copy(update={"direction": (0.0, -0.2, -1.0)})
    begins = ends[::4], np.concatenate([ends[::4], *9 * [far]])
    heads = [hairy(each, each * [-1, 1, 1], 0.025, BLACK) for each in begins]
    scenes = [replace(lit(head), lights=(slanted,)) for head in heads]
    alone, both = (picture(renderer, scene, shadow_size=512)[..., 0] for scene in scenes)
    assert both[:, 20] == pytest.approx(alone[:, 20], rel=0.05) and alone[:, 20].min() < 0.9 * alone.max()


def test_hairs_follow_the_skin(renderer: Renderer) -> None:
    """Strands move and turn with the sheet."""
    head = one(0.4)
    angle = np.radians(30.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    moved = (head.positions_mm @ turn.T + [2.0, -3.0, 0.0]).astype(np.float32)
    inputs = run_frame(renderer, replace(lit(head), pose=Pose(positions_mm=moved)), technique="none")
    made = inputs.resources.hair
    assert made is not None and head.strands is not None
    raw = renderer.device.handle.queue.read_buffer(made.tables.buffers.drawn)
    rows = np.frombuffer(raw, np.float32, 7 * 4).reshape(1, 7, 4)
    there = head.strands.knot_positions_mm(head.mesh, moved)
    assert np.abs(rows[:, 2:, :3] - there).max() < 1e-4
    still = head.strands.knot_positions_mm(head.mesh, head.positions_mm)
    assert np.abs(there - (still @ turn.T + [2.0, -3.0, 0.0])).max() < 1e-4


def test_hairs_are_drawn_again_only_when_they_change(renderer: Renderer) -> None:
    head = one(0.3)
    turned = replace(lit(head), camera=front_camera(head, (2.0, 0.0, 0.0), frame_mm=FRAME_MM))
    ran = []
    for scene, exposure in ((lit(head), 1.0), (lit(head), 1.0), (lit(head), 2.0), (turned, 2.0)):
        picture(renderer, scene, exposure=exposure)
        ran.append(set(renderer.graph.executed_stages))
    assert ran[1:3] == [set(), {"post"}]
    assert "strands" in ran[3] and not ran[3] & {"shape", "shadows"}


def test_picture_parts_with_strands_add_up(renderer: Renderer) -> None:
    """Light that strands scatter counts as reflected; they only cover diffuse light."""
    scene = lit(tangle(40, absorption=2.0))
    parts = ("all", "diffuse", "specular")
    whole, below, over = (picture(renderer, scene, parts=part)[..., :3] for part in parts)
    assert np.abs(below + over - whole).max() < TWIN * whole.max()


def test_hairs_of_another_mesh_are_refused(renderer: Renderer) -> None:
    head = one(0.1)
    alone = replace(head, mesh=replace(head.mesh, quads=head.mesh.quads[:0]))
    with pytest.raises(DermisError, match="rooted in quads"):
        picture(renderer, lit(alone))


def test_strands_can_be_switched_off() -> None:
    assert Settings().strands and not Settings(strands=False).strands


@pytest.mark.parametrize("size", [(96, 96), (75, 61)])
def test_tiles_of_any_size_draw_the_same(
    renderer: Renderer, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Large tiles, as in large pictures, give the same picture."""
    scene, shown = lit(tangle(700, absorption=0.4)), []
    for side in (2, 8):
        monkeypatch.setattr(hair_resources, "_tile_side", lambda size, side=side: side)
        renderer.clear_cache()
        shown.append(picture(renderer, scene, size=size))
    renderer.clear_cache()
    np.testing.assert_allclose(shown[1], shown[0], rtol=1e-5, atol=1e-6)
    assert shown[0][..., :3].std() > 0.02
