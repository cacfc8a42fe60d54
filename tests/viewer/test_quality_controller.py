"""Adaptive quality of frames in motion."""

from __future__ import annotations

from dermis.apps.viewer.view_renderer import QUALITY_LEVELS, QualityController
from dermis.scene.settings import Settings

WANTED = Settings(atlas=2048, samples=4, shadow_size=2048)


def noted(quality_controller: QualityController, *frames_ms: float) -> QualityController:
    for frame_ms in frames_ms:
        quality_controller.record_frame_time(frame_ms)
    return quality_controller


def test_still_frame_has_full_quality() -> None:
    found = noted(QualityController(is_software_adapter=True), *[900.0] * 20).limited_settings(
        WANTED, (640, 480), is_moving=False
    )
    assert (found.size, found.atlas, found.samples, found.shadow_size) == ((640, 480), 2048, 4, 2048)


def test_a_software_adapter_begins_with_one_sample_and_a_small_atlas() -> None:
    found = QualityController(is_software_adapter=True).limited_settings(WANTED, (640, 480), is_moving=True)
    assert (found.size, found.atlas, found.samples) == ((640, 480), 512, 1)


def test_gpu_begins_with_full_quality() -> None:
    assert (
        QualityController(is_software_adapter=False)
        .limited_settings(WANTED, (640, 480), is_moving=True)
        .samples
        == 4
    )


def test_slow_frames_lower_the_effort_and_fast_ones_raise_it_again() -> None:
    quality_controller = noted(QualityController(is_software_adapter=True), *[400.0] * 20)
    assert quality_controller.quality is QUALITY_LEVELS[-1]
    assert noted(quality_controller, *[10.0] * 20).quality is QUALITY_LEVELS[2]


def test_single_slow_frame_changes_nothing() -> None:
    quality_controller = noted(QualityController(is_software_adapter=True), 400.0, 90.0, 400.0, 90.0)
    assert quality_controller.quality is QUALITY_LEVELS[2]


def test_quality_is_stable_within_the_budget() -> None:
    quality_controller = noted(QualityController(is_software_adapter=True), *[400.0] * 2)
    level = quality_controller.quality
    assert noted(quality_controller, *[95.0] * 20).quality is level


def test_quality_is_never_above_the_request() -> None:
    small = Settings(atlas=128, samples=1, shadow_size=64)
    found = QualityController(is_software_adapter=False).limited_settings(small, (8, 8), is_moving=True)
    assert (found.atlas, found.samples, found.shadow_size) == (128, 1, 64)


def test_a_huge_window_takes_fewer_samples() -> None:
    found = QualityController(is_software_adapter=False).limited_settings(
        Settings(samples=64), (8192, 4096), is_moving=False
    )
    assert found.size == (8192, 4096) and found.samples == 4
