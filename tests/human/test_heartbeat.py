"""Pulse and states over time: form and rate of beats, recordings, time constants, and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import find_peaks

from dermis import DermisError, Human, Pulse, Scene, SkinState, StateEvent
from dermis.base.tables import read_rows
from dermis.human.living.heartbeat import normalised_beat, typical_beat
from dermis.human.living.zones import STATE_NAMES, longest_delay_s, pulse_changes, state_changes, state_times
from dermis.scene.living import state_at


def test_a_typical_beat_has_a_systolic_peak_and_a_dicrotic_notch() -> None:
    beat = normalised_beat(typical_beat())
    assert beat.mean() == pytest.approx(0, abs=1e-12) and np.ptp(beat) == pytest.approx(1)
    peaks, _ = find_peaks(beat)
    (notch,), _ = find_peaks(-beat[peaks[0] : peaks[1]])
    assert len(peaks) == 2 and beat[peaks[0]] > beat[peaks[1]] > beat[peaks[0] + notch]
    assert 0.15 < peaks[0] / len(beat) < 0.3


@pytest.mark.parametrize("rate", [48.0, 72.0, 150.0])
def test_the_spectrum_peaks_at_the_rate(rate: float) -> None:
    times = np.arange(0, 60, 0.02)
    blood = Pulse(rate_per_min=rate, variability_ms=20, respiration_per_min=14).signal().blood(times)
    power = np.abs(np.fft.rfft((blood - blood.mean()) * np.hanning(len(times)), 1 << 16)) ** 2
    frequency = 60 * np.fft.rfftfreq(1 << 16, 0.02)
    band = frequency > 40
    assert frequency[band][power[band].argmax()] == pytest.approx(rate, abs=1.5)


def test_the_beats_of_a_seed_do_not_depend_on_the_length() -> None:
    signal = Pulse(variability_ms=60, seed=3).signal()
    times = np.linspace(0, 5, 51)
    long = signal.blood(np.append(times, 300.0))[:-1]
    np.testing.assert_array_equal(signal.blood(times), long)
    other = Pulse(variability_ms=60, seed=4).signal().blood(times)
    assert np.abs(other - long).max() > 0.1


def test_amplitude_and_delay_of_the_samples() -> None:
    pulse = Pulse(amplitude=0.05, head_motion_mm=0)
    sampled = np.array([pulse.at(t).blood for t in np.arange(0, 5, 0.005)])
    np.testing.assert_allclose(np.ptp(sampled, axis=0), 0.05, rtol=1e-2)
    late = np.interp(np.arange(1, 4, 0.01) - longest_delay_s(), np.arange(0, 5, 0.005), sampled[:, 0])
    np.testing.assert_allclose(
        np.interp(np.arange(1, 4, 0.01), np.arange(0, 5, 0.005), sampled[:, -1]), late, atol=5e-4
    )
    assert 0.01 < longest_delay_s() < 0.1


def test_the_face_moves_by_the_stated_range() -> None:
    moves = np.array([Pulse(head_motion_mm=0.2).truth_at(t)[2] for t in np.arange(0, 4, 0.005)])
    assert np.ptp(moves) == pytest.approx(0.2, rel=0.05)
    head = Human().head(subdivide=0)
    scene = Scene(head, pose={"jawOpen": 0.2})
    before, after = scene, Pulse(head_motion_mm=5).scene_at(scene, 0.06)
    assert after.pose is not None and after.pose.weights == {"jawOpen": 0.2}
    points = [one.head.control_rig.posed_points_mm(one.pose_arrays) for one in (before, after)]
    nose = int(np.where(points[0][:, 1] > head.centre_mm[1], points[0][:, 2], -np.inf).argmax())
    up_mm = float(points[1][nose, 1] - points[0][nose, 1])
    assert up_mm == pytest.approx(Pulse(head_motion_mm=5).truth_at(0.06)[2], rel=0.35)


def test_a_recording_is_followed(tmp_path: Path) -> None:
    times = np.arange(0, 20, 0.02)
    values = 512 + 30 * Pulse(rate_per_min=66).signal().blood(times)
    file = tmp_path / "ppg.csv"
    file.write_text(
        "time,value\n" + "\n".join(f"{t + 100:.3f},{v:.4f}" for t, v in zip(times, values, strict=True))
    )
    pulse = Pulse(waveform=str(file), amplitude=0.03)
    assert pulse.is_recording and pulse.signal().mean_rate_per_min(0, 20) == pytest.approx(66, abs=1)
    found = np.array([pulse.at(t).blood[0] for t in times[:200]])
    assert np.corrcoef(found, values[:200])[0, 1] > 0.999 and np.ptp(found) == pytest.approx(0.03, rel=0.1)
    with pytest.raises(DermisError, match="recording"):
        pulse.at(21.0)
    with pytest.raises(DermisError, match="rate_per_min"):
        Pulse(waveform=str(file), rate_per_min=70)


def test_the_form_of_a_beat_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "beat.csv"
    file.write_text("\n".join(str(1 + np.sin(2 * np.pi * k / 40)) for k in range(40)))
    times = np.linspace(0, 3, 200)
    blood = Pulse(waveform=str(file), rate_per_min=60).signal().blood(times)
    np.testing.assert_allclose(blood, 0.5 * np.sin(2 * np.pi * times), atol=2e-3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,2,3\n1,2,3\n", "one or two numbers"),
        ("", "empty"),
        ("0,1\n0,2\n", "increasing"),
        ("1\n2\n", "at least 8"),
        ("0,1\n3,1\n", "change"),
        ("0,1\n1,nan\n", "one or two numbers"),
    ],
)
def test_unusable_files_are_refused(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DermisError, match=expected):
        Pulse(waveform=str(tmp_path / "a.csv"))


def test_states_rise_and_fall_with_their_time_constants() -> None:
    event = StateEvent("blush", 0.8, 1.0, 9.0)
    rise_s, fall_s = state_times()["blush"]

    def weight(seconds: float) -> float:
        return StateEvent.weights_at([event], seconds)["blush"]

    assert weight(0.9) == 0.0
    assert weight(1.0 + rise_s) == pytest.approx(0.8 * (1 - np.exp(-1)))
    assert weight(9.0 + fall_s) == pytest.approx(weight(9.0) * np.exp(-1))
    assert StateEvent.weights_at([StateEvent("cold", 0.5)], 0.0) == {"cold": 0.5}
    both = state_at([event, StateEvent("blush", 1.0)], 5.0, SkinState({"cold": 0.2, "blush": 0.1}))
    assert both.weights == {"cold": 0.2, "blush": 1.0}


def test_the_tables_name_known_zones_and_states() -> None:
    assert set(STATE_NAMES) == {row["state"] for row in read_rows("dermis.human.living", "states")}
    for name in STATE_NAMES:
        changes = state_changes({name: 0.5})
        np.testing.assert_allclose(2 * changes.zones, state_changes({name: 1.0}).zones)
        assert np.abs(changes.zones).max() > 0
    assert not np.any(state_changes({}).zones) and pulse_changes().masks[0, 2] > 0


def test_wrong_states_are_refused() -> None:
    person = Human().head(subdivide=0)
    for state, match in (({"blsh": 1}, "one of blush"), ({"blush": 1.1}, "from 0 to 1"), ([1], "mapping")):
        with pytest.raises(DermisError, match=match):
            Scene(person, state=state)  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="albedo"):
        Scene(person, state={"blush": 1}, skin={"albedo": "profile"})
    with pytest.raises(DermisError, match="begin"):
        StateEvent("blush", 1, 3, 2)
