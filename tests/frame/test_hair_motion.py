"""Swing of long hair: at rest, lengths, collisions, energy, determinism, and a twin in float64."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
import swing_twin as twin
from numpy.typing import NDArray
from setups import scene_of
from tolerances import SWUNG_KNOTS_MM, SWUNG_LENGTHS

from dermis.base.errors import DermisError
from dermis.frame.features.hair.swing import SUBSTEPS_PER_S, gravity_change
from dermis.frame.frame import draw_swing_step
from dermis.frame.hair_motion import HairMotion
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.mesh.groom import KNOTS_PER_GUIDE, Groom, Guides
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Doubles = NDArray[np.float64]
RATE = 30.0
SETTINGS = Settings(size=(16, 16), atlas=64, technique="none", occlusion="none", interreflection=False)
TURN = 40.0  # [degrees]


class Simulated(NamedTuple):
    """State of the guides after a frame: knots, skin, stiff guides and the guides that strands follow."""

    knots: twin.Knots
    skin: Doubles
    stiff: Doubles
    guides: Doubles
    gravity: Doubles
    low_mm: Doubles


@pytest.fixture(scope="module")
def long_haired() -> Head:
    """Return a person with 24 guides of long hair."""
    head = Human(hair=HairLook(style="long")).head(subdivide=0)
    hair = head.hair
    assert hair is not None
    few = np.arange(0, len(hair.guides.cut), len(hair.guides.cut) // 24)[:24]
    guides = Guides(
        *(getattr(hair.guides, name)[few] for name in ("corner", "local_mm", "weight", "rest_mm", "cut"))
    )
    near = np.abs(hair.roots.guide[:, :1] - few).argmin(axis=1).astype(np.int32)
    roots = replace(hair.roots, guide=np.repeat(near[:, None], 4, axis=1))
    return replace(head, hair=Groom(**{**vars(hair), "guides": guides, "roots": roots, "strands": 200}))


def turned(head: Head, degrees: float) -> Scene:
    return replace(scene_of(head), pose=Pose(bones={"head": (0.0, degrees, 0.0)}))


def simulate(
    renderer: Renderer, head: Head, angles: list[float], *, motion: HairMotion | None = None
) -> list[Simulated]:
    """Render frames of a turning head, and return the guides of each."""
    motion, made = motion or HairMotion(RATE), []
    for angle in angles:
        made.append(simulated(renderer, turned(head, angle), motion))
    return made


def simulated(renderer: Renderer, scene: Scene, motion: HairMotion) -> Simulated:
    frame = motion.advance(scene)
    inputs = renderer.prepare(scene, SETTINGS, hair_frame=frame)
    assert inputs.swing is not None and inputs.resources.hair is not None
    for step in inputs.swing.steps:  # the passes of pictures are not needed
        renderer.graph.begin()
        draw_swing_step(renderer.graph, inputs, step)
        renderer.graph.submit()
    motion.mark_done(inputs.swing.buffers, frame.frame_index)
    groom = inputs.resources.hair.tables.groom
    assert groom is not None
    buffers, now = inputs.swing.buffers, frame.frame_index % 2

    def read(buffer: object, *shape: int) -> Doubles:
        raw = renderer.device.handle.queue.read_buffer(buffer)
        return np.frombuffer(raw, np.float32).reshape(shape).astype(float)

    table = read(buffers.knots[now], -1, KNOTS_PER_GUIDE, 12)
    columns = table[..., :3], table[..., 4:7], table[..., 8:11], table[..., 3], table[..., 7], table[..., 11]
    skin = read(buffers.colliders[now], -1, 2, 4)[..., :3]
    stiff, guides = (read(one, -1, KNOTS_PER_GUIDE, 2, 4) for one in (groom.style.guides, buffers.guides))
    gravity, low_mm = inputs.swing.steps[-1].gravity_mm_per_s2, inputs.swing.colliders.low_mm
    return Simulated(twin.Knots(*columns), skin, stiff[:, :, 0], guides[:, :, 0], gravity, low_mm)


@pytest.fixture(scope="module")
def turn(renderer: Renderer, long_haired: Head) -> list[Simulated]:
    """Return frames of a head that turns in a third of a second and then stays."""
    angles = [0.0, 0.0, *(TURN * np.sin(np.pi * k / 20) ** 2 for k in range(1, 11)), *([TURN] * 12)]
    return simulate(renderer, long_haired, angles)


def test_hair_is_at_rest_in_the_first_frame_and_stays_so(turn: list[Simulated]) -> None:
    first, second = turn[:2]
    np.testing.assert_array_equal(first.guides, first.stiff)
    np.testing.assert_allclose(second.guides, first.stiff, atol=SWUNG_KNOTS_MM)


def test_lengths_stay(turn: list[Simulated]) -> None:
    rest = np.linalg.norm(np.diff(turn[0].guides[..., :3], axis=1), axis=2)
    for frame in turn:
        now = np.linalg.norm(np.diff(frame.guides[..., :3], axis=1), axis=2)
        np.testing.assert_allclose(now, rest, rtol=SWUNG_LENGTHS)


def test_hair_lags_behind_a_turning_head_and_then_comes_to_rest(turn: list[Simulated]) -> None:
    speeds = np.array([np.linalg.norm(frame.knots.velocity, axis=2).mean() for frame in turn])
    lag = np.linalg.norm(turn[11].knots.position - turn[11].stiff[..., :3], axis=2).max()
    assert lag > 10.0
    assert speeds[2:12].max() > 30.0
    assert speeds[-1] < 0.25 * speeds[2:12].max()
    late = (speeds[12:] ** 2).reshape(4, -1).mean(axis=1)  # mean kinetic energy of spans of three frames
    assert (np.diff(late) < 0.0).all()


def test_hair_does_not_enter_the_skin_further_than_at_rest(turn: list[Simulated]) -> None:
    for before, frame in pairwise(turn):
        distance, _ = twin.nearest_skin(grid_of(before, frame), frame.knots.position, 0.0, 0.0)
        entered = np.minimum(frame.knots.clearance, 0.0) - distance
        assert entered[:, 1:].max() < SWUNG_KNOTS_MM  # roots follow the skin, and are not simulated


def grid_of(before: Simulated, now: Simulated) -> twin.Grid:
    return twin.make_grid(before.skin[:, 0], now.skin[:, 0], now.skin[:, 1], now.low_mm)


def test_a_few_frames_equal_those_of_the_twin(turn: list[Simulated], long_haired: Head) -> None:
    assert long_haired.hair is not None
    substeps = round(SUBSTEPS_PER_S / RATE)
    rest_mm = long_haired.hair.guides.rest_mm.astype(float)
    knots = twin.at_rest(rest_mm, turn[0].stiff[..., :3], grid_of(turn[0], turn[0]))
    np.testing.assert_allclose(knots.lever, turn[0].knots.lever, atol=1e-3)
    for before, now in pairwise(turn[:6]):
        grid = grid_of(before, now)
        knots = twin.advance(knots, now.stiff[..., :3], grid, now.gravity, substeps, 1.0 / SUBSTEPS_PER_S)
    off = np.linalg.norm(knots.position - turn[5].knots.position, axis=2)
    assert np.median(off) < SWUNG_KNOTS_MM
    assert np.quantile(off, 0.95) < 10.0 * SWUNG_KNOTS_MM


def test_frames_do_not_depend_on_which_are_rendered(renderer: Renderer, long_haired: Head) -> None:
    angles = [0.0, 8.0, 20.0, 30.0, 24.0]
    every = simulate(renderer, long_haired, angles)[-1].guides
    motion = HairMotion(RATE)
    for angle in angles[:-1]:
        motion.advance(turned(long_haired, angle))
    renderer.clear_cache()
    np.testing.assert_array_equal(simulated(renderer, turned(long_haired, angles[-1]), motion).guides, every)


def test_a_frame_can_be_drawn_twice(renderer: Renderer, long_haired: Head) -> None:
    motion = HairMotion(RATE)
    frames = [motion.advance(turned(long_haired, angle)) for angle in (0.0, 10.0, 20.0)]
    pictures = [
        renderer.draw(motion.scene(k), SETTINGS, run_all_passes=True, hair_frame=frames[k]).linear()
        for k in (1, 1, 2, 1)
    ]
    for again in (1, 3):
        np.testing.assert_array_equal(pictures[again], pictures[0])


def test_all_frames_show_one_head(renderer: Renderer, long_haired: Head) -> None:
    motion = HairMotion(RATE)
    motion.advance(turned(replace(long_haired, name="another"), 0.0))
    frame = motion.advance(turned(long_haired, 0.0))
    with pytest.raises(DermisError, match="scenes of one head"):
        renderer.prepare(motion.scene(1), SETTINGS, hair_frame=frame)


def test_a_frame_has_the_pose_of_its_scene(renderer: Renderer, long_haired: Head) -> None:
    motion = HairMotion(RATE)
    frames = [motion.advance(turned(long_haired, angle)) for angle in (0.0, 10.0)]
    with pytest.raises(DermisError, match="hair_frame: expected a frame with the pose of the scene"):
        renderer.prepare(motion.scene(1), SETTINGS, hair_frame=frames[0])


def test_gravity_turns_relative_to_the_head() -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    rolled = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    about_the_neck = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    np.testing.assert_allclose(gravity_change(about_the_neck, np.eye(3)), 0.0, atol=1e-9)
    np.testing.assert_allclose(gravity_change(rolled, np.eye(3)), [-9810.0 * s, -9810.0 * (1.0 - c), 0.0])
    np.testing.assert_allclose(gravity_change(rolled, rolled), 0.0, atol=1e-9)
