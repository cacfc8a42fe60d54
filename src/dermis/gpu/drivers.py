"""Advice on graphics drivers: what to install on this system, and on others."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path

_PACKAGE_COMMANDS = {
    "On Debian or Ubuntu": "apt-get install libvulkan1 mesa-vulkan-drivers",
    "On Fedora": "dnf install vulkan-loader mesa-vulkan-drivers",
    "On Arch Linux": "pacman -S vulkan-icd-loader vulkan-swrast",
}
"""Command, without sudo, that installs the Vulkan loader and a software driver."""
_DISTRIBUTIONS = {
    "debian": "On Debian or Ubuntu",
    "ubuntu": "On Debian or Ubuntu",
    "fedora": "On Fedora",
    "rhel": "On Fedora",
    "arch": "On Arch Linux",
}
"""System by the ID, or by a word of ID_LIKE, in /etc/os-release."""
_OTHER = "On other systems"
_OTHER_COMMAND = "install the Vulkan loader and Mesa's Vulkan drivers"
_SPECIAL_SYSTEMS = {
    "On Windows": "update Windows (DirectX 12 needs version 10 or newer) and the driver of the graphics card",
    "On macOS": "use --adapter auto where the system has Metal, which virtual machines may lack; "
    "macOS has no software adapter",
    "In a container": "{command} in its image, or start it with "
    "--gpus all -e NVIDIA_DRIVER_CAPABILITIES=graphics,utility for NVIDIA's driver",
    "In WSL2": "{sudo_command} to render on the CPU; to use the GPU, run dermis in Windows",
    "In Google Colab": "!apt-get install -y libvulkan1 mesa-vulkan-drivers to render on the CPU",
}
"""Advice for other systems; commands in it are those of the distribution of Linux."""
_CONTAINER_FILES = "/.dockerenv", "/run/.containerenv"  # of Docker and of Podman


def driver_advice() -> str:
    """Return what to install on this system, such as "On Fedora: sudo dnf install mesa-vulkan-drivers"."""
    distribution = _linux_distribution(_os_release())
    is_container = any(Path(name).exists() for name in _CONTAINER_FILES)
    system = _running_system(sys.platform, os.environ, _kernel_version(), is_container) or distribution
    return f"{system}: {_advice(system, distribution)}"


def all_driver_advice() -> dict[str, str]:
    """Return what to install on each system, as a dictionary from "On Fedora" or similar to the advice.

    The commands for containers and WSL2 are those of Debian and Ubuntu.
    """
    systems = [*_PACKAGE_COMMANDS, _OTHER, *_SPECIAL_SYSTEMS]
    return {system: _advice(system, "On Debian or Ubuntu") for system in systems}


def _advice(system: str, distribution: str) -> str:
    """Return what to install on a system; a container or WSL2 runs a distribution of Linux."""
    if template := _SPECIAL_SYSTEMS.get(system):
        command = _PACKAGE_COMMANDS.get(distribution)
        sudo_command = f"sudo {command}" if command else _OTHER_COMMAND
        return template.format(command=command or _OTHER_COMMAND, sudo_command=sudo_command)
    return f"sudo {_PACKAGE_COMMANDS[system]}" if system in _PACKAGE_COMMANDS else _OTHER_COMMAND


def _running_system(
    platform_name: str, environment: Mapping[str, str], kernel_version: str, is_container: bool
) -> str:
    """Return the system as in `_SPECIAL_SYSTEMS`; empty if it is only a distribution of Linux.

    platform_name : value of `sys.platform`
    environment : environment variables
    kernel_version : content of /proc/version
    """
    if platform_name in ("win32", "darwin"):
        return "On Windows" if platform_name == "win32" else "On macOS"
    if "COLAB_RELEASE_TAG" in environment:  # Colab runs in a container
        return "In Google Colab"
    if is_container or "KUBERNETES_SERVICE_HOST" in environment:
        return "In a container"
    return "In WSL2" if "microsoft" in kernel_version.lower() else ""


def _linux_distribution(os_release: Mapping[str, str]) -> str:
    """Return the system as in `_PACKAGE_COMMANDS`, or `_OTHER`, from the fields of /etc/os-release."""
    names = [os_release.get("ID", ""), *os_release.get("ID_LIKE", "").split()]
    return next((_DISTRIBUTIONS[name] for name in names if name in _DISTRIBUTIONS), _OTHER)


def _os_release() -> dict[str, str]:
    try:
        return platform.freedesktop_os_release()
    except OSError:  # not Linux, or without this file
        return {}


def _kernel_version() -> str:
    try:
        return Path("/proc/version").read_text("utf-8", "replace")
    except OSError:
        return ""
