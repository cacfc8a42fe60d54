"""Options and scene files of living skin: states, pulse and their refusals; nothing is rendered."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis import DermisError, Human, Pulse, Scene, SkinState, StateEvent
from dermis.cli.living_options import check_constant_states, parse_pulse, parse_states
from dermis.human.hair.look import HairLook
from dermis.human.person_file import write_person_json
from dermis.scene.files import load_scene
from dermis.scene.saving import save_scene, scene_text
from dermis.scene.settings import Settings

Run = Callable[..., Any]


@pytest.fixture
def recording(tmp_path: Path) -> str:
    times = np.arange(0, 5, 0.02)
    lines = [f"{time:g},{math.sin(7 * time):.6f}" for time in times]
    (tmp_path / "ppg.csv").write_text("time,value\n" + "\n".join(lines))
    return str(tmp_path / "ppg.csv")


@pytest.fixture
def beat(tmp_path: Path) -> str:
    (tmp_path / "beat.csv").write_text("\n".join(f"{math.sin(k / 4):.6f}" for k in range(25)))
    return str(tmp_path / "beat.csv")


@pytest.fixture(scope="module")
def person_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a bald person."""
    path = tmp_path_factory.mktemp("person") / "bald.json"
    write_person_json(path, Human(hair=HairLook("none")))
    return path


def test_a_rate_a_recording_and_a_waveform_are_parsed(recording: str, beat: str) -> None:
    assert parse_pulse(None, {}) is None
    assert parse_pulse("66", {"seed": 3}) == Pulse(rate_per_min=66, seed=3)
    assert parse_pulse("66", {"waveform": beat}) == Pulse(rate_per_min=66, waveform=beat)
    assert parse_pulse(recording, {"amplitude": 0.1}) == Pulse(waveform=recording, amplitude=0.1)


@pytest.mark.parametrize(
    ("pulse", "options", "message"),
    [
        (None, {"seed": 3}, "--pulse-seed: expected --pulse"),
        ("fast", {}, "--pulse: expected a heart rate"),
        ("300", {}, "--pulse: expected a number from 20 to 250"),
        ("nan", {}, "--pulse: expected a number"),
        ("72", {"amplitude": 3}, "--pulse-amplitude: expected"),
        ("72", {"waveform": "RECORDING"}, "--pulse-waveform: expected a file with one column"),
        ("RECORDING", {"variability_ms": 3.0}, "--pulse-variability: expected a heart rate"),
        ("RECORDING", {"respiration_per_min": 14.0}, "--respiration: expected a heart rate"),
        ("RECORDING", {"waveform": "BEAT"}, "--pulse-waveform: expected a heart rate"),
        ("BEAT", {}, "--pulse: expected a recording with two columns"),
        ("missing.csv", {}, "missing.csv: expected"),
    ],
)
def test_unusable_pulses_are_refused(
    recording: str, beat: str, pulse: str | None, options: dict[str, Any], message: str
) -> None:
    files = {"RECORDING": recording, "BEAT": beat}
    given = {name: files.get(value, value) for name, value in options.items()}
    with pytest.raises(DermisError) as refusal:
        parse_pulse(files.get(pulse, pulse) if pulse else None, given)
    assert message in str(refusal.value)


def test_states_are_parsed() -> None:
    found = parse_states(["blush=0.6@2-8, cold=1", "pallor=.5@1"])
    assert found == [StateEvent("blush", 0.6, 2, 8), StateEvent("cold", 1), StateEvent("pallor", 0.5, 1)]
    constant = parse_states(["cold=0.5", "blush=0.2,blush=0.3,cold=0.9"])
    assert check_constant_states(constant) == pytest.approx({"cold": 1.0, "blush": 0.5})


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("blsh=1", "one of blush, pallor, cold, exertion, crying"),
        ("blush=1.2", "blush: expected a number from 0 to 1"),
        ("blush=-0.1", "blush: expected a number from 0 to 1"),
        ("blush=nan", "blush: expected a number from 0 to 1"),
        ("blush", "NAME=WEIGHT"),
        ("blush=much", "NAME=WEIGHT"),
        ("blush=1@", "NAME=WEIGHT"),
        ("blush=1,", "NAME=WEIGHT"),
        ("blush=1@5-2", "a begin before the end"),
        ("blush=1@nan-2", "a begin before the end"),
    ],
)
def test_unusable_states_are_refused(value: str, message: str) -> None:
    with pytest.raises(DermisError, match="--state: .*" + message):
        parse_states([value])


def test_pictures_have_no_times_and_files_of_parameters_no_states(run: Run, tmp_path: Path) -> None:
    for command in (
        ("render", "human", "--state", "blush=1@2"),
        ("head", "-o", tmp_path / "a.json", "--state", "blush=1"),
    ):
        outcome = run(*command)
        assert (outcome.code, outcome.stderr.count("\n")) == (2, 1) and "--state" in outcome.stderr
    assert not (tmp_path / "a.json").exists()


def test_scene_files_keep_states(person_file: Path, tmp_path: Path) -> None:
    table = {"name": str(person_file), "subdivide": 1}
    file, settings = tmp_path / "scene.toml", Settings()
    for state in (None, SkinState(), SkinState({"blush": 0.3, "cold": 1.0})):
        head = Human(hair=HairLook("none")).head(subdivide=0)
        save_scene(file, Scene(head, state=state), settings, table)
        loaded = load_scene(file)[0].state
        assert (None if loaded is None else loaded.weights) == (None if state is None else state.weights)
    pulsating = Scene(head, state=SkinState(blood=np.zeros(16)))
    with pytest.raises(DermisError, match="pulse"):
        scene_text(pulsating, settings, table)
    for text, message in (
        ("blsh = 1.0", "one of blush"),
        ("cold = 2.0", "from 0 to 1"),
        ('cold = "a"', "cold"),
    ):
        file.write_text(f'[head]\nname = "{person_file.name}"\n[state]\n{text}\n')
        person_file.with_name("scene.toml").write_text(file.read_text())
        with pytest.raises(DermisError, match=message):
            load_scene(person_file.with_name("scene.toml"))


def _animation(run: Run, monkeypatch: pytest.MonkeyPatch, *words: object) -> Any:
    """Return the scene that `dermis animate` would render, and the numbers of its frames."""
    found: list[Any] = []

    def note_frames(animation: Any, numbers: Any, *_: object) -> str:
        found.append((animation, list(numbers)))
        return "none"

    monkeypatch.setattr("dermis.cli.animate._render_frames", note_frames)
    outcome = run("animate", *words)
    assert outcome.code == 0, outcome.stderr
    return found[0]


def test_animations_follow_events_and_pulse(
    run: Run, monkeypatch: pytest.MonkeyPatch, person_file: Path, recording: str, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    common = person_file, "--subdivide", 1, "-o", "%03d.png", "--size", "64x64"
    states = "--state", "blush=0.2", "--state", "blush=0.8@1-6,cold=0.5"
    animation, numbers = _animation(run, monkeypatch, *common, *states, "--fps", 10)
    assert len(numbers) == 100 and not animation.hair_motion
    first, late = animation.scenes([0, 60])
    assert first.state.weights == {"cold": 0.5, "blush": 0.2}
    assert late.state.weights["blush"] == pytest.approx(0.2 + 0.8 * (1 - math.exp(-5 / 4)))
    record = "--pulse-record", "truth.csv"
    animation, numbers = _animation(run, monkeypatch, *common, "--pulse", recording, *record, "--fps", 10)
    rows = np.loadtxt("truth.csv", delimiter=",", skiprows=1)
    assert len(numbers) == 50 == len(rows)  # the whole recording
    assert next(animation.scenes([3])).state.blood[0] == pytest.approx(rows[3, 1])


@pytest.mark.parametrize(("motion_mm", "swings"), [(0, False), (0.1, False), (2, True)])
def test_hair_swings_only_when_the_head_moves_visibly(
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    person_file: Path,
    tmp_path: Path,
    motion_mm: float,
    swings: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    words = person_file, "--subdivide", 1, "-o", "%03d.png", "--size", "64x64", "--pulse", 72, "--to", 1
    assert _animation(run, monkeypatch, *words, "--pulse-head-motion", motion_mm)[0].hair_motion is swings


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--pulse-record", "a.csv"), "--pulse-record: expected --pulse"),
        (("--pulse", 72, "--pulse-record", "missing/a.csv"), "missing"),
        (("--pulse", "RECORDING", "--pulse-record", "RECORDING"), "another file"),
        (("--pulse", "RECORDING", "--to", 20), "the length of the recording"),
    ],
)
def test_animations_are_refused_before_rendering(
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    person_file: Path,
    recording: str,
    tmp_path: Path,
    words: tuple[object, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dermis.cli.animate._render_frames", None)
    given = (recording if word == "RECORDING" else word for word in words)
    outcome = run("animate", person_file, "--subdivide", 1, "-o", "%03d.png", "--size", "64x64", *given)
    assert outcome.code == 2 and message in outcome.stderr
    assert outcome.stderr.count("dermis: ") == 1


def test_another_recording_with_the_same_name_is_not_the_same_animation(
    run: Run, monkeypatch: pytest.MonkeyPatch, person_file: Path, recording: str, tmp_path: Path
) -> None:
    from dermis.cli import animate

    monkeypatch.chdir(tmp_path)
    digests, digest = [], animate._frame_digest
    monkeypatch.setattr(animate, "_frame_digest", lambda *args: digests.append(digest(*args)) or digests[-1])
    words = person_file, "--subdivide", 1, "-o", "%03d.png", "--size", "64x64", "--pulse", recording
    for text in ("", "\n9,1\n"):
        Path(recording).write_text(Path(recording).read_text() + text)
        _animation(run, monkeypatch, *words, "--to", 1)
    assert digests[0] != digests[1]
