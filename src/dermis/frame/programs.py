"""Compute programs of a frame: where their shaders, includes, lists and shared numbers are found."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from dermis import specular
from dermis.environment.mirrors import mirror_numbers
from dermis.environment.prefilter import reflection_numbers
from dermis.frame.lights import light_numbers
from dermis.frame.lights.kind import KINDS, light_shaders
from dermis.gpu import ComputeProgram, Constants, Device, compiled
from dermis.gpu.program import declared
from dermis.gpu.wgsl_source import Folder, Member, ShaderFolder
from dermis.scene.outputs import OUTPUTS
from dermis.specular.models import MODELS

FLOATS = "rgba32float"
"""Format of light in full precision."""
HALVES = "rgba16float"
FRAME = Path(__file__).parent
FEATURES = FRAME / "features"
"""Shaders are named by their feature's folder and their own name: "shading/shade.wgsl"."""
SPECULAR = Path(str(specular.__file__)).parent
TILE = 16
"""Side of workgroups that do little: smaller ones finish before the H200 has started the next."""
EACH = 64
"""Invocations of a workgroup, as in each.wgsl."""
_ROW = 32768  # workgroups in a row, at most 65535
_STRIP = 16  # pixels of an invocation on software adapters, see shade.wgsl
_SPLAT_STEP = 2.0  # of hairs' shadows on software adapters [texel], see docs/performance.md
_SAMPLES = 64  # that an invocation may meet: drivers end what goes round loops 65,535 times


_ALWAYS = (
    "shading/shade.wgsl",
    "surface/surface_texels.wgsl",
    "shadows/shadow_bounds.wgsl",
    "post/post.wgsl",
    "outputs/pack.wgsl",
)  # shaders of most frames


def shader_folders(*options: str) -> tuple[Folder, ...]:
    """Return the folders in which includes are looked up, with the lists and numbers of all features.

    A feature is a package in `features`; its `shader_numbers()` and `shader_lists()`, where it has them, are
    found here, so that a feature is registered nowhere.

    options : names for which `//#if` holds
    """
    numbers: dict[str, float] = {**light_numbers(), **mirror_numbers(), **reflection_numbers()}
    lists: dict[str, Callable[[], Sequence[Member]]] = {"lights": light_shaders}
    for feature in _features():
        numbers |= getattr(feature, "shader_numbers", dict)()
        lists |= getattr(feature, "shader_lists", dict)()
    shared = ShaderFolder(FEATURES, lists, lambda: numbers, frozenset(options))
    return (shared, FRAME / "wgsl", FRAME / "techniques", SPECULAR)


@cache
def _features() -> tuple[ModuleType, ...]:
    names = sorted(one.name for one in pkgutil.iter_modules([str(FEATURES)]))
    return tuple(import_module(f"dermis.frame.features.{name}") for name in names)


def program(
    device: Device,
    path: str | Path,
    constants: Constants = (),
    source: str = FLOATS,
    store: str = FLOATS,
    labels: bool = False,
) -> ComputeProgram:
    """Return the program of a shader, compiled once, with pipeline constants.

    The device's own constants are added to them.

    path : "FEATURE/NAME.wgsl", or the path of any other file
    source, store : formats in which the shader reads and stores blurred light, if it does
    labels : whether a pass of hairs stores labels besides the picture
    """
    chosen = options(source, store, labels)

    def make() -> ComputeProgram:
        file, folders = FEATURES / path, shader_folders(*chosen)
        return ComputeProgram(device, file, folders, suited(device, file, folders, constants))

    return compiled(device, (path, chosen, registered()), constants, make)


def options(source: str, store: str, labels: bool) -> tuple[str, ...]:
    """Return the names for which `//#if` holds in a shader, see `program`."""
    chosen = {"FILTERED_SOURCE": source == HALVES, "STORED_HALVES": store == HALVES, "HAIR_LABELS": labels}
    return tuple(name for name, holds in chosen.items() if holds)


def suited(
    device: Device, path: Path, folders: Sequence[Folder], constants: Constants = ()
) -> dict[str, float]:
    """Pipeline constants, with the device's own that the shader declares."""
    return declared(path, folders, device_constants(device)) | dict(constants)


def each(count: int, workgroup: int = EACH) -> tuple[int, int, int]:
    """Workgroups of shaders that have an invocation for each of a list, see each.wgsl.

    workgroup : how many of the list a workgroup does
    """
    groups = max(1, -(-count // workgroup))
    return min(groups, _ROW), -(-groups // _ROW), 1


def registered() -> int:
    """Return a number that changes whenever a light, a lobe or an output is registered or removed."""
    return KINDS.changes + MODELS.changes + OUTPUTS.changes


def device_constants(device: Device) -> Constants:
    """Pipeline constants that suit the device, for shaders that declare them.

    GPUs read buffers faster. Software adapters read textures faster, skip lights behind each point's surface,
    shade columns of pixels and take longer steps along hairs that cast shadows; see geometry.wgsl,
    lighting.wgsl, shade.wgsl and strands_shadow.wgsl.
    """
    if device.adapter.kind == "CPU":
        return (("PASSES_DARK", 1), ("STRIP", _STRIP), ("SPLAT_STEP", _SPLAT_STEP))
    return (("MESH_IN_BUFFERS", 1),)


def strip_for(device: Device, samples: int) -> Constants:
    """What another number of samples than usual makes of the strips of `device_constants`."""
    fewer = max(1, _SAMPLES // samples)
    return (("STRIP", fewer),) if device.adapter.kind == "CPU" and fewer < _STRIP else ()


def usual_texel(device: Device) -> str:
    """Return the format of levels: halves on GPUs, which read them faster; floats where software converts."""
    return FLOATS if device.adapter.kind == "CPU" else HALVES


def warm_up(device: Device) -> None:
    """Start compiling what most frames need, while other threads load the scene."""
    for name in _ALWAYS:
        program(device, name)
    texel = usual_texel(device)
    program(device, "atlas/stitch_gather.wgsl", source=texel)
    program(device, "diffusion/diffuse_halve.wgsl", source=texel, store=texel)
    for name in ("atlas/stitch_place.wgsl", "irradiance/irradiance.wgsl"):
        program(device, name, store=texel)
