"""Passes of hair: posing, shadows, shading at knots, and drawing over the picture."""

from __future__ import annotations

import numpy as np

from dermis.frame.features.hair.resources import TILE, WINDOW_KNOTS, Resources, StrandTables, drawn_of
from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.features.shape.shape import Shape
from dermis.frame.programs import each, program
from dermis.frame.projection import Views
from dermis.gpu import (
    Bindings,
    ComputeProgram,
    Constants,
    Device,
    Graph,
    MutableBindings,
    Record,
    Recorder,
    Texture,
)

Look = tuple[Bindings, Record, Constants]

_ROWS, _ROUNDS = 8, 60_000
_HEAD_MM = 100.0  # side of a square that has no more hair than a head seen from anywhere
_CROWDED = 6.0  # pieces that a tile may list, over their mean
_CLEARING = 256  # workgroups that empty the shadows of hairs
_RAYS_APART = 4  # of those to an area light: all of them change pictures by 0.0002 of their light at most


def draw_shadows(graph: Graph, made: Resources, shape: Shape, shadow_views: Views, lit: Bindings) -> None:
    """Declare the passes that pose the hairs and find what they hold back of lights that cast shadows."""
    graph.repeat(pose, made.tables, shape)
    if len(shadow_views.clips):
        shadow(graph, made, lit)


def pose(graph: Recorder, made: StrandTables, shape: Shape) -> None:
    """Put the hairs where the skin is."""
    bound: MutableBindings = {
        "points": shape.surface["points"],
        "strands": made.strands,
        "knots": made.knots,
        "hairs": made.record,
    }
    count = made.fine.hairs * made.fine.knots + made.coarse.hairs * made.coarse.knots
    _each(graph, "hair/strands_pose.wgsl", bound | {"posed": made.posed}, count)


def shadow(graph: Recorder, strands: Resources, lit: Bindings) -> None:
    """Find what the hairs hold back of each light that casts shadows."""
    made = strands.tables
    pieces = made.fine.pieces() + made.coarse.pieces(made.shading)
    knots = made.fine.hairs * made.fine.knots + made.shading * made.coarse.knots
    bound: MutableBindings = {**lit, "posed": made.posed, "hairs": made.record}
    bound |= {"windows": strands.shadows, "splatted": strands.shadows}
    graph.dispatch("strands", program(graph.device, "hair/strands_clear.wgsl"), bound, (_CLEARING, 1, 1))
    ends = program(graph.device, "hair/strands_window.wgsl")
    graph.dispatch("strands", ends, bound, (max(1, -(-knots // WINDOW_KNOTS)), 1, 1))
    for covers in (0, 1):
        _each(graph, "hair/strands_shadow.wgsl", bound, pieces, (("COVERS", covers),))


def draw(
    graph: Recorder,
    strands: Resources,
    look: Look,
    head: HeadResources,
    visibility: Texture,
    radiance: Texture,
    labels: Bindings | None = None,
) -> Texture:
    """The picture with hairs over it, a texture of theirs.

    look : resources and record of the shading, and pipeline constants of the lights
    visibility : texture of the triangles that samples see
    labels : what is bound where the class of the hairs over each pixel is found as well
    """
    made, picture, (lit, view, lights) = strands.tables, strands.picture, look
    light = program(graph.device, "hair/strands_light.wgsl", (*lights, ("RAYS_APART", _RAYS_APART)))
    record, coarse = _view_record(light, strands, view)
    seen: Bindings = {"strand_view": record, "drawn": made.drawn, "hairs": made.record}
    knots = made.fine.hairs * made.fine.knots + coarse * made.coarse.knots
    pieces = made.fine.pieces() + made.coarse.pieces(coarse)
    graph.dispatch("strands", light, {**lit, **seen, "posed": made.posed}, each(knots))
    listed: Bindings = {"chains": picture.chains, "links": picture.links}
    _each(graph, "hair/strands_empty.wgsl", listed, picture.chains.size // 4)
    ways = (("WAYS", picture.ways),)
    _each(graph, "hair/strands_bin.wgsl", {**seen, **listed}, pieces, ways)
    over: Bindings = {"visibility_buffer": visibility, "behind": radiance, "image": picture.result}
    bound = {**head.resources, **seen, **listed, **over, **(labels or {})}
    width, height = picture.result.size[:2]
    if picture.ways > 1:
        shader = program(graph.device, "hair/strands_draw_tiles.wgsl", ways, labels=labels is not None)
        graph.compute("strands", shader, bound, (width, height))
        return picture.result
    rows = _rows_for(graph.device, strands, view)
    shader = program(graph.device, "hair/strands_draw.wgsl", (("ROWS", rows),), labels=labels is not None)
    graph.compute("strands", shader, bound, (width, -(-height // rows)))
    return picture.result


def _view_record(shader: ComputeProgram, strands: Resources, view: Record) -> tuple[Record, int]:
    """A shader's record StrandView, and how many coarse hairs stand for all.

    view : record of the shading
    """
    made, size = strands.tables, strands.picture.result.size[:2]
    looked = ("eye", "forward", "right", "up", "shift", "samples", "jitter", "shown")
    record = shader.record("StrandView", **{name: view[name] for name in looked})
    coarse = drawn_of(made, _pixel_mm(view, made, size[1]))
    record["coarse"], record["size"], record["skin"] = coarse, size, strands.skin
    record["wider"] = made.coarse.hairs / max(1, coarse)
    return record, coarse


def _rows_for(device: Device, strands: Resources, view: Record) -> int:
    """`rows_of` what tiles of this picture may list."""
    made = strands.tables
    pixel_mm = _pixel_mm(view, made, strands.picture.result.size[1])
    pieces = made.fine.pieces() + made.coarse.pieces(drawn_of(made, pixel_mm))
    return rows_of(device, _most_in_tile(made, pieces, pixel_mm))


def _pixel_mm(view: Record, made: StrandTables, height: int) -> float:
    """Side of a pixel where the coarse hairs are [mm]."""
    deep = float(np.dot(made.middle_mm - view["eye"], view["forward"]))
    return 2.0 * float(np.linalg.norm(view["up"])) * max(deep, 1.0) / height


def _most_in_tile(made: StrandTables, pieces: int, pixel_mm: float) -> int:
    """Pieces that a tile may list: all the fine ones, and several times the mean of the coarse ones."""
    tiles = max(1.0, (_HEAD_MM / (TILE * pixel_mm)) ** 2)
    return int(made.fine.pieces() + min(1.0, _CROWDED / tiles) * (pieces - made.fine.pieces()))


def rows_of(device: Device, pieces: int) -> int:
    """Pixels that an invocation draws one below the other: a power of two, so that few shaders are compiled.

    pieces : in a tile, at most

    Software adapters run the whole shader for pixels without hairs too, unless a loop skips these. They also
    leave a shader's loops, all together, after 65,535 rounds.
    """
    if device.adapter.kind != "CPU":
        return 1
    most = max(1, min(_ROWS, _ROUNDS // max(1, pieces)))
    return 1 << most.bit_length() - 1


def _each(graph: Recorder, name: str, bound: Bindings, count: int, constants: Constants = ()) -> None:
    """A pass of one invocation for each of `count`."""
    graph.dispatch("strands", program(graph.device, name, constants), bound, each(count))
