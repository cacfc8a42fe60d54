"""Selection of adapters, and the errors when none fits."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dermis.base.errors import DermisError
from dermis.gpu import adapters as module
from dermis.gpu import list_adapters, open_device
from dermis.gpu.adapters import (
    DEFAULT_LIMITS,
    OPTIONAL_FEATURES,
    adapters_like_best_match,
    select_adapters,
)
from dermis.gpu.drivers import driver_advice


def fake(name: str, kind: str, backend: str = "Vulkan", features: tuple[str, ...] = OPTIONAL_FEATURES) -> Any:
    info = {"device": name, "description": f"{name} driver", "adapter_type": kind, "backend_type": backend}
    return SimpleNamespace(info=info, features=set(features))


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that replaces the adapters of this machine: machine(handle, ...)."""
    import_module("wgpu.backends.wgpu_native")  # which a device asks for, whatever stands for its package

    def pretend(*handles: Any) -> None:
        source = SimpleNamespace(enumerate_adapters_sync=lambda: list(handles))
        monkeypatch.setitem(sys.modules, "wgpu", SimpleNamespace(gpu=source))

    return pretend


CPU = fake("llvmpipe", "CPU")
GPU = fake("GeForce", "DiscreteGPU")
PLAIN_GPU = fake("Old", "DiscreteGPU", features=())


@pytest.mark.parametrize(
    ("handles", "chosen"),
    [
        ((CPU, GPU), "GeForce"),
        ((CPU, fake("Iris", "IntegratedGPU"), GPU), "GeForce"),
        ((CPU, fake("Iris", "IntegratedGPU")), "Iris"),
        ((fake("softpipe", "CPU", features=()), CPU), "llvmpipe"),
        ((CPU, PLAIN_GPU), "Old"),
        ((fake("GL", "DiscreteGPU", "OpenGL"), GPU), "GeForce"),
        ((fake("GL", "DiscreteGPU", "OpenGL"), CPU), "llvmpipe"),
        ((CPU, fake("Odd", "SomethingNew")), "Odd"),
    ],
)
def test_auto_selects_the_best_adapter(machine: Any, handles: tuple[Any, ...], chosen: str) -> None:
    machine(*handles)
    assert select_adapters("auto")[0][0].name == chosen


def test_cpu_takes_the_software_adapter_with_all_features(machine: Any) -> None:
    machine(GPU, fake("softpipe", "CPU", features=()), CPU)
    (adapter, *_), reason = select_adapters("cpu")
    assert (adapter.name, adapter.features) == ("llvmpipe", OPTIONAL_FEATURES)
    assert "software" in reason


@pytest.mark.parametrize("wanted", ["gefo", "GEFORCE", "GeForce driver"])
def test_adapters_match_part_of_a_name(machine: Any, wanted: str) -> None:
    machine(CPU, GPU)
    assert select_adapters(wanted)[0][0].name == "GeForce"


def test_equal_adapter_names_are_distinguished_by_numbers(machine: Any) -> None:
    first, second = fake("H200", "DiscreteGPU"), fake("H200", "DiscreteGPU")
    machine(CPU, first, second)
    assert [one.number for one in list_adapters()] == [0, 1, 2]
    assert select_adapters("#0")[0][0].handle is first
    assert [one.handle for one in select_adapters("#1")[0]] == [second]
    with pytest.raises(DermisError, match=r"adapter '#3': .*#0 H200 \(Vulkan\).*#2 llvmpipe"):
        select_adapters("#3")


def test_all_gpus_of_the_best_kind_are_taken_once_each(machine: Any) -> None:
    twice = [fake("H200", "DiscreteGPU"), fake("H200", "DiscreteGPU")]
    machine(CPU, fake("Iris", "IntegratedGPU"), *twice, fake("H200", "DiscreteGPU", "D3D12"), CPU)
    assert [one.handle for one in adapters_like_best_match("auto")] == twice
    assert [one.handle for one in adapters_like_best_match("#1")] == twice[1:]
    assert [one.name for one in adapters_like_best_match("cpu")] == ["llvmpipe"]


def test_only_optional_features_are_listed() -> None:
    assert module._describe_adapter(fake("x", "CPU", features=("shader-f16",))).features == ()


@pytest.mark.parametrize("wanted", ["auto", "cpu", "GeForce"])
def test_missing_adapter_is_refused(machine: Any, wanted: str) -> None:
    machine()
    with pytest.raises(DermisError, match="Vulkan") as caught:
        select_adapters(wanted)
    assert driver_advice() in str(caught.value)


@pytest.mark.parametrize("wanted", ["auto", "cpu"])
def test_opengl_alone_is_taken_only_by_its_name(machine: Any, wanted: str) -> None:
    machine(fake("Mesa", "CPU", "OpenGL"))
    with pytest.raises(DermisError, match="OpenGL") as caught:
        select_adapters(wanted)
    assert driver_advice() in str(caught.value)
    assert select_adapters("mesa")[0][0].backend == "OpenGL"


def test_missing_software_adapter_is_refused(machine: Any) -> None:
    machine(GPU)
    with pytest.raises(DermisError, match="GeForce") as caught:
        select_adapters("cpu")
    assert driver_advice() in str(caught.value)


def test_unknown_adapter_name_lists_known_ones() -> None:
    with pytest.raises(DermisError, match="nonsense") as caught:
        open_device("nonsense")
    assert all(adapter.name in str(caught.value) for adapter in list_adapters())


def broken(**limits: int) -> Any:
    """Return an adapter that cannot be opened."""

    def fail(**_: Any) -> None:
        raise RuntimeError("out of everything")

    made = fake("GeForce", "DiscreteGPU")
    made.limits = DEFAULT_LIMITS | {name.replace("_", "-"): value for name, value in limits.items()}
    made.request_device_sync = fail
    return made


def test_driver_failure_is_reported(machine: Any) -> None:
    machine(broken())
    with pytest.raises(DermisError, match=r"GeForce.*out of everything.*--adapter cpu"):
        open_device("auto")


def test_adapter_with_small_texture_limit_is_accepted(machine: Any) -> None:
    machine(broken(max_texture_dimension_2d=2048, max_buffer_size=1 << 20))
    with pytest.raises(DermisError, match="out of everything"):
        open_device("auto")


@pytest.mark.parametrize(
    "name", ["max_storage_textures_per_shader_stage", "max_compute_invocations_per_workgroup"]
)
def test_an_adapter_that_cannot_run_the_programs_is_refused(machine: Any, name: str) -> None:
    machine(broken(**{name: 2}))
    named = name.replace("_", "-")
    with pytest.raises(DermisError, match=rf"adapter GeForce: expected {named} of .+, but it has 2\. Choose"):
        open_device("auto")


@pytest.mark.parametrize("words", [["render", "-o", "a.png"], ["doctor"], ["head", "-o", "a.glb"]])
def test_a_machine_without_drivers_is_told_what_to_install(tmp_path: Path, words: list[str]) -> None:
    nowhere = dict.fromkeys(("VK_ICD_FILENAMES", "VK_DRIVER_FILES"), "/nowhere")
    ended = subprocess.run(
        [sys.executable, "-m", "dermis", *words],
        env=os.environ | nowhere,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    said = ended.stdout + ended.stderr
    assert ended.returncode == 2 and "Traceback" not in said and not list(tmp_path.iterdir())
    assert "adapter: expected a Vulkan, Metal or DX12 adapter, but" in said and driver_advice() in said
