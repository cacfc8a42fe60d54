"""Passes of hair, which draw the strands over the picture of the head without hair.

The passes pose the strands, render shadow maps of them, compute the light at their knots (the end points of
their segments), and draw the segments.
"""

from __future__ import annotations

import numpy as np

from dermis.frame.features.hair.resources import (
    KNOTS_PER_BOUNDS_WORKGROUP,
    SKY_CELLS,
    SKY_CELLS_PER_WORKGROUP,
    VIEW_TEXEL_PIXELS,
    Resources,
    StrandCounts,
    StrandTables,
    drawn_strand_counts,
    sky_cell_count,
)
from dermis.frame.features.hair.skin_grid import draw_skin_grid
from dermis.frame.features.hair.swing import Swing, run_step
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import Shape
from dermis.frame.programs import program, workgroup_grid
from dermis.frame.projection import Views
from dermis.gpu import (
    Bindings,
    Buffer,
    ComputeProgram,
    Constants,
    Device,
    Graph,
    MutableBindings,
    Recorder,
    Texture,
    UniformRecord,
)

ShadingInputs = tuple[Bindings, UniformRecord, Constants]
"""Resources of the lighting, uniform record of the shading pass, and pipeline constants of the lights."""

_MAX_ROWS_PER_INVOCATION, _MAX_LOOP_ITERATIONS = 8, 60_000
_HAIR_EXTENT_MM = 100.0  # side of a square that holds most hair of a head
_CROWDED_TILE_SEGMENT_RATIO = (
    14.0  # ratio of the number of segments in a crowded tile to the mean of all tiles
)
_CLEARING_WORKGROUP_COUNT = 256
_LIGHT_STRIDE, _MIN_BEND_OF_STRIDE_MM = 2, 12.0  # where strands bend less, every second knot is shaded
_SHADOW_RAY_STRIDE = 4  # one of four rays to an area light is traced: pictures change by 0.0002 at most


def draw_shadows(
    graph: Graph,
    strands: Resources,
    geometry: tuple[Shape, HeadGeometry],
    shadow_views: Views,
    lighting_bindings: Bindings,
    has_environment: bool,
) -> None:
    """Declare the passes that pose the strands that cast shadows, and compute the shadows of the hair.

    The passes fill the grid of the skin, and the deep opacity maps of lights. For an environment, they also
    fill the grid of sky transmittance.

    geometry : current shape of the head, and its vertices and triangles
    """
    tables = strands.tables
    if tables.groom is not None:
        draw_skin_grid(graph, tables.groom.skin, geometry[1])
    pose_strands(graph, tables, geometry[0], tables.buffers.casters, tables.casters)
    if len(shadow_views.clips) or has_environment:
        _draw_deep_opacity(graph, strands, lighting_bindings)
    if has_environment and tables.casters.hairs:
        _draw_sky_transmittance(graph, strands, geometry[1], lighting_bindings)


def draw_guides(
    graph: Graph, strands: Resources, geometry: tuple[Shape, HeadGeometry], swing: Swing | None
) -> Resources:
    """Declare the passes that move the guides with the skin, and the current step of their simulation.

    Returns the resources with the guides that the strands follow.

    geometry : current shape of the head, and its vertices and triangles
    swing : simulation of the guides, None if hair does not swing
    """
    graph.add_replayable(pose_guides, strands.tables, geometry[0])
    return strands if swing is None else run_step(graph, strands, geometry, swing, swing.steps[-1])


def pose_guides(graph: Recorder, strand_tables: StrandTables, shape: Shape) -> None:
    """Declare the passes that move the guide strands of a hair style with the skin."""
    if strand_tables.groom is None:
        return
    style = strand_tables.groom.style
    guides: Bindings = {"guide_rest": style.guide_rest, "bound_guides": style.bound_guides}
    knots, points = style.guide_rest.size // 16, shape.surface["points"]
    bound: Bindings = {"points": points, "anchors": style.anchors, "guide_ceilings": style.guide_ceilings}
    _dispatch_hair(graph, "hair/guides_pose.wgsl", {**guides, **bound}, knots)
    _dispatch_hair(graph, "hair/guides_smooth.wgsl", {**guides, "guides": style.guides}, knots)


def pose_strands(
    graph: Recorder,
    strand_tables: StrandTables,
    shape: Shape,
    posed_strands: Buffer,
    coarse_counts: StrandCounts,
) -> None:
    """Declare the passes that move brows and lashes with the skin, and interpolate other strands from guides.

    posed_strands : buffer to which the posed strands are written
    coarse_counts : number of interpolated strands (scalp hair and beard), and number of knots of each
    """
    shared: Bindings = {
        "points": shape.surface["points"],
        "hairs": strand_tables.hairs_record(coarse_counts),
        "posed": posed_strands,
    }
    if strand_tables.fine.hairs:
        fine: Bindings = {"strands": strand_tables.strands, "knots": strand_tables.knots}
        _dispatch_hair(
            graph, "hair/strands_pose.wgsl", {**shared, **fine}, strand_tables.fine.total_knot_count()
        )
    if strand_tables.groom is not None:
        groom, style = strand_tables.groom, strand_tables.groom.style
        person: Bindings = {"roots": groom.roots, "parts": groom.parts, "hairline": groom.hairline}
        skin: Bindings = {"skin": groom.skin.skin}
        guides: Bindings = {"guides": style.guides, "guide_cuts": style.guide_cuts}
        _dispatch_hair(
            graph,
            "hair/strands_grow.wgsl",
            {**shared, **person, **guides, **skin},
            coarse_counts.total_knot_count(),
        )


def _draw_deep_opacity(graph: Recorder, strands: Resources, lighting_bindings: Bindings) -> None:
    """Declare the passes that fill the deep opacity maps of all lights that cast shadows."""
    tables, posed = strands.tables, strands.tables.buffers.casters
    segments = tables.fine.total_segment_count() + tables.casters.total_segment_count()
    knots = tables.fine.total_knot_count() + tables.casters.total_knot_count()
    bindings: MutableBindings = {
        **lighting_bindings,
        "posed": posed,
        "hairs": tables.hairs_record(tables.casters),
    }
    bindings |= {"windows": strands.shadows, "opacity": strands.shadows}
    clear = program(graph.device, "hair/strands_clear.wgsl")
    graph.dispatch("strands", clear, bindings, (_CLEARING_WORKGROUP_COUNT, 1, 1))
    windows = program(graph.device, "hair/strands_window.wgsl")
    graph.dispatch("strands", windows, bindings, (max(1, -(-knots // KNOTS_PER_BOUNDS_WORKGROUP)), 1, 1))
    for adds_cover in (0, 1):
        _dispatch_hair(graph, "hair/strands_shadow.wgsl", bindings, segments, (("ADDS_COVER", adds_cover),))


def _draw_sky_transmittance(
    graph: Recorder, strands: Resources, head: HeadGeometry, lighting_bindings: Bindings
) -> None:
    """Declare the passes that compute the grid of sky transmittance from the strands that cast shadows."""
    tables = strands.tables
    bindings: MutableBindings = {**lighting_bindings, **head.resources, "posed": tables.buffers.casters}
    bindings |= {"hairs": tables.hairs_record(tables.casters), "opacity": strands.shadows}
    segments = tables.fine.total_segment_count() + tables.casters.total_segment_count()
    _dispatch_hair(graph, "hair/sky_strands.wgsl", bindings, segments)
    triangles = (("TRIANGLES", head.triangles),)
    _dispatch_hair(graph, "hair/sky_head.wgsl", bindings, head.triangles, triangles)
    march = program(graph.device, "hair/sky_transmittance.wgsl")
    rows = -(-sky_cell_count() // (SKY_CELLS[0] * SKY_CELLS_PER_WORKGROUP))
    graph.dispatch("strands", march, bindings, (SKY_CELLS[0], rows, 1))


def draw(
    graph: Recorder,
    strands: Resources,
    geometry: tuple[Shape, HeadGeometry],
    shading_inputs: ShadingInputs,
    visibility_buffer: Texture,
    radiance: Texture,
    labels: Bindings | None = None,
) -> Texture:
    """Declare the passes that shade the strands and draw them over the picture; return the new picture.

    geometry : current shape of the head, and its vertices and triangles
    shading_inputs : resources of the lighting, uniform record of the shading pass, and pipeline constants of
        the lights
    visibility_buffer : texture with the index of the triangle that is visible at each sample
    radiance : texture of the picture without hair
    labels : resources that the pass needs to label pixels of hair, None if no labels are requested
    """
    tables, picture, (lighting, view, light_constants) = strands.tables, strands.picture, shading_inputs
    shape, head = geometry
    width, height = picture.result.size[:2]
    pixel_mm = _pixel_footprint_mm(view, tables, height)
    coarse, posed = drawn_strand_counts(tables, pixel_mm), tables.buffers.drawn
    pose_strands(graph, tables, shape, posed, coarse)
    segments = tables.fine.total_segment_count() + coarse.total_segment_count()
    knots = tables.fine.total_knot_count() + coarse.total_knot_count()
    stride = _LIGHT_STRIDE if tables.bend_mm >= _MIN_BEND_OF_STRIDE_MM else 1
    light_constants = (*light_constants, ("RAY_STRIDE", _SHADOW_RAY_STRIDE), ("STRIDE", stride))
    light = program(graph.device, "hair/strands_light.wgsl", light_constants)
    record = _strand_view_record(light, strands, view, coarse.hairs)
    hairs = tables.hairs_record(coarse)
    shared: MutableBindings = {"strand_view": record, "projected": tables.buffers.projected, "hairs": hairs}
    _draw_view_map(graph, tables, picture.view_map, record, pixel_mm)
    shared["posed"] = posed
    _dispatch_hair(graph, "hair/strands_hide.wgsl", {**shared, "view_map": picture.view_map}, knots)
    points = tables.fine.total_knot_count() + coarse.hairs * ((coarse.knots - 2) // stride + 2)
    graph.dispatch("strands", light, {**lighting, **shared}, workgroup_grid(points))
    if stride > 1 and coarse.hairs:
        inner: Bindings = {name: shared[name] for name in ("strand_view", "projected", "hairs")}
        _dispatch_hair(
            graph, "hair/strands_spread.wgsl", inner, coarse.total_knot_count(), (("STRIDE", stride),)
        )
    lists: Bindings = {"list_heads": picture.list_heads, "links": picture.links}
    _dispatch_hair(graph, "hair/strands_empty.wgsl", lists, picture.list_heads.size // 4)
    tile_side = (("STRAND_TILE", picture.tile_side),)
    _dispatch_hair(graph, "hair/strands_bin.wgsl", {**shared, **lists}, segments, tile_side)
    images: Bindings = {"visibility_buffer": visibility_buffer, "behind": radiance, "image": picture.result}
    bindings = {**head.resources, **shared, **lists, **images, **(labels or {})}
    rows = rows_per_invocation(
        graph.device, _max_segments_in_tile(tables, segments, pixel_mm * picture.tile_side)
    )
    shader = program(
        graph.device,
        "hair/strands_draw.wgsl",
        (("ROWS", rows), *tile_side),
        stores_hair_labels=labels is not None,
    )
    graph.compute("strands", shader, bindings, (width, -(-height // rows)))
    return picture.result


def _draw_view_map(
    graph: Recorder,
    strand_tables: StrandTables,
    view_map: Buffer,
    strand_view: UniformRecord,
    pixel_mm: float,
) -> None:
    """Declare the passes that fill the deep opacity map of the picture, by which hidden strands are left out.

    The map remains empty, so that no strand is left out, if the strands that stand for all others are wider
    than two of its texels.

    strand_view : result of `_strand_view_record`
    pixel_mm : side of the square that a pixel covers at the depth of scalp hair and beard [mm]
    """
    casters = strand_tables.casters
    bindings: Bindings = {
        "opacity": view_map,
        "posed": strand_tables.buffers.casters,
        "hairs": strand_tables.hairs_record(casters),
        "strand_view": strand_view,
    }
    _dispatch_hair(graph, "hair/view_map_clear.wgsl", bindings, view_map.size // 4)
    caster_mm = strand_tables.width_mm * strand_tables.possible / max(1, casters.hairs)
    if not casters.hairs or caster_mm > 2.0 * VIEW_TEXEL_PIXELS * pixel_mm:
        return
    segments = strand_tables.fine.total_segment_count() + casters.total_segment_count()
    for adds_cover in (0, 1):
        _dispatch_hair(graph, "hair/view_map_fill.wgsl", bindings, segments, (("ADDS_COVER", adds_cover),))


def _strand_view_record(
    shader: ComputeProgram, strands: Resources, shade_record: UniformRecord, coarse_count: int
) -> UniformRecord:
    """Return a record of the shader's struct StrandView: camera, samples and number of strands.

    shade_record : uniform record of the shading pass
    coarse_count : number of strands of scalp hair and beard to draw
    """
    members = ("eye", "forward", "right", "up", "shift", "samples", "jitter", "light_factors")
    record = shader.make_record("StrandView", **{name: shade_record[name] for name in members})
    record["coarse"], record["size"] = coarse_count, strands.picture.result.size[:2]
    record["skin"] = shade_record["skin_albedo"]
    return record


def _pixel_footprint_mm(
    shade_record: UniformRecord, strand_tables: StrandTables, picture_height: int
) -> float:
    """Return the side of the square that a pixel covers at the depth of scalp hair and beard [mm].

    shade_record : uniform record of the shading pass
    picture_height : height of the picture [pixels]
    """
    depth = float(np.dot(strand_tables.centre_mm - shade_record["eye"], shade_record["forward"]))
    return 2.0 * float(np.linalg.norm(shade_record["up"])) * max(depth, 1.0) / picture_height


def _max_segments_in_tile(strand_tables: StrandTables, segment_count: int, tile_mm: float) -> int:
    """Estimate the number of strand segments in a crowded tile of the picture.

    The tile is assumed to contain a tenth of the segments of brows and lashes, and several times as many
    segments of scalp hair and beard as the average tile.

    segment_count : number of segments of all strands that are drawn
    tile_mm : side of the square that a tile covers at the depth of the strands [mm]
    """
    tiles = max(1.0, (_HAIR_EXTENT_MM / tile_mm) ** 2)
    fine = strand_tables.fine.total_segment_count()
    return int(fine // 10 + min(1.0, _CROWDED_TILE_SEGMENT_RATIO / tiles) * (segment_count - fine))


def rows_per_invocation(device: Device, segment_count: int) -> int:
    """Return the number of vertically adjacent pixels that one shader invocation draws, a power of two.

    segment_count : estimate of the largest number of segments in a tile

    The result is 1 on GPUs. On software adapters, pixels without hair are skipped faster if each invocation
    loops over several pixels. The result is limited there, because these adapters end the loops of an
    invocation after 65,535 iterations in total.
    """
    if device.adapter.kind != "CPU":
        return 1
    rows = max(1, min(_MAX_ROWS_PER_INVOCATION, _MAX_LOOP_ITERATIONS // max(1, segment_count)))
    return 1 << rows.bit_length() - 1


def _dispatch_hair(
    graph: Recorder, shader_path: str, bindings: Bindings, invocation_count: int, constants: Constants = ()
) -> None:
    """Declare a hair pass with one shader invocation for each of `invocation_count` elements."""
    graph.dispatch(
        "strands", program(graph.device, shader_path, constants), bindings, workgroup_grid(invocation_count)
    )
