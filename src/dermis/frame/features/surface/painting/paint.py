"""Painted maps of human skin: colour, gloss and relief, at rest and with facial expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from dermis.base.disk import Arrays, array_key, load_arrays, load_or_make
from dermis.base.errors import refuse
from dermis.base.progress import logged_step
from dermis.frame.features.surface import mips as map_mips
from dermis.frame.features.surface.bands import band_constants
from dermis.frame.features.surface.living.living import (
    LIVING_CONSTANTS,
    LivingMaps,
    draw_state,
    draw_state_texels,
    make_living_maps,
    pulse_record,
)
from dermis.frame.programs import FEATURES_FOLDER, HALF_TEXEL_FORMAT, program, shader_folders, workgroup_grid
from dermis.gpu import (
    Bindings,
    Buffer,
    CommandList,
    Device,
    Graph,
    MutableBindings,
    Texture,
    UniformRecord,
    make_texture,
    upload,
)
from dermis.gpu.program import shader_source
from dermis.gpu.shader_types import make_record, struct_dtype
from dermis.gpu.textures import download
from dermis.gpu.wgsl_source import ShaderListMember
from dermis.human.skin import face, textures
from dermis.human.skin.face import FOLD_MOVEMENT_COUNT, HAIRLINE_STEP_DEGREES, ZONE_AMOUNTS, paint_table_sizes
from dermis.human.skin.look import SkinLook
from dermis.human.skin.measured import SiteDifferences
from dermis.human.skin.painted import oxygen_range, painted_colour_tables
from dermis.human.skin.surface import PaintedSurface
from dermis.human.skin.textures import (
    DOT_LAYERS,
    NOISE_REGIONS,
    NOISES,
    TILE_LENGTH_MM,
    ZONE_BORDER_NOISE_COUNT,
    noise_row_range,
    noise_table,
)
from dermis.mesh.maps import Maps
from dermis.optics.bands import Bands, band_rows
from dermis.scene.living import PULSE_SAMPLE_COUNT, SkinState
from dermis.scene.skin import DEFAULT_RHO_S
from dermis.specular.hair import absorption_per_mm, dense_hair_reflectance

_PAINTING_LISTS: dict[str, Sequence[str]] = {
    "noises": [noise.name for noise in NOISES],
    "dots": [dots.name for dots in DOT_LAYERS],
    "amounts": list(ZONE_AMOUNTS),
    "grounds": list(NOISE_REGIONS),
}
_SKIN_SHADER, _TEXEL_TRIANGLE_SHADER = "surface/painting/skin.wgsl", "surface/painting/owner.wgsl"
_MAX_PAINTED_TRIANGLES = 1 << 20  # limit by the bits of a triangle index in painted_surface.wgsl
# Reflectance of a scalp in short hair by that of a dense layer of hair: factor, and constant. It exceeds that
# of the hair, because the scalp lies in the shadow of the hair; fitted to pictures of cropped hair.
_SCALP_FACTOR, _SCALP_REFLECTANCE = 1.7, 0.066
_TRIANGLE_ROW_PADDING = (0, 0), (0, 2)  # padding from two to four columns
_PAINTED_CACHE_FOLDER = "painted"
_WORD_BYTES = 4
_PAINTED_MAP_NAMES = ("colour", "specular", "roughness")


def painting_shader_lists() -> Mapping[str, Callable[[], Sequence[ShaderListMember]]]:
    """Return the lists over which the shader preprocessor loops, such as the list of noises.

    It loops at `//#each` directives in painting shaders.
    """
    return {name: _as_shader_list(names) for name, names in _PAINTING_LISTS.items()}


def painting_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in painting shaders."""
    counts = {name: len(names) for name, names in _PAINTING_LISTS.items()} | paint_table_sizes()
    rows = {"noise_rows": len(noise_table()), "amount_rows": len(ZONE_AMOUNTS) // 4}
    first, end = noise_row_range("blotches")
    rows |= {"first_blotch_row": first, "end_blotch_row": end, "pulse_rows": PULSE_SAMPLE_COUNT // 4}
    sizes = {"degrees": float(HAIRLINE_STEP_DEGREES), "tile_mm": TILE_LENGTH_MM}
    return sizes | counts | rows | {"folding": FOLD_MOVEMENT_COUNT, "wander_rows": ZONE_BORDER_NOISE_COUNT}


def _as_shader_list(member_names: Sequence[str]) -> Callable[[], Sequence[ShaderListMember]]:
    return lambda: [ShaderListMember(name, Path()) for name in member_names]


class PaintInputs(NamedTuple):
    """Inputs of the shader that paints skin.

    paint : uniform record of the skin's appearance, such as pigments, gloss and age
    tables : tables of procedural noises, layers of dots on the skin (such as freckles, moles and stubble),
        facial zones, folds of the skin, and the hairline
    colours : (3, n, n, 3) colour tables, linear Rec. 709 [-]. Table 0 is for skin with the lowest oxygen
        saturation, table 1 for skin with the highest, and table 2 for lips. In a table, the square root of
        the melanin fraction increases evenly from row to row, and the square root of the blood fraction from
        column to column
    surface : mesh that is painted
    bands : wavelengths in the place of red, green and blue
    """

    paint: UniformRecord
    tables: NDArray[np.float32]
    colours: NDArray[np.float32]
    surface: PaintedSurface
    bands: Bands | None = None


def paint_inputs(
    surface: PaintedSurface, look: SkinLook, map_side: int, bands: Bands | None = None
) -> PaintInputs:
    """Return the inputs of the shader that paints a skin that has the given look.

    map_side : side of the maps [texels]
    bands : wavelengths in the place of red, green and blue

    Raises DermisError for a mesh with too many triangles.
    """
    if surface.triangle_count >= _MAX_PAINTED_TRIANGLES:
        actual = f"got {surface.triangle_count:,}"
        refuse("painted skin", f"fewer than {_MAX_PAINTED_TRIANGLES:,} triangles", actual, "Subdivide less")
    text = _shader_text(_SKIN_SHADER)
    names = set(struct_dtype(text, "Paint").names or ()) & set(vars(look))
    values = {name: getattr(look, name) for name in names}
    low, high = oxygen_range(look)
    hair = dense_hair_reflectance(absorption_per_mm(look.stubble_eumelanin, look.stubble_pheomelanin))
    stubble = _SCALP_FACTOR * hair + _SCALP_REFLECTANCE
    paint = make_record(
        text,
        "Paint",
        side=map_side,
        low_oxygen=low,
        high_oxygen=high,
        stubble_colour=stubble if bands is None else bands.reflectance(stubble),
        bands=band_rows(bands),
        **values,
    )
    tables = np.ndarray((), struct_dtype(text, "Tables"), _face_tables(look.recession, look.sites))
    return PaintInputs(paint, tables, painted_colour_tables(look, bands), surface, bands)


def painted_maps_cache_key(inputs: PaintInputs, driver_name: str) -> str:
    """Return the disk cache key of painted maps: a hash of inputs, shaders and driver name."""
    source = "\n".join((driver_name, _shader_text(_SKIN_SHADER), _shader_text(_TEXEL_TRIANGLE_SHADER)))
    records = (np.frombuffer(record.tobytes(), np.uint8) for record in (inputs.paint, inputs.tables))
    return array_key([*records, inputs.colours, inputs.surface.vertices, inputs.surface.triangles], source)


@cache
def _shader_text(shader_path: str) -> str:
    return shader_source(FEATURES_FOLDER / shader_path, shader_folders()).text


def _face_tables(hairline_recession: float, site_differences: SiteDifferences) -> bytes:
    """Return the bytes of the tables that spot.wgsl reads.

    They describe procedural noises, layers of dots on the skin (such as freckles, moles and stubble), facial
    zones, folds of the skin, and the hairline.

    hairline_recession : recession of the hairline [-]
    site_differences : differences of pigments between measured sites of the face, such as forehead and cheek
    """
    folds, edge = face.skin_folds(), face.hairline_heights(hairline_recession)
    ends = np.column_stack([folds.first[:-1], folds.first[1:] - 1]).astype(np.float32)
    curves = np.pad(np.hstack([folds.curves, ends]), _TRIANGLE_ROW_PADDING)
    hairline = np.pad(np.column_stack([edge, np.append(edge[1:], edge[-1])]), _TRIANGLE_ROW_PADDING)
    tables = (
        textures.noise_table(),
        textures.dot_layer_table(),
        face.zone_table(hairline_recession, site_differences),
        curves,
        folds.knots,
    )
    return b"".join(table.tobytes() for table in (*tables, hairline))


class RestMaps(NamedTuple):
    """Painted maps of a face at rest; only the finest mip levels are filled.

    colour, specular, roughness : textures with views of their mip levels
    heights : buffer of heights with a border of one texel [mm]
    deltas : texture of the changes that expressions make, None if they were not requested
    """

    colour: map_mips.MippedTexture
    specular: map_mips.MippedTexture
    roughness: map_mips.MippedTexture
    heights: Buffer
    deltas: Texture | None


def cached_rest_maps(
    device: Device, inputs: PaintInputs, map_side: int, with_expressions: bool = False
) -> RestMaps:
    """Return the painted maps of a face at rest, cached on disk for software adapters, which paint slowly.

    Only the first maps that a device paints are stored, because programs that render many people rarely need
    the same person again.

    with_expressions : whether to include the changes that expressions make
    """
    if device.adapter.kind != "CPU":
        return paint_rest_maps(device, inputs, map_side)
    key, names = (
        painted_maps_cache_key(inputs, f"{device.adapter.name} {device.adapter.driver}"),
        [*_PAINTED_MAP_NAMES, "heights"],
    )
    names += ["deltas"] if with_expressions else []
    arrays = load_arrays(_PAINTED_CACHE_FOLDER, key, names)
    if arrays is not None:
        return _upload_cached_maps(device, arrays, map_side)
    maps = paint_rest_maps(device, inputs, map_side)
    if device.cached("first painted", lambda: key) == key:
        load_or_make(
            _PAINTED_CACHE_FOLDER, key, names, lambda: _download_maps(device, maps, with_expressions)
        )
    return maps


@logged_step("painting the skin")
def paint_rest_maps(device: Device, inputs: PaintInputs, map_side: int) -> RestMaps:
    """Paint the maps of a face at rest.

    map_side : side of the maps [texels]
    """
    surface: Bindings = {"paint": inputs.paint, **_surface_buffers(device, inputs, map_side)}
    maps = {name: map_mips.empty_map(device, (map_side, map_side)) for name in _PAINTED_MAP_NAMES}
    heights = device.storage_buffer(_WORD_BYTES * (map_side + 2) ** 2)
    deltas = make_texture(device, (map_side, map_side), HALF_TEXEL_FORMAT, layer_count=2)
    outputs = {name: one.levels[0] for name, one in maps.items()}
    tables: Bindings = {
        "tables": inputs.tables,
        "colour_tables": _upload_colour_tables(device, inputs),
        "heights": heights,
        "expression_deltas": deltas,
    }
    frame = CommandList(device, timed=False)
    frame.compute(
        "maps",
        program(device, _SKIN_SHADER, band_constants(inputs.bands)),
        {**surface, **tables, **outputs},
        (map_side, map_side),
    )
    frame.submit()
    return RestMaps(**maps, heights=heights, deltas=deltas)


def _surface_buffers(device: Device, inputs: PaintInputs, map_side: int) -> dict[str, Buffer]:
    """Return buffers of the mesh that is painted, and of the triangle that covers each texel of the maps.

    The device caches the buffers for all people who share the mesh.
    """
    surface = inputs.surface
    cache = device.cached("painted surfaces", WeakKeyDictionary[PaintedSurface, dict[int, dict[str, Buffer]]])
    sides: dict[int, dict[str, Buffer]] = cache.setdefault(surface, {})
    if map_side not in sides:
        sides.clear()
        buffers = {
            "vertices": device.buffer(surface.vertices, "STORAGE"),
            "triangles": device.buffer(surface.triangles, "STORAGE"),
            "owners": device.storage_buffer(_WORD_BYTES * map_side * map_side),
        }
        frame = CommandList(device, timed=False)
        bound: Bindings = {"paint": inputs.paint, **buffers}
        frame.dispatch(
            "maps", program(device, _TEXEL_TRIANGLE_SHADER), bound, workgroup_grid(surface.triangle_count)
        )
        frame.submit()
        sides[map_side] = buffers
    return sides[map_side]


def _upload_colour_tables(device: Device, inputs: PaintInputs) -> Texture:
    nodes = inputs.colours.shape[1]
    texture = make_texture(
        device, (nodes, nodes), "rgba32float", layer_count=len(inputs.colours), content_source="map"
    )
    for layer, table in enumerate(inputs.colours):
        upload(device, texture, np.dstack([table, np.ones((nodes, nodes, 1), np.float32)]), layer=layer)
    return texture


def _download_maps(device: Device, maps: RestMaps, with_expressions: bool) -> Arrays:
    arrays = {name: download(device, getattr(maps, name).texture) for name in _PAINTED_MAP_NAMES}
    arrays["heights"] = np.frombuffer(device.handle.queue.read_buffer(maps.heights), np.float32)
    if with_expressions and maps.deltas is not None:
        arrays["deltas"] = np.stack([download(device, maps.deltas, layer=layer) for layer in range(2)])
    return arrays


def _upload_cached_maps(device: Device, map_arrays: Arrays, map_side: int) -> RestMaps:
    maps = {name: map_mips.empty_map(device, (map_side, map_side)) for name in _PAINTED_MAP_NAMES}
    for name, one in maps.items():
        upload(device, one.texture, map_arrays[name])
    deltas = None
    if "deltas" in map_arrays:
        deltas = make_texture(device, (map_side, map_side), HALF_TEXEL_FORMAT, layer_count=2)
        for layer, texels in enumerate(map_arrays["deltas"]):
            upload(device, deltas, texels, layer=layer)
    return RestMaps(**maps, heights=device.buffer(map_arrays["heights"], "STORAGE"), deltas=deltas)


@dataclass(frozen=True, eq=False)
class ExpressionMaps:
    """Painted maps that change with expressions, and the inputs of the passes that fill these maps.

    bindings : dictionary from names in expression.wgsl and expression_relief.wgsl to resources
    heights : buffer of heights from which the relief is computed [mm]
    colour, relief : textures with all mip levels
    living : maps of skin in a state or with a pulse; None for skin without both
    bands : wavelengths in the place of red, green and blue
    """

    bindings: MutableBindings
    heights: Buffer
    colour: map_mips.MippedTexture
    relief: map_mips.MippedTexture
    living: LivingMaps | None = None
    bands: Bands | None = None


def draw_expression(
    graph: Graph,
    expression_maps: ExpressionMaps,
    movement_strengths: NDArray[np.float32],
    skin_state: SkinState | None = None,
) -> None:
    """Declare the passes that compute the maps of skin with an expression, a state and a pulse.

    movement_strengths : (9,) strength of each facial movement, from `human.skin.face.movement_weights` [-]
    skin_state : state and pulse of the skin; None for skin at rest, with `living` of the maps None too
    """
    side = expression_maps.colour.size[0]
    folding, (flush, pressed) = np.split(movement_strengths, [FOLD_MOVEMENT_COUNT])
    shader = program(graph.device, "surface/painting/expression_relief.wgsl")
    record = shader.make_record("Relief", folding=np.append(folding, 0.0).reshape(2, 4), side=side)
    graph.compute("maps", shader, expression_maps.bindings | {"relief": record}, (side, side))
    graph.add_replayable(map_mips.fill_relief, expression_maps.relief, expression_maps.heights)
    living = expression_maps.living if skin_state is not None else None
    bands = expression_maps.bands
    constants = (LIVING_CONSTANTS if living else ()) + band_constants(bands)
    shader = program(graph.device, "surface/painting/expression.wgsl", constants)
    record = shader.make_record("Expression", flush=flush, pressed=pressed, side=side, bands=band_rows(bands))
    bindings: MutableBindings = {**expression_maps.bindings, "expression": record}
    if living is not None and skin_state is not None:
        draw_state(graph, living, skin_state)
        bindings |= living.bindings | {"living": pulse_record(shader, living, skin_state)}
    graph.compute("maps", shader, bindings, (side, side))
    graph.add_replayable(map_mips.fill_mips, expression_maps.colour)


class PaintedTextures(NamedTuple):
    """Painted textures with all mip levels, as the shader that renders skin reads them."""

    colour: Texture
    specular: Texture
    roughness: Texture
    relief: Texture
    expression_maps: ExpressionMaps | None


class RawPaintedArrays(NamedTuple):
    """Painted texels in the channels that the painting shader skin.wgsl writes.

    colour : (n, n, 4) linear Rec. 709 albedo [-], and a channel of ones
    specular : (n, n, 4) specular factor, amount of pores, base-2 logarithm of the surface length in mm per
        unit of uv, and direction of the tension lines from +u to down [rad]
    roughness : (n, n, 4) roughness factor, amount of lines, and fractions of melanin and blood
    height_mm : (n, n) heights of the relief [mm]
    """

    colour: NDArray[np.float32]
    specular: NDArray[np.float32]
    roughness: NDArray[np.float32]
    height_mm: NDArray[np.float32]


def paint_textures(
    device: Device,
    surface: PaintedSurface,
    look: SkinLook,
    map_side: int,
    with_expressions: bool = False,
    is_living: bool = False,
    bands: Bands | None = None,
) -> PaintedTextures:
    """Paint the maps of a skin that has the given look, and return them as textures.

    map_side : side of the maps [texels]
    with_expressions : whether expressions change colour and relief; if so, `draw_expression` fills these maps
    is_living : whether states and the pulse change colour and gloss too; it requires `with_expressions`
    bands : wavelengths in the place of red, green and blue
    """
    inputs = paint_inputs(surface, look, map_side, bands)
    maps = cached_rest_maps(device, inputs, map_side, with_expressions)
    colour = map_mips.empty_map(device, (map_side, map_side)) if with_expressions else maps.colour
    living = _living_maps(device, inputs, look, maps) if is_living else None
    specular, roughness = (living or maps).specular, (living or maps).roughness
    constant = [*([] if with_expressions else [colour]), *([] if living else [specular, roughness])]
    frame = CommandList(device, timed=False)
    for one in constant:
        map_mips.fill_mips(frame, one)
    frame.submit()
    gloss = specular.texture, roughness.texture
    if not with_expressions or maps.deltas is None:
        texture = map_mips.relief_from_buffers(device, [maps.heights], (map_side, map_side), map_side)
        return PaintedTextures(colour.texture, *gloss, texture, None)
    relief, heights = (
        map_mips.empty_map(device, (map_side, map_side)),
        device.storage_buffer(maps.heights.size),
    )
    bindings: MutableBindings = {"colour_at_rest": maps.colour.texture, "heights_at_rest": maps.heights}
    bindings |= {"expression_deltas": maps.deltas, "heights": heights, "colour": colour.levels[0]}
    expression_maps = ExpressionMaps(bindings, heights, colour, relief, living, bands)
    return PaintedTextures(colour.texture, *gloss, relief.texture, expression_maps)


def _living_maps(device: Device, inputs: PaintInputs, look: SkinLook, maps: RestMaps) -> LivingMaps:
    """Return the maps of painted skin in a state or with a pulse."""
    map_side = maps.colour.size[0]
    zone_bindings: MutableBindings = {"paint": inputs.paint, "tables": inputs.tables}
    zone_bindings |= _surface_buffers(device, inputs, map_side)
    gloss = maps.specular.texture, maps.roughness.texture
    return make_living_maps(device, look, zone_bindings, *gloss, inputs.bands)


def paint_arrays(
    device: Device,
    surface: PaintedSurface,
    look: SkinLook,
    map_side: int,
    skin_state: SkinState | None = None,
) -> Maps:
    """Paint the maps of a skin that has the given look, and return them as arrays.

    Pores and fine lines are left out, because they are too fine for maps. Heights fade to 0 outside the
    charts of the uv layout.

    skin_state : state and pulse of the skin, None for skin at rest
    """
    arrays = paint_raw_arrays(device, surface, look, map_side, skin_state)
    rho_s = DEFAULT_RHO_S * arrays.specular[..., 0]
    return Maps(
        colour=np.ascontiguousarray(arrays.colour[..., :3]),
        height=arrays.height_mm,
        specular=np.clip(rho_s, 0.0, 1.0),
        roughness=np.ascontiguousarray(arrays.roughness[..., 0]),
    )


def paint_raw_arrays(
    device: Device,
    surface: PaintedSurface,
    look: SkinLook,
    map_side: int,
    skin_state: SkinState | None = None,
) -> RawPaintedArrays:
    """Paint the maps of a skin that has the given look, and return all channels that the shader writes.

    skin_state : state and pulse of the skin, None for skin at rest
    """
    inputs = paint_inputs(surface, look, map_side)
    maps = paint_rest_maps(device, inputs, map_side)
    if skin_state is not None:
        maps = _with_state(device, maps, _living_maps(device, inputs, look, maps), skin_state)
    textures = maps.colour, maps.specular, maps.roughness
    colour, specular, roughness = (download(device, one.texture).astype(np.float32) for one in textures)
    raw = np.frombuffer(device.handle.queue.read_buffer(maps.heights), np.float32)
    height = np.ascontiguousarray(raw.reshape(map_side + 2, map_side + 2)[1:-1, 1:-1])
    return RawPaintedArrays(colour, specular, roughness, height)


def _with_state(device: Device, maps: RestMaps, living: LivingMaps, skin_state: SkinState) -> RestMaps:
    """Return the finest mip levels of painted maps with a state and a pulse, without an expression."""
    side, frame = maps.colour.size[0], CommandList(device, timed=False)
    colour = map_mips.empty_map(device, (side, side))
    draw_state_texels(frame, living, skin_state)
    shader = program(device, "surface/painting/expression.wgsl", LIVING_CONSTANTS)
    assert maps.deltas is not None
    bindings: MutableBindings = {"colour_at_rest": maps.colour.texture, "expression_deltas": maps.deltas}
    bindings |= living.bindings | {"living": pulse_record(shader, living, skin_state)}
    bindings |= {"expression": shader.make_record("Expression", side=side), "colour": colour.levels[0]}
    frame.compute("maps", shader, bindings, (side, side))
    frame.submit()
    return maps._replace(colour=colour, specular=living.specular, roughness=living.roughness)
