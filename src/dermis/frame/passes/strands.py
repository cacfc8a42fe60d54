"""Hairs: moved by the skin, lit at their knots, drawn over the picture, and the shadows that they cast."""

from __future__ import annotations

from typing import Any

from dermis.frame.geometry import HeadResources
from dermis.frame.passes import each, program
from dermis.frame.shape import Shape
from dermis.frame.strands import StrandResources, StrandTables
from dermis.gpu import Constants, Device, Recorder
from dermis.gpu.program import Resources

Look = tuple[Resources, Any, Constants]

_ROWS, _ROUNDS = 8, 60_000
_CLEARING = 64  # workgroups that empty the shadows of hairs, one for each light at least


def pose(graph: Recorder, made: StrandTables, shape: Shape) -> None:
    """Put the hairs where the skin is."""
    bound = {"points": shape.surface["points"], "strands": made.strands, "knots": made.knots}
    count = made.hairs + made.pieces
    _each(graph, "strands_pose.wgsl", bound | {"posed": made.posed}, count, made.constants)


def shadow(graph: Recorder, strands: StrandResources, lit: Resources) -> None:
    """Find what the hairs hold back of each light that casts shadows."""
    made = strands.tables
    bound = {**lit, "posed": made.posed, "windows": strands.shadows, "splatted": strands.shadows}
    shader = program(graph.device, "strands_window.wgsl", made.constants)
    graph.dispatch("strands", shader, bound, (_CLEARING, 1, 1))
    _each(graph, "strands_shadow.wgsl", bound, made.pieces, made.constants)


def draw(
    graph: Recorder, strands: StrandResources, look: Look, head: HeadResources, visibility: Any, radiance: Any
) -> Any:
    """The picture with hairs over it, a texture of theirs.

    look : resources and record of the shading, and pipeline constants of the lights
    visibility : texture of the triangles that samples see
    """
    made, picture, (lit, view, lights) = strands.tables, strands.picture, look
    light = program(graph.device, "strands_light.wgsl", made.constants + lights)
    looked = ("eye", "forward", "right", "up", "shift", "samples", "jitter", "shown")
    record = light.record("StrandView", **{name: view[name] for name in looked})
    record["hairs"], record["size"], record["skin"] = made.hairs, picture.result.size[:2], strands.skin
    seen = {"strand_view": record, "drawn": made.drawn}
    graph.dispatch("strands", light, {**lit, **seen, "posed": made.posed}, each(made.hairs + made.pieces))
    listed = {"chains": picture.chains, "links": picture.links}
    _each(graph, "strands_empty.wgsl", listed, picture.chains.size // 4)
    ways = (("WAYS", picture.ways),)
    _each(graph, "strands_bin.wgsl", seen | listed, made.pieces, made.constants + ways)
    bound = head.resources | seen | listed
    bound |= {"visibility_buffer": visibility, "behind": radiance, "image": picture.result}
    width, height = picture.result.size[:2]
    if picture.ways > 1:
        shader = program(graph.device, "strands_draw_tiles.wgsl", made.constants + ways)
        graph.compute("strands", shader, bound, (width, height))
        return picture.result
    rows = rows_of(graph.device, made.pieces)
    shader = program(graph.device, "strands_draw.wgsl", (*made.constants, ("ROWS", rows)))
    graph.compute("strands", shader, bound, (width, -(-height // rows)))
    return picture.result


def rows_of(device: Device, pieces: int) -> int:
    """Pixels that an invocation draws one below the other.

    Software adapters run the whole shader for pixels without hairs too, unless a loop skips these. They also
    leave a shader's loops, all together, after 65,535 rounds, and all hairs may lie in one tile.
    """
    return max(1, min(_ROWS, _ROUNDS // max(1, pieces))) if device.adapter.kind == "CPU" else 1


def _each(graph: Recorder, name: str, bound: Any, count: int, constants: Any = ()) -> None:
    """A pass of one invocation for each of `count`."""
    graph.dispatch("strands", program(graph.device, name, constants), bound, each(count))
