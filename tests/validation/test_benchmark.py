"""Benchmarks: floors against direct counts, cases that differ in one parameter, complete runs."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.validation.benchmarks import run as running
from dermis.apps.validation.benchmarks.cases import (
    BENCHMARK_PRESETS,
    FRAGMENT_TECHNIQUE,
    GPU_GEMS_3,
    BenchmarkCase,
    case_scenes,
    case_settings,
    with_gaussian_count,
)
from dermis.apps.validation.benchmarks.floor import copy_rate, frame_traffic, stage_bytes
from dermis.apps.validation.benchmarks.measure import (
    CPU_FRAME_COUNTS,
    BenchmarkRow,
    FrameCounts,
    measure_case,
)
from dermis.apps.validation.benchmarks.report import (
    COLUMNS,
    benchmark_json,
    row_cells,
    skipped_lines,
    stage_table,
    write_report,
)
from dermis.apps.validation.benchmarks.run import Benchmark, SkippedCase, run_benchmark
from dermis.base.errors import DermisError
from dermis.frame.features.surface.texels import SURFACE_TEXEL_BYTES
from dermis.frame.renderer import Renderer
from dermis.gpu import Device, download
from dermis.gpu.textures import texel_bytes
from dermis.optics.profiles import load_profile
from dermis.scene.heads import load_head

TINY = BenchmarkCase((48, 32), atlas=64, gaussians=2, lights=1, samples=2)
BRIEF = FrameCounts(warmup=1, between=1, timed=2, sequence=2)


@pytest.fixture(scope="module")
def head_file(tmp_path_factory: pytest.TempPathFactory) -> str:
    from small_head import write_head

    path = tmp_path_factory.mktemp("head") / "head.obj"
    write_head(path)
    return str(path)


@pytest.fixture(scope="module")
def renderer(device: Device) -> Renderer:
    return Renderer(device.adapter.name)


@pytest.fixture(scope="module")
def row(renderer: Renderer, head_file: str, tmp_path_factory: pytest.TempPathFactory) -> BenchmarkRow:
    head, folder = load_head(head_file, subdivide=0), tmp_path_factory.mktemp("profile")
    return measure_case(renderer, TINY, head, folder, 1e9, BRIEF)


@pytest.mark.parametrize("preset", BENCHMARK_PRESETS.values(), ids=BENCHMARK_PRESETS)
def test_cases_vary_one_parameter(preset: object) -> None:
    base_case, *others = preset.cases()  # type: ignore[attr-defined]
    assert base_case.varies == ""
    assert {GPU_GEMS_3, FRAGMENT_TECHNIQUE} == {
        case.technique for case in others if case.varies == "technique"
    }
    for case in others:
        fields = asdict(replace(case, varies=""))
        assert [name for name, value in asdict(base_case).items() if fields[name] != value] == [case.varies]


@pytest.mark.parametrize("count", [1, 2, 5, 6, 8])
def test_profiles_of_any_length_keep_the_albedo(count: int) -> None:
    published = load_profile("gpu-gems-3")
    profile = with_gaussian_count(published, count)
    assert len(profile.variance_mm2) == count
    assert np.allclose(profile.albedo, published.albedo)
    assert np.isclose(profile.variance_mm2[-1], published.variance_mm2[-1])


def test_cameras_and_lights_move(head_file: str, tmp_path: Path) -> None:
    case = replace(TINY, lights=5)
    scenes = case_scenes(case, load_head(head_file, subdivide=0), tmp_path, 3)
    assert len({scene.camera for scene in scenes}) == 3
    assert all(len({light.position for light in scene.lights}) == 5 for scene in scenes)  # type: ignore[union-attr]
    assert len({scene.lights[4] for scene in scenes}) == 3


def test_bandwidth_bound_matches_a_manual_calculation(
    renderer: Renderer, head_file: str, tmp_path: Path
) -> None:
    head = load_head(head_file, subdivide=0)
    (scene,), settings = case_scenes(TINY, head, tmp_path, 1), case_settings(TINY)
    image = renderer.draw(scene, settings).srgb8()
    traffic = frame_traffic(renderer.device, renderer.prepare(scene, settings), len(head.mesh.positions))
    assert 0.1 < traffic.head_pixels / (48 * 32) < 0.9
    assert traffic.head_pixels >= np.count_nonzero(image.any(axis=2))
    assert 0 < traffic.texels < 64 * 64
    found = stage_bytes(traffic)
    geometry = 16 * len(head.mesh.triangles) + 16 * len(head.mesh.positions)
    depth = download(renderer.device, traffic.inputs.resources.shadow_maps.texture)
    drawn = int((depth > 0).sum())
    assert 0.1 < drawn / settings.shadow_size**2 < 0.9
    assert found["shadows"] == drawn * 4 + geometry
    assert found["visibility"] == traffic.head_pixels * 2 * 4 + geometry
    assert found["post"] == 48 * 32 * (16 + 16 + 4)
    # The narrower Gaussian is not blurred; the blur of the other one reads stretch and reach by texel.
    light = texel_bytes(traffic.inputs.resources.diffusion.levels.stacks[0])
    gutter = traffic.inputs.layouts[0].atlas.gutter.size // 16
    assert gutter > 0
    assert found["irradiance"] == traffic.texels * (32 + 4 + light)
    assert found["diffuse"] == traffic.texels * (2 * light + 8 + 8) + gutter * (16 + 2 * light)
    assert set(found) >= {"shadows", "irradiance", "diffuse", "combine", "visibility", "shade", "post"}


def test_bandwidth_bound_of_thin_parts_counts_their_buffers(renderer: Renderer, tmp_path: Path) -> None:
    """The floor is computed from the sizes of the buffers."""
    from small_head import obj_text

    vertices = [line.split() for line in obj_text().splitlines()]
    flat = [[*w[:3], str(0.03 * float(w[3]))] if w[:1] == ["v"] else w for w in vertices]
    (tmp_path / "leaf.obj").write_text("\n".join(map(" ".join, flat)))
    head, case = load_head(tmp_path / "leaf.obj", subdivide=0), replace(TINY, gaussians=4)
    (scene,), settings = case_scenes(case, head, tmp_path, 1), case_settings(case)
    renderer.draw(scene, settings)
    traffic = frame_traffic(renderer.device, renderer.prepare(scene, settings), len(head.mesh.positions))
    thin, levels = traffic.inputs.layouts[0].translucency, traffic.inputs.resources.diffusion.levels
    assert thin is not None
    receivers, sources = thin.pairs.receivers[1], thin.pairs.sources[1]
    assert thin.pairs.count > receivers > 10
    words = np.frombuffer(renderer.device.handle.queue.read_buffer(thin.weights), np.uint32)
    assert len(words) == 2 * thin.pairs.count and (words[::2] & 0xFFFFFF).max() == sources - 1
    lists = 8 * thin.pairs.count + (4 + SURFACE_TEXEL_BYTES) * sources + 12 * receivers
    light = min(4 * sources, (levels.size >> traffic.inputs.blurs[0].halvings[1 + thin.source_level]) ** 2)
    assert (
        stage_bytes(traffic)["translucency"] == lists + light * texel_bytes(levels.stacks[0]) + 16 * receivers
    )


def test_row_contains_all_columns(row: BenchmarkRow) -> None:
    assert row.frame_ms > 0 and row.python_ms > 0 and row.image_ms > 0 and row.memory_mb > 0.1
    stages = {name: ms for name, ms in row.gpu_ms.items() if name != "total"}
    assert {"irradiance", "diffuse", "shade"} <= set(stages) and min(stages.values()) > 0
    assert row.floor_ms["total"] == pytest.approx(sum(row.floor_ms.values()) / 2)
    assert set(row.floor_ms) <= set(row.gpu_ms)
    assert row.floor_ratio == row.gpu_ms["total"] / row.floor_ms["total"]


def test_more_work_moves_more_bytes(
    renderer: Renderer, row: BenchmarkRow, head_file: str, tmp_path: Path
) -> None:
    larger = replace(TINY, image=(96, 64), atlas=128, lights=2, gaussians=4)
    more = measure_case(renderer, larger, load_head(head_file, subdivide=0), tmp_path, 1e9, BRIEF)
    for stage in ("shadows", "irradiance", "diffuse", "combine", "visibility", "shade", "post"):
        assert more.floor_ms[stage] > 1.25 * row.floor_ms[stage], stage


def test_copy_bandwidth_is_measured(device: Device) -> None:
    assert 1e7 < copy_rate(device) < 1e14


@pytest.fixture(scope="module")
def benchmark_of_one_row(row: BenchmarkRow) -> Benchmark:
    """Return a benchmark with one measured row."""
    others = [
        replace(row, case=replace(TINY, atlas=128, varies="atlas")),
        replace(row, case=replace(TINY, technique=GPU_GEMS_3, varies="technique"), gpu_ms={"total": 1e3}),
        replace(
            row, case=replace(TINY, technique=FRAGMENT_TECHNIQUE, varies="technique"), gpu_ms={"total": 5e3}
        ),
    ]
    skipped = SkippedCase(replace(TINY, image=(9999, 32), varies="image"), "size: <too large>")
    where = "head", "an <adapter>", "a driver", {"dermis": "1"}, "now", 2e9, 1.0
    return Benchmark(*where, (row, *others), (skipped,))


def test_published_passes_are_included(benchmark_of_one_row: Benchmark, row: BenchmarkRow) -> None:
    assert benchmark_of_one_row.relative_time(GPU_GEMS_3) == 1e3 / row.gpu_ms["total"]
    assert benchmark_of_one_row.relative_time(FRAGMENT_TECHNIQUE) == 5e3 / row.gpu_ms["total"]
    assert replace(benchmark_of_one_row, rows=(row,)).relative_time(GPU_GEMS_3) is None
    assert replace(benchmark_of_one_row, rows=benchmark_of_one_row.rows[1:]).relative_time(GPU_GEMS_3) is None


def test_json_contains_the_requested_cases(benchmark_of_one_row: Benchmark) -> None:
    import json

    fields = json.loads(json.dumps(benchmark_json(benchmark_of_one_row)))
    wanted = {"image", "atlas", "adapter", "gaussians", "lights", "frame_ms", "gpu_ms", "floor_ratio"}
    assert all(wanted <= set(one) for one in fields["rows"])
    assert fields["rows"][0]["image"] == [48, 32] and fields["copy_gb_s"] == 2.0
    assert "total" in fields["rows"][0]["gpu_ms"]
    assert (fields["published_ratio"], fields["published_fragments_ratio"]) == (
        benchmark_of_one_row.relative_time(GPU_GEMS_3),
        benchmark_of_one_row.relative_time(FRAGMENT_TECHNIQUE),
    )
    (skipped,) = fields["left_out"]
    assert (skipped["image"], skipped["reason"]) == ([9999, 32], "size: <too large>")


def test_report_is_self_contained(benchmark_of_one_row: Benchmark, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", benchmark_of_one_row)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "an &lt;adapter&gt;" in page and page.count("<svg") == 2
    assert "src=" not in page and "<script" not in page and 'href="http' not in page
    for stage, *_ in stage_table(benchmark_of_one_row)[1:]:
        assert f"<td>{stage}</td>" in page
    assert page.count("<tr>") == 1 + len(benchmark_of_one_row.rows) + len(stage_table(benchmark_of_one_row))
    assert all(len(row_cells(row)) == len(COLUMNS) for row in benchmark_of_one_row.rows)
    assert "2007, fragments" in page and "9999x32" in page and "&lt;too large&gt;" in page


def test_report_without_the_base_frame_is_written(benchmark_of_one_row: Benchmark, tmp_path: Path) -> None:
    others = replace(benchmark_of_one_row, rows=benchmark_of_one_row.rows[1:])
    assert others.base_row is None and stage_table(others) == []
    write_report(tmp_path / "report.html", others)
    assert "9999x32" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_slow_frames_are_drawn_less_often() -> None:
    effort = FrameCounts()
    assert effort.with_max_duration(30.0, frame_ms=1.0) == effort
    half = effort.with_max_duration(0.5 * 1e-3 * (100 + 2 * 100 + 2 * 9 * 6), frame_ms=1.0)
    assert half == FrameCounts(warmup=50, between=2, timed=4, sequence=50)
    assert CPU_FRAME_COUNTS.with_max_duration(1.0, frame_ms=1e6) == FrameCounts(
        warmup=0, between=0, timed=1, sequence=1
    )


def test_a_run_measures_every_case(device: Device, head_file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "CPU_FRAME_COUNTS", BRIEF)
    monkeypatch.setattr(running, "FrameCounts", lambda: BRIEF)
    steps: list[tuple[int, int]] = []
    cases = [
        TINY,
        replace(TINY, technique=GPU_GEMS_3, varies="technique"),
        replace(TINY, technique=FRAGMENT_TECHNIQUE, varies="technique"),
        replace(TINY, atlas=device.max_texture_size + 1, varies="atlas"),
        replace(TINY, subdivide=1, varies="subdivide"),
    ]
    benchmark = run_benchmark(
        cases, head_file, device.adapter.name, lambda done, of: steps.append((done, of))
    )
    assert steps == [(done, 5) for done in range(5)]
    assert [row.case for row in benchmark.rows] == [*cases[:3], cases[4]]
    assert benchmark.rows[3].triangles == 4 * benchmark.rows[0].triangles
    assert benchmark.adapter == device.adapter.name and benchmark.versions["wgpu"]
    for technique in (GPU_GEMS_3, FRAGMENT_TECHNIQUE):
        assert (benchmark.relative_time(technique) or 0.0) > 0.0
    (skipped,) = benchmark.skipped
    assert skipped.case == cases[3] and "atlas" in skipped.reason
    assert str(device.max_texture_size) in skipped_lines(benchmark)[0]


def test_empty_measurement_is_an_error(device: Device, head_file: str) -> None:
    too_large = replace(TINY, atlas=device.max_texture_size + 1)
    with pytest.raises(DermisError, match=str(device.max_texture_size)):
        run_benchmark([too_large], head_file, device.adapter.name)
