"""Interreflection: form factors between patches of the skin, and passes that compute the bounces of light."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.interreflection import CELLS_PER_SIDE, SAMPLES_PER_PATCH, FormFactors, cached_form_factors
from dermis.atlas.worn_patches import with_worn_patches
from dermis.frame.programs import WORKGROUP_SIZE, program, workgroup_grid
from dermis.gpu import Bindings, Buffer, Constants, Device, Memo, Recorder, mark_scratch
from dermis.mesh.head import Head

FormFactorBuffers = tuple[tuple[Buffer, int], dict[str, Buffer], dict[str, Buffer]]
"""Sample points (their buffer and number), and buffers of the form factors of patches and of cells."""
_FLOAT4_BYTES = 16  # bytes of four floats
_BOUNCE_COUNT = 4  # number of bounces between patches; the gathering by cells is one more
_INVOCATIONS_PER_PATCH = 16  # shader invocations per patch or cell


def shader_constants() -> dict[str, int]:
    """Return the named values that the shader preprocessor inserts into the interreflection shaders.

    It inserts them at `//#fill` directives.
    """
    return {"linked_side": CELLS_PER_SIDE, "linked_samples": SAMPLES_PER_PATCH}


@dataclass(frozen=True, eq=False)
class InterreflectionBuffers:
    """Buffers of interreflection, which do not depend on the appearance of the skin.

    The skin is divided into patches that exchange light. A cell is a square of a coarse grid over the atlas;
    the cells store the light that reaches the skin from the patches.

    sample_points : buffer of the surface points at which patches are lit, and the number of points
    patch_links : dictionary from names in shaders to buffers of the form factors between patches
    cell_links : dictionary from names in shaders to buffers of the form factors from cells to patches
    stores_means : whether a cell stores the mean exitance of the patches that are visible from it, instead of
        the irradiance from these patches
    sample_exitance : buffer of the exitance of the sample points
    direct_exitance : buffer of the exitance of the patches by direct light
    uniform_exitance : buffer of the exitance of the patches under a uniform irradiance of 1
    bounced_exitance : two buffers of the exitance of the patches after a bounce; bounces alternate between
        them
    from_skin : buffer of the light that reaches each cell from other skin
    no_light : buffer of zeros to bind instead of `from_skin` in the pass that lights the sample points
    """

    sample_points: tuple[Buffer, int]
    patch_links: dict[str, Buffer]
    cell_links: dict[str, Buffer]
    stores_means: bool
    sample_exitance: Buffer
    direct_exitance: Buffer
    uniform_exitance: Buffer
    bounced_exitance: tuple[Buffer, Buffer]
    from_skin: Buffer
    no_light: Buffer

    @property
    def nbytes(self) -> int:
        """Return the size of the buffers that keep their data between frames [byte]."""
        links = *self.patch_links.values(), *self.cell_links.values()
        return sum(int(buffer.size) for buffer in (self.sample_points[0], *links, self.from_skin))


class Interreflection(NamedTuple):
    """Buffers of interreflection, with the albedos of skin, clothing and glasses.

    albedo : (3,) albedo of the skin's diffusion profile [-]
    material_colour : (m, 4) albedos of the materials of the head, which apply to parts that are not skin [-]
    """

    buffers: InterreflectionBuffers
    albedo: NDArray[np.float64]
    material_colour: NDArray[np.float32]


def make_interreflection(
    memo: Memo,
    device: Device,
    head: Head,
    atlas: Atlas,
    profile_albedo: NDArray[np.float64],
    has_occlusion: bool,
    light_cache_key: str,
    layout_key: str,
    material_colour: NDArray[np.float32],
) -> Interreflection | None:
    """Return the interreflection of a head, None for a head where no skin is visible from other skin.

    profile_albedo : (3,) albedo of the skin's diffusion profile [-]
    has_occlusion : whether there is a map of the visible fraction of the sky
    light_cache_key : cache key of the scene's light; callers that draw several scenes in turn use different
        keys
    layout_key : name of the atlas layout in the cache
    material_colour : (m, 4) albedos of the materials of the head [-]
    """
    form_factors = memo.get(_form_factors, head, atlas, caller_name=layout_key)
    if not len(form_factors.cell_factor):
        return None
    uploaded = memo.get(_upload_form_factors, device, form_factors, caller_name=layout_key)
    key = f"{layout_key} {light_cache_key}"
    buffers = memo.get(
        _make_interreflection_buffers, device, uploaded, has_occlusion, light_cache_key, caller_name=key
    )
    return Interreflection(buffers, profile_albedo, material_colour)


def placeholder_interreflection(device: Device) -> Buffer:
    """Return a buffer of zeros in place of the light from other skin, for heads without interreflection."""
    return device.cached(
        "no interreflection", lambda: device.storage_buffer(_FLOAT4_BYTES * CELLS_PER_SIDE * CELLS_PER_SIDE)
    )


def _form_factors(head: Head, atlas: Atlas) -> FormFactors:
    if head.undressed is None:
        return cached_form_factors(head.mesh, atlas.corner_uv, atlas.mapped)
    return cached_form_factors(head.mesh, *with_worn_patches(head.mesh, atlas))


def _upload_form_factors(device: Device, form_factors: FormFactors) -> FormFactorBuffers:
    points = np.stack([form_factors.sample_triangle, form_factors.sample_weights], axis=1)
    patch_links = _upload_form_factor_rows(
        device, form_factors.patch_first, form_factors.patch_target, form_factors.patch_factor
    )
    cell_links = _upload_form_factor_rows(
        device, form_factors.cell_first, form_factors.cell_target, form_factors.cell_factor
    )
    cells = np.stack([form_factors.nearest_patch, form_factors.confidence.view(np.uint32)], axis=1)
    cell_links["cells"] = device.buffer(cells, "STORAGE")
    return (device.buffer(points, "STORAGE"), len(points)), patch_links, cell_links


def _upload_form_factor_rows(
    device: Device,
    row_start: NDArray[np.uint32],
    patch_index: NDArray[np.uint32],
    form_factor: NDArray[np.float32],
) -> dict[str, Buffer]:
    links = np.stack([patch_index, form_factor.view(np.uint32)], axis=1)
    links = links if len(links) else np.zeros((1, 2), np.uint32)
    return {"first": device.buffer(row_start, "STORAGE"), "links": device.buffer(links, "STORAGE")}


def _make_interreflection_buffers(
    device: Device, form_factor_buffers: FormFactorBuffers, stores_means: bool, _: str
) -> InterreflectionBuffers:
    sample_points, patch_links, cell_links = form_factor_buffers
    count = sample_points[1]
    direct, uniform, *bounced = (
        mark_scratch(device, device.storage_buffer(_FLOAT4_BYTES * (count // SAMPLES_PER_PATCH)))
        for _ in range(4)
    )
    return InterreflectionBuffers(
        sample_points=sample_points,
        patch_links=patch_links,
        cell_links=cell_links,
        stores_means=stores_means,
        sample_exitance=mark_scratch(device, device.storage_buffer(2 * _FLOAT4_BYTES * count)),
        direct_exitance=direct,
        uniform_exitance=uniform,
        bounced_exitance=(bounced[0], bounced[1]),
        from_skin=device.storage_buffer(_FLOAT4_BYTES * CELLS_PER_SIDE * CELLS_PER_SIDE),
        no_light=placeholder_interreflection(device),
    )


def draw(
    graph: Recorder, lighting_bindings: Bindings, interreflection: Interreflection, constants: Constants
) -> None:
    """Declare the passes that compute the light that skin receives from other skin.

    lighting_bindings : resources of the lighting
    constants : pipeline constants of the lights

    Source: [Goral1984].
    """
    shader = program(graph.device, "interreflection/interreflection_points.wgsl", constants)
    buffers, albedo, colours = interreflection
    (points, count), footprint = buffers.sample_points, 2.0 / (CELLS_PER_SIDE * SAMPLES_PER_PATCH**0.5)
    own: Bindings = {
        "samples": shader.make_record(
            "Samples", count=count, footprint=footprint, albedo=albedo, material_colour=colours
        ),
        "sample_points": points,
        "sample_exitance": buffers.sample_exitance,
        "from_skin": buffers.no_light,
    }
    graph.dispatch("interreflection", shader, {**lighting_bindings, **own}, workgroup_grid(count))
    graph.add_replayable(_draw_bounces, buffers)


def _draw_bounces(graph: Recorder, buffers: InterreflectionBuffers) -> None:
    """Declare the passes that bounce light between patches, and then compute the light at the cells.

    Patches and cells are described in `InterreflectionBuffers`.
    """
    device = graph.device
    team = (
        1 if device.adapter.kind == "CPU" else _INVOCATIONS_PER_PATCH
    )  # barriers are slow on software adapters
    constants: Constants = (("TEAM", team), ("MEAN", int(buffers.stores_means)))
    patches, cells = (
        workgroup_grid(count, WORKGROUP_SIZE // team)
        for count in (buffers.sample_points[1] // SAMPLES_PER_PATCH, CELLS_PER_SIDE * CELLS_PER_SIDE)
    )
    shared = {"direct_exitance": buffers.direct_exitance, "uniform_exitance": buffers.uniform_exitance}
    means = program(device, "interreflection/interreflection_means.wgsl", constants[:1])
    graph.dispatch("interreflection", means, {"sample_exitance": buffers.sample_exitance, **shared}, patches)
    bounce = program(device, "interreflection/interreflection_bounce.wgsl", constants)
    exitance = buffers.direct_exitance
    for bounced in islice(cycle(buffers.bounced_exitance), _BOUNCE_COUNT):
        bindings: Bindings = {**buffers.patch_links, **shared, "exitance": exitance, "bounced": bounced}
        graph.dispatch("interreflection", bounce, bindings, patches)
        exitance = bounced
    gather = program(device, "interreflection/interreflection_gather.wgsl", constants)
    bindings = {**buffers.cell_links, "exitance": exitance, "from_skin": buffers.from_skin}
    graph.dispatch("interreflection", gather, bindings, cells)
