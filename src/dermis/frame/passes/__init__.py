"""The passes of a frame: each a Python file that declares them and a WGSL file of the same name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dermis import specular
from dermis.environment.mirrors import mirror_numbers
from dermis.environment.prefilter import reflection_numbers
from dermis.frame.atlas_textures import atlas_numbers
from dermis.frame.baked_numbers import baking_numbers
from dermis.frame.fine_light import fine_numbers
from dermis.frame.interreflection import link_numbers
from dermis.frame.levels import FLOATS, HALVES, usual_texel
from dermis.frame.lights import light_numbers
from dermis.frame.lights.kind import KINDS, light_shaders
from dermis.frame.metering import meter_numbers
from dermis.frame.output_lists import label_numbers, output_lists
from dermis.frame.outputs import OUTPUTS
from dermis.frame.painting import painting_numbers, texture_names
from dermis.frame.strands import strand_numbers
from dermis.frame.surface import eye_numbers, lobe_shaders, surface_numbers
from dermis.gpu import ComputeProgram, Constants, Device, compiled
from dermis.gpu.program import declared
from dermis.gpu.wgsl_source import Folder, ShaderFolder
from dermis.specular.models import MODELS

PASSES = Path(__file__).parent
SPECULAR = Path(str(specular.__file__)).parent
TECHNIQUES = PASSES.parent / "techniques"
SHARED_SHADERS = ShaderFolder(
    PASSES.parent / "wgsl",
    lists={"lights": light_shaders, "lobes": lobe_shaders, **texture_names(), **output_lists()},
    numbers=lambda: {
        **label_numbers(),
        **light_numbers(),
        **surface_numbers(),
        **atlas_numbers(),
        **painting_numbers(),
        **eye_numbers(),
        **strand_numbers(),
        **meter_numbers(),
        **baking_numbers(),
        **fine_numbers(),
        **mirror_numbers(),
        **reflection_numbers(),
        **link_numbers(),
    },
)
TILE = 16
"""Side of workgroups that do little: smaller ones finish before the H200 has started the next."""
EACH = 64
"""Invocations of a workgroup, as in each.wgsl."""
_ROW = 32768  # workgroups in a row, at most 65535
_STRIP = 16  # pixels of an invocation on software adapters, see shade.wgsl
_SPLAT_STEP = 2.0  # of hairs' shadows on software adapters [texel], see docs/performance.md
_SAMPLES = 64  # that an invocation may meet: drivers end what goes round loops 65,535 times


def shader_folders(*options: str) -> tuple[Folder, ...]:
    """Return the folders where includes are looked up, with the names for which `//#if` holds."""
    return (replace(SHARED_SHADERS, options=frozenset(options)), TECHNIQUES, SPECULAR)


def program(
    device: Device,
    path: str | Path,
    constants: Constants = (),
    source: str = FLOATS,
    store: str = FLOATS,
    labels: bool = False,
) -> ComputeProgram:
    """Return the shader of that name among the passes, or at that path, with pipeline constants.

    The device's own constants are added to them.

    source, store : formats in which the shader reads and stores blurred light, if it does
    labels : whether a pass of hairs stores labels besides the picture
    """
    chosen = options(source, store, labels)

    def make() -> ComputeProgram:
        file, folders = PASSES / path, shader_folders(*chosen)
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
    """A number that changes whenever a light, a lobe or an output is added to the shaders or removed."""
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


def warm_up(device: Device) -> None:
    """Start compiling what most frames need, while other threads load the scene."""
    for name in ("shade.wgsl", "surface_texels.wgsl", "shadow_bounds.wgsl", "post.wgsl", "pack.wgsl"):
        program(device, name)
    texel = usual_texel(device)
    program(device, "stitch_gather.wgsl", source=texel)
    program(device, "diffuse_halve.wgsl", source=texel, store=texel)
    for name in ("stitch_place.wgsl", "irradiance.wgsl"):
        program(device, name, store=texel)
