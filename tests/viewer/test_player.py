"""Motions that are played, paused and scrubbed, with a clock that only the test advances."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigged_head import write_take

from dermis.apps.viewer.navigation import orbit
from dermis.apps.viewer.player import MotionFile, MotionPlayer
from dermis.apps.viewer.posing import target_weight, with_target_weight
from dermis.apps.viewer.state import UndoHistory, ViewerState
from dermis.base.errors import DermisError

JAW = 0.0, 0.2, 0.4, 0.6, 0.8, 1.0


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def take(tmp_path: Path) -> MotionFile:
    """Return the path of a motion of half a second in which the jaw opens."""
    return MotionFile(write_take(tmp_path / "take.csv", *JAW), fps=10.0)


@pytest.fixture
def history(rigged: ViewerState) -> UndoHistory:
    return UndoHistory(rigged)


@pytest.fixture
def player(history: UndoHistory, take: MotionFile, clock: Clock) -> MotionPlayer:
    return MotionPlayer(history, take, clock)


def jaw(player: MotionPlayer) -> float:
    return target_weight(player.displayed_state.scene, "jawOpen")


def after(player: MotionPlayer, clock: Clock, seconds: float) -> float:
    clock.now += seconds
    player.advance()
    return jaw(player)


def start(player: MotionPlayer, clock: Clock) -> None:
    """Play up to the first frame, from which the clock counts."""
    player.play()
    player.advance()
    after(player, clock, 0.0)


def test_player_is_stopped_initially(player: MotionPlayer, rigged: ViewerState, clock: Clock) -> None:
    assert after(player, clock, 1.0) == 0.0 and player.displayed_state is rigged and not player.is_playing


def test_player_follows_the_clock_at_any_frame_time(player: MotionPlayer, clock: Clock) -> None:
    player.play()
    assert after(player, clock, 5.0) == 0.0
    assert after(player, clock, 5.0) == 0.0  # the first picture took so long
    assert after(player, clock, 0.1) == pytest.approx(0.2)
    assert after(player, clock, 0.35) == pytest.approx(0.9)
    assert player.seconds == pytest.approx(0.45)


def test_player_loops(player: MotionPlayer, clock: Clock) -> None:
    start(player, clock)
    assert after(player, clock, 0.6) == pytest.approx(0.2)
    assert after(player, clock, 50.1) == pytest.approx(0.4)


def test_player_without_loop_stops_at_the_end_and_restarts(player: MotionPlayer, clock: Clock) -> None:
    player.loops = False
    start(player, clock)
    assert after(player, clock, 0.7) == 1.0 and not player.is_playing and player.seconds == 0.5
    player.toggle()
    assert player.is_playing and after(player, clock, 0.1) == 0.0


def test_playback_is_one_undo_step(
    player: MotionPlayer, history: UndoHistory, rigged: ViewerState, clock: Clock
) -> None:
    start(player, clock)
    for _ in range(3):
        after(player, clock, 0.1)
    assert not history.can_undo
    player.toggle()
    assert jaw(player) == pytest.approx(0.6) and player.seconds == pytest.approx(0.3)
    history.undo()
    assert history.state is rigged and player.seconds == 0.0 and not history.can_undo
    history.redo()
    start(player, clock)
    assert after(player, clock, 0.1) == pytest.approx(0.8)


def test_change_during_playback_is_a_separate_step(
    player: MotionPlayer, history: UndoHistory, clock: Clock
) -> None:
    start(player, clock)
    camera = history.state.scene.camera
    for k in range(3):
        turned = history.state.with_camera(orbit(camera, 0.1 * (k + 1), 0.0))
        history.change(turned, "drag 1")
        after(player, clock, 0.1)
    assert len(history.states) == 2
    assert player.displayed_state.scene.camera == history.state.scene.camera != camera
    assert jaw(player) == pytest.approx(0.6)
    history.undo()
    assert player.displayed_state.scene.camera == camera and jaw(player) == pytest.approx(0.6)


def test_slider_keeps_targets_outside_the_motion(
    player: MotionPlayer, history: UndoHistory, clock: Clock
) -> None:
    start(player, clock)
    brow = with_target_weight(history.state.scene, "browInnerUp", 0.5)
    history.change(history.state.with_pose(brow))
    after(player, clock, 0.2)
    assert target_weight(player.displayed_state.scene, "browInnerUp") == 0.5 and jaw(player) == pytest.approx(
        0.4
    )


def test_scrubbing_stops_playback(player: MotionPlayer, history: UndoHistory, clock: Clock) -> None:
    start(player, clock)
    for seconds in (0.1, 0.25, 0.35):
        history.change(player.state_at(seconds), "hold time")
    assert after(player, clock, 1.0) == pytest.approx(0.7) and player.seconds == 0.35
    assert len(history.states) == 2
    start(player, clock)
    assert after(player, clock, 0.1) == pytest.approx(0.9)


def test_motion_without_matching_names_is_reported_and_the_previous_continues(
    player: MotionPlayer, history: UndoHistory, state: ViewerState, rigged: ViewerState, clock: Clock
) -> None:
    start(player, clock)
    history.change(state)
    assert player.clip is None and player.displayed_state is state and "JawOpen" in player.note
    after(player, clock, 0.1)
    assert not player.is_playing
    player.toggle()
    assert not player.is_playing
    history.undo()
    assert player.clip is not None and player.note == ""


def test_new_motion_plays_from_its_beginning(player: MotionPlayer, clock: Clock, rigged_file: Path) -> None:
    start(player, clock)
    after(player, clock, 0.3)
    player.open(MotionFile(rigged_file))
    assert player.is_playing and player.seconds == 0.0
    player.advance()
    after(player, clock, 0.0)
    assert after(player, clock, 0.25) == pytest.approx(0.25)
    with pytest.raises(DermisError, match="no such file"):
        player.open(MotionFile("nowhere.csv"))
    assert player.is_playing and player.clip is not None and player.clip.name == "talk"


def test_a_frame_that_cannot_be_read_stops_it(
    player: MotionPlayer, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(seconds: float) -> None:
        raise DermisError("frame 3 is broken")

    clip = player.clip
    assert clip is not None
    start(player, clock)
    monkeypatch.setattr(type(clip), "pose_at", lambda _, seconds: broken(seconds))
    assert after(player, clock, 0.1) == 0.0
    assert not player.is_playing and "frame 3" in player.note


def test_motion_of_one_frame_is_static(rigged: ViewerState, clock: Clock, tmp_path: Path) -> None:
    player = MotionPlayer(UndoHistory(rigged), MotionFile(write_take(tmp_path / "one.csv", 0.5)), clock)
    start(player, clock)
    assert after(player, clock, 0.1) == 0.5 and not player.is_playing
