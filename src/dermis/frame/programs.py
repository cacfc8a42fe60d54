"""Compute programs of a frame, and the folders, lists and constants from which shaders are assembled."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from dermis import specular
from dermis.environment.isotropic_lobes import isotropic_lobe_constants
from dermis.environment.prefilter import reflection_constants
from dermis.frame.lights.kind import KINDS, light_shaders
from dermis.frame.lights.records import light_shader_constants
from dermis.gpu import ComputeProgram, Constants, Device, cached_program
from dermis.gpu.program import used_constants
from dermis.gpu.wgsl_source import Folder, ShaderFolder, ShaderListMember
from dermis.scene.outputs import OUTPUTS
from dermis.specular.models import MODELS

FLOAT_TEXEL_FORMAT = "rgba32float"
"""Texture format of light in full precision."""
HALF_TEXEL_FORMAT = "rgba16float"
"""Texture format of light in half precision."""
FRAME_FOLDER = Path(__file__).parent
OPTIONAL_BINDING_CONSTANTS = ("PARTS", "CUTOUTS", "LIVING", "WORN", "METALS", "BANDS", "VELLUS")
"""Pipeline constants that are also conditions of `//#if`: they decide which bindings or code a shader has."""
FEATURES_FOLDER = FRAME_FOLDER / "features"
"""Folder to which shader paths such as "shading/shade.wgsl" are relative."""
SPECULAR_FOLDER = Path(str(specular.__file__)).parent
TILE_SIDE = 16
"""Side of the square workgroups of short shaders [invocations].

A GPU takes longer to start smaller workgroups than to run them.
"""
WORKGROUP_SIZE = 64
"""Invocations per workgroup of shaders that process lists, the constant EACH of each.wgsl."""
_WORKGROUPS_PER_ROW = 32768  # workgroups along x, at most 65535
_PIXELS_PER_COLUMN = 16  # pixels per invocation of shade.wgsl on software adapters
_HAIR_SHADOW_STEP_TEXELS = 2.0  # step along hairs in shadow maps on software adapters [texels]
_MAX_SAMPLES_PER_INVOCATION = (
    64  # limit of samples per invocation, as a driver ends loops after 65,535 iterations
)


GetListMembers = Callable[[], Sequence[ShaderListMember]]
_COMMON_SHADERS = (  # shaders of most frames
    "shading/shade.wgsl",
    "surface/surface_texels.wgsl",
    "shadows/shadow_bounds.wgsl",
    "post/post.wgsl",
    "outputs/pack.wgsl",
)


def shader_folders(*option_names: str) -> tuple[Folder, ...]:
    """Return the folders from which shaders include files, with the lists and constants of all features.

    A feature is a package in `features`. Its optional function `shader_constants` returns numbers that
    shaders share with Python. Its optional function `shader_lists` returns the lists over which the lines
    `//#include <list>` and `//#each list` of shaders iterate. Both functions are found without registration.

    option_names : names of the `//#if` conditions that are true
    """
    lists, constants = _feature_definitions(registry_version())
    shared = ShaderFolder(FEATURES_FOLDER, lists, lambda: constants, frozenset(option_names))
    return (shared, FRAME_FOLDER / "wgsl", FRAME_FOLDER / "techniques", SPECULAR_FOLDER)


@lru_cache(maxsize=1)
def _feature_definitions(_: int) -> tuple[dict[str, GetListMembers], dict[str, float]]:
    """Return the shader lists and shader constants of all features.

    The parameter, from `registry_version`, only serves as a cache key.
    """
    constants = light_shader_constants() | isotropic_lobe_constants() | reflection_constants()
    lists: dict[str, GetListMembers] = {"lights": light_shaders}
    for feature in _feature_packages():
        constants |= getattr(feature, "shader_constants", dict)()
        lists |= getattr(feature, "shader_lists", dict)()
    return {name: cache(members) for name, members in lists.items()}, constants


@cache
def _feature_packages() -> tuple[ModuleType, ...]:
    names = sorted(one.name for one in pkgutil.iter_modules([str(FEATURES_FOLDER)]))
    return tuple(import_module(f"dermis.frame.features.{name}") for name in names)


def program(
    device: Device,
    path: str | Path,
    constants: Constants = (),
    source_format: str = FLOAT_TEXEL_FORMAT,
    store_format: str = FLOAT_TEXEL_FORMAT,
    stores_hair_labels: bool = False,
) -> ComputeProgram:
    """Return the compiled program of a shader; programs are cached per device.

    Pipeline constants that suit the device are added to `constants`.

    path : "FEATURE/NAME.wgsl", or the path of any other file
    constants : pipeline constants
    source_format : format of the texture from which the shader reads light
    store_format : format of the texture to which the shader writes light
    stores_hair_labels : for shaders that draw hair, whether they store the labels of pixels besides the
        picture
    """
    active = shader_options(source_format, store_format, stores_hair_labels, constants)

    def compile_program() -> ComputeProgram:
        file, folders = FEATURES_FOLDER / path, shader_folders(*active)
        return ComputeProgram(device, file, folders, program_constants(device, file, folders, constants))

    return cached_program(device, (path, active, registry_version()), constants, compile_program)


def shader_options(
    source_format: str, store_format: str, stores_hair_labels: bool, constants: Constants = ()
) -> tuple[str, ...]:
    """Return the names of the `//#if` conditions that are true for the given options of `program`."""
    values = {
        "FILTERED_SOURCE": source_format == HALF_TEXEL_FORMAT,
        "STORED_HALVES": store_format == HALF_TEXEL_FORMAT,
        "HAIR_LABELS": stores_hair_labels,
    }
    options = [name for name, value in values.items() if value]
    return (*options, *(name for name, value in constants if name in OPTIONAL_BINDING_CONSTANTS and value))


def program_constants(
    device: Device, path: Path, folders: Sequence[Folder], constants: Constants = ()
) -> dict[str, float]:
    """Return the values of all pipeline constants of a shader, by name.

    These are `constants`, and those constants from `device_constants` that the shader declares.

    path : file of the shader
    folders : folders that are searched for included files
    """
    return used_constants(path, folders, device_constants(device)) | dict(constants)


def workgroup_grid(entry_count: int, workgroup_size: int = WORKGROUP_SIZE) -> tuple[int, int, int]:
    """Return the grid of workgroups for a shader that processes a list, with one invocation per entry.

    entry_count : number of entries of the list
    workgroup_size : entries per workgroup
    """
    groups = max(1, -(-entry_count // workgroup_size))
    return min(groups, _WORKGROUPS_PER_ROW), -(-groups // _WORKGROUPS_PER_ROW), 1


def registry_version() -> int:
    """Return a number that changes whenever a light, a lobe or an output is registered or removed.

    Shaders that list lights, lobes or outputs are then compiled again.
    """
    return KINDS.changes + MODELS.changes + OUTPUTS.changes


def device_constants(device: Device) -> Constants:
    """Return the values of pipeline constants that make shaders run fastest on the device.

    GPUs read buffers faster than textures, but software adapters read textures faster than buffers. On
    software adapters, shaders also skip lights behind the surface, shade a column of pixels per invocation,
    and take longer steps along hairs to draw their shadows.
    """
    if device.adapter.kind == "CPU":
        return (("SKIPS_UNLIT", 1), ("STRIP", _PIXELS_PER_COLUMN), ("SPLAT_STEP", _HAIR_SHADOW_STEP_TEXELS))
    return (("MESH_IN_BUFFERS", 1),)


def pixel_column_constants(device: Device, sample_count: int) -> Constants:
    """Return the pipeline constant STRIP if a shader invocation must shade a shorter column than usual.

    On software adapters, an invocation shades a column of 16 pixels. With many samples per pixel, its loops
    would exceed the number of iterations that the driver allows; STRIP then sets a smaller number of pixels.
    In all other cases the result is empty.
    """
    strip = max(1, _MAX_SAMPLES_PER_INVOCATION // sample_count)
    return (("STRIP", strip),) if device.adapter.kind == "CPU" and strip < _PIXELS_PER_COLUMN else ()


def level_format(device: Device) -> str:
    """Return the fastest format of pyramid levels: half floats on GPUs, floats on software adapters."""
    return FLOAT_TEXEL_FORMAT if device.adapter.kind == "CPU" else HALF_TEXEL_FORMAT


def start_compiling_common_programs(device: Device) -> None:
    """Start compiling the programs that most frames need, while other threads load the scene."""
    for name in _COMMON_SHADERS:
        program(device, name)
    texel_format = level_format(device)
    program(device, "atlas/stitch_gather.wgsl", source_format=texel_format)
    program(device, "diffusion/diffuse_halve.wgsl", source_format=texel_format, store_format=texel_format)
    for name in ("atlas/stitch_place.wgsl", "irradiance/irradiance.wgsl"):
        program(device, name, store_format=texel_format)
