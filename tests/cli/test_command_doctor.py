"""`dermis doctor` on this machine, on one without adapters, and on one whose only adapter is broken."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from typing import Any

import pytest

from dermis.frame.rendered_frame import RenderedFrame
from dermis.gpu.adapters import OPTIONAL_FEATURES, Adapter

Run = Callable[..., Any]
KEYS = {"healthy", "used", "self_test", "problem", "adapters"} | {
    "python",
    "platform",
    "libraries",
    "cache",
    "samples",
}


class _BrokenHandle:
    limits = dict.fromkeys(
        ("max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size"), 8192
    )
    features: tuple[str, ...] = ()

    def request_device_sync(self, **_: object) -> None:
        raise RuntimeError("vkCreateDevice failed")


BROKEN = Adapter("Voodoo 3", "glide", "DiscreteGPU", "Vulkan", (), _BrokenHandle())


def test_healthy_machine_as_json(run: Run, opened: None, device: Any) -> None:
    ended = run("doctor", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)
    assert set(report) == KEYS
    assert report["healthy"] is True and report["problem"] is None
    assert set(report["used"]) == {"name", "backend", "reason", "half_store_rounding"}
    assert report["used"]["name"] == device.adapter.name
    assert report["used"]["half_store_rounding"] in ("nearest", "toward zero", "other")
    assert report["self_test"]["passed"] is True
    assert report["self_test"]["centre"] == pytest.approx(1, abs=0.02)
    assert all(set(adapter["features"]) == set(OPTIONAL_FEATURES) for adapter in report["adapters"])
    assert {"dermis", "wgpu", "numpy"} <= set(report["libraries"])
    assert "lee_perry_smith" in report["samples"]


def test_sources_that_were_never_installed_have_no_version(
    run: Run, opened: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("dermis.cli.doctor.version", unknown)
    assert set(json.loads(run("doctor", "--json").stdout)["libraries"].values()) == {"not installed"}


def test_healthy_machine_in_words(run: Run, opened: None, device: Any) -> None:
    ended = run("doctor")
    assert (ended.code, ended.stderr) == (0, "")
    assert ended.stdout.endswith("\nhealthy\n")
    for word in (
        device.adapter.name,
        "timestamp-query",
        "half-float stores",
        "test frame: passed",
        "lee_perry_smith",
    ):
        assert word in ended.stdout


def test_a_wrongly_lit_test_frame_is_reported(
    run: Run, opened: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = RenderedFrame.linear
    monkeypatch.setattr(RenderedFrame, "linear", lambda self: 0.5 * whole(self))
    ended = run("doctor")
    assert ended.code == 2
    assert "test frame: FAILED" in ended.stdout
    assert "NOT healthy: the brightness of the test frame" in ended.stdout


@pytest.mark.usefixtures("unopened")
@pytest.mark.parametrize(
    ("adapters", "problem"),
    [
        ([], "this machine shows none"),
        ([BROKEN], "Voodoo 3: expected it to open, but its driver reports: vkCreateDevice failed"),
    ],
)
def test_machine_that_cannot_render(
    run: Run, monkeypatch: pytest.MonkeyPatch, adapters: list[Adapter], problem: str
) -> None:
    monkeypatch.setattr("dermis.gpu.adapters.list_adapters", lambda: adapters)
    spoken, written = run("doctor"), run("doctor", "--json")
    assert spoken.code == written.code == 2
    assert spoken.stderr == written.stderr == ""
    assert "NOT healthy: adapter" in spoken.stdout and problem in spoken.stdout
    report = json.loads(written.stdout)
    assert report["healthy"] is False and report["used"] is None and problem in report["problem"]
    assert [adapter["name"] for adapter in report["adapters"]] == [a.name for a in adapters]
    assert ("drivers" in report) == ("graphics drivers:" in spoken.stdout) == (not adapters)


@pytest.mark.usefixtures("unopened")
def test_machine_without_drivers_is_told_what_to_install_on_each_system(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.gpu.adapters.list_adapters", list)
    spoken = run("doctor").stdout
    lines = spoken.partition("graphics drivers:\n")[2].partition("python ")[0].splitlines()
    places = "Debian", "Fedora", "Arch", "other", "Windows", "macOS", "container", "WSL2", "Colab"
    for place, line in zip(places, lines, strict=True):
        assert place in line.partition(": ")[0] and line.partition(": ")[2]


@pytest.mark.usefixtures("unopened")
def test_drivers_are_listed_if_only_the_software_adapter_is_missing(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.gpu.adapters.list_adapters", lambda: [BROKEN])
    assert "drivers" not in json.loads(run("doctor", "--json").stdout)
    assert "drivers" in json.loads(run("doctor", "--adapter", "cpu", "--json").stdout)


@pytest.mark.usefixtures("unopened")
def test_broken_adapter_is_named_by_render_too(
    run: Run, folder: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.gpu.adapters.list_adapters", lambda: [BROKEN])
    ended = run("render", "head.obj", "--size", "32x32", "--atlas", "64")
    assert (ended.code, ended.stdout) == (2, "")
    assert "adapter Voodoo 3" in ended.stderr and "--adapter cpu" in ended.stderr


def test_unknown_adapter(run: Run) -> None:
    ended = run("doctor", "--adapter", "voodoo", "--json")
    assert ended.code == 2
    assert "adapter 'voodoo'" in json.loads(ended.stdout)["problem"]
