"""Viewer states: changes, files, undo and redo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dermis.apps.viewer.state import UndoHistory, ViewerState, load_state, save_state, states_equal
from dermis.base.errors import DermisError
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.scene import Environment, Scene, load_scene
from dermis.scene.files import preset_lights
from dermis.scene.skin import Pigments


def full_state(state: ViewerState) -> ViewerState:
    """Return a state that differs from the defaults in every part."""
    state = state.with_skin(profile="light", roughness=0.21, specular="two-lobe").with_pigments(melanin=0.031)
    state = state.with_lights(preset_lights("rembrandt")).with_environment(Environment(name="uniform"))
    state = state.with_settings(tone="filmic", size=(64, 48), seam_colour=(0.25, 0.5, 1e-7))
    return state.with_camera(state.scene.camera.model_copy(update={"frame_mm": 123.4567}))


def test_saved_state_is_restored_completely(state: ViewerState, tmp_path: Path) -> None:
    before = full_state(state)
    save_state(tmp_path / "scene.toml", before)
    after = load_state(tmp_path / "scene.toml", before)
    assert states_equal(replace(before, light_preset=""), after)


def test_render_command_accepts_the_saved_file(state: ViewerState, tmp_path: Path) -> None:
    before = full_state(state)
    save_state(tmp_path / "scene.toml", before)
    scene, settings = load_scene(tmp_path / "scene.toml")
    assert (scene.skin, scene.camera, settings) == (before.scene.skin, before.scene.camera, before.settings)
    assert tuple(scene.lights) == tuple(before.scene.lights)
    assert scene.environment == before.scene.environment
    assert (scene.head.mesh.positions == before.scene.head.mesh.positions).all()


def test_a_scene_without_lights_stays_without(state: ViewerState, tmp_path: Path) -> None:
    save_state(
        tmp_path / "dark.toml", state.with_light_preset("none").with_environment(Environment(name="uniform"))
    )
    assert load_scene(tmp_path / "dark.toml")[0].lights == ()


def test_scene_files_are_found_from_another_folder(
    state: ViewerState, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "here").mkdir()
    text = "variance_mm2,red,green,blue\n0.5,1,1,1\n"
    (tmp_path / "there" / "mine.csv").write_text(text)
    monkeypatch.chdir(tmp_path / "there")
    save_state(tmp_path / "here" / "scene.toml", state.with_skin(profile="mine.csv"))
    monkeypatch.chdir(tmp_path)
    scene, _ = load_scene(tmp_path / "here" / "scene.toml")
    assert scene.skin.profile == str(tmp_path / "there" / "mine.csv")


def test_regions_round_trip(head: Head, head_file: Path, tmp_path: Path) -> None:
    before = ViewerState(Scene(head), head={"name": str(head_file), "regions": "default"})
    save_state(tmp_path / "scene.toml", before.with_skin(oiliness=0.5))
    text = (tmp_path / "scene.toml").read_text()
    assert "rho_s" not in text and "oiliness = 0.5" in text


def test_the_same_head_is_not_loaded_again(state: ViewerState, tmp_path: Path) -> None:
    save_state(tmp_path / "scene.toml", state)
    assert load_state(tmp_path / "scene.toml", state).scene.head is state.scene.head
    assert load_state(tmp_path / "scene.toml").scene.head is not state.scene.head


def test_a_head_made_in_memory_cannot_be_saved(head: Head, tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="it was created in memory"):
        save_state(tmp_path / "scene.toml", ViewerState(Scene(head)))
    assert not (tmp_path / "scene.toml").exists()


def test_impossible_values_are_refused(state: ViewerState) -> None:
    with pytest.raises(DermisError, match="roughness"):
        state.with_skin(roughness=7.0)


def test_pigment_changes_accumulate(state: ViewerState) -> None:
    found = state.with_pigments(melanin=0.1).with_pigments(blood=0.02).scene.skin.pigments
    assert found == Pigments(melanin=0.1, blood=0.02)


def test_undo_and_redo_walk_through_the_states(state: ViewerState) -> None:
    history = UndoHistory(state)
    states = [state] + [state.with_skin(mix=mix) for mix in (0.1, 0.2, 0.3)]
    for one in states[1:]:
        history.change(one)
    for one in reversed(states[:-1]):
        history.undo()
        assert history.state is one
    assert not history.can_undo
    for one in states[1:]:
        history.redo()
        assert history.state is one
    assert not history.can_redo


def test_gesture_is_one_undo_step(state: ViewerState) -> None:
    history = UndoHistory(state)
    for mix in (0.1, 0.2, 0.3):
        history.change(state.with_skin(mix=mix), "slide")
    history.end_gesture()
    history.change(state.with_skin(mix=0.4), "slide")
    history.undo()
    assert history.state.scene.skin.mix == 0.3
    history.undo()
    assert history.state is state


def test_change_clears_the_redo_history(state: ViewerState) -> None:
    history = UndoHistory(state)
    history.change(state.with_skin(mix=0.1))
    history.undo()
    history.change(state.with_skin(mix=0.2))
    assert not history.can_redo


def test_unchanged_state_is_no_step_and_history_is_limited(state: ViewerState) -> None:
    history = UndoHistory(state)
    history.change(state.with_skin(mix=state.scene.skin.mix))
    assert not history.can_undo
    for k in range(1000):
        history.change(state.with_skin(mix=k / 1000))
    steps = 0
    while history.can_undo:
        history.undo()
        steps += 1
    assert steps == 200


def test_states_of_the_skin_are_kept_saved_and_undone(state: ViewerState, tmp_path: Path) -> None:
    human = replace(state, scene=Scene(Human().head(subdivide=0)), head={"name": "human", "subdivide": 0})
    history = UndoHistory(human)
    history.change(human.with_skin_state("blush", 0.6))
    red = history.state
    assert red.scene.state is not None and red.scene.state.weights == {"blush": 0.6}
    assert not states_equal(human, red)
    save_state(tmp_path / "red.toml", red)
    assert states_equal(replace(red, light_preset=""), load_state(tmp_path / "red.toml", red))
    assert red.with_skin_state("blush", 0.0).scene.state is None
    assert red.with_head(state.scene.head, state.head, 0.4).scene.state is None  # it has no pigments
    history.undo()
    assert history.state.scene.state is None
