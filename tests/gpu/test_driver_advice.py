"""Advice on drivers for the system on which dermis runs."""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import pytest

from dermis.gpu import drivers
from dermis.gpu.drivers import all_driver_advice, driver_advice

WSL = "Linux version 5.15.167.4-microsoft-standard-WSL2 (root@build) (gcc 11.2.0) #1 SMP"
LINUX = "Linux version 6.1.0-50-amd64 (debian-kernel@lists.debian.org) #1 SMP PREEMPT_DYNAMIC"
UBUNTU = {"ID": "ubuntu", "ID_LIKE": "debian"}


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Return the monkeypatch after replacing this machine by Ubuntu outside of containers."""
    for name in ("COLAB_RELEASE_TAG", "KUBERNETES_SERVICE_HOST"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(platform, "freedesktop_os_release", lambda: UBUNTU)
    monkeypatch.setattr(drivers, "_CONTAINER_FILES", ())
    monkeypatch.setattr(drivers, "_kernel_version", lambda: LINUX)
    return monkeypatch


@pytest.mark.parametrize(
    ("fields", "advice"),
    [
        ({"ID": "debian"}, "On Debian or Ubuntu: sudo apt-get install libvulkan1 mesa-vulkan-drivers"),
        ({"ID": "linuxmint", "ID_LIKE": "ubuntu debian"}, "On Debian or Ubuntu: sudo apt-get"),
        ({"ID": "fedora"}, "On Fedora: sudo dnf install"),
        ({"ID": "rocky", "ID_LIKE": "rhel centos fedora"}, "On Fedora: sudo dnf install"),
        ({"ID": "arch"}, "On Arch Linux: sudo pacman -S"),
        ({"ID": "manjaro", "ID_LIKE": "arch"}, "On Arch Linux: sudo pacman -S"),
        ({"ID": "nixos"}, "On other systems: install the Vulkan loader"),
        ({}, "On other systems: install the Vulkan loader"),
    ],
)
def test_distribution_is_that_of_os_release(
    machine: pytest.MonkeyPatch, fields: dict[str, str], advice: str
) -> None:
    machine.setattr(platform, "freedesktop_os_release", lambda: fields)
    assert driver_advice().startswith(advice)


def test_system_without_os_release(machine: pytest.MonkeyPatch) -> None:
    def missing() -> dict[str, str]:
        raise FileNotFoundError

    machine.setattr(platform, "freedesktop_os_release", missing)
    assert driver_advice().startswith("On other systems: ")
    for name, expected in (
        ("win32", "On Windows: update Windows"),
        ("darwin", "On macOS: use --adapter auto"),
    ):
        machine.setattr(sys, "platform", name)
        assert driver_advice().startswith(expected)


def test_container_wsl_and_colab(machine: pytest.MonkeyPatch, tmp_path: Path) -> None:
    machine.setattr(drivers, "_kernel_version", lambda: WSL)
    assert driver_advice().startswith("In WSL2: sudo apt-get install") and "in Windows" in driver_advice()
    # Docker Desktop runs containers on the kernel of WSL2.
    machine.setattr(drivers, "_CONTAINER_FILES", (str(tmp_path),))
    assert driver_advice().startswith("In a container: apt-get install")
    machine.setattr(platform, "freedesktop_os_release", lambda: {"ID": "alpine"})
    assert driver_advice().startswith("In a container: install the Vulkan loader")
    assert "NVIDIA_DRIVER_CAPABILITIES=graphics" in driver_advice()
    machine.setenv("COLAB_RELEASE_TAG", "release-colab-external_20260901")
    assert driver_advice().startswith("In Google Colab: !apt-get install -y")


def test_pods_are_containers(machine: pytest.MonkeyPatch) -> None:
    machine.setenv("KUBERNETES_SERVICE_HOST", "10.0.0.1")
    assert driver_advice().startswith("In a container: apt-get install")


def test_advice_for_each_system_is_one_line_without_gaps() -> None:
    advice = all_driver_advice()
    assert len(advice) == len(set(advice.values())) == 9
    assert not any("\n" in text or "{" in text or text.endswith(".") for text in advice.values())
