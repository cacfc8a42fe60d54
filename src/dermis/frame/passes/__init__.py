"""The passes of a frame: each a Python file that declares them and a WGSL file of the same name."""

from __future__ import annotations

from pathlib import Path

from dermis.gpu import ComputeProgram, Constants, Device, compute_program

PASSES = Path(__file__).parent
TECHNIQUES = PASSES.parent / "techniques"
SHARED_SHADERS = PASSES.parent / "wgsl"
TILE = 16
"""Side of workgroups that do little: smaller ones are done before the H200 has started the next."""
_LEVELS = PASSES / "levels"
_SOURCES = {"rgba32float": _LEVELS / "loaded", "rgba16float": _LEVELS / "filtered"}
_STORES = {"rgba32float": _LEVELS / "floats", "rgba16float": _LEVELS / "halves"}
_STRIP = 16  # pixels of an invocation on software adapters, see shade.wgsl


def shader_folders(source: str = "", store: str = "") -> tuple[Path, ...]:
    """Where includes are looked up.

    source, store : formats of the blurred light that the shader reads and stores, if it does
    """
    levels = [_SOURCES[source]] if source else []
    levels += [_STORES[store]] if store else []
    return (*levels, SHARED_SHADERS, TECHNIQUES)


def program(
    device: Device, path: str | Path, constants: Constants = (), source: str = "", store: str = ""
) -> ComputeProgram:
    """The shader of that name among the passes, or at that path, with pipeline constants.

    What suits the device is added to them; see `shader_folders` for the formats.
    """
    return compute_program(
        device, PASSES / path, shader_folders(source, store), constants, device_constants(device)
    )


def device_constants(device: Device) -> Constants:
    """Pipeline constants that suit the device, for shaders that have them.

    GPUs read buffers faster and software adapters textures, which also pass over lights in the dark one by one
    and shade a column of pixels at a time; see geometry.wgsl, lighting.wgsl and shade.wgsl.
    """
    if device.adapter.kind == "CPU":
        return (("PASSES_DARK", 1), ("STRIP", _STRIP))
    return (("MESH_IN_BUFFERS", 1),)
