"""What each pixel shows, as a class: a part of the mesh, or the hairs over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.geometry import HeadResources
from dermis.frame.passes import program, strands
from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.frame.strands import StrandResources
from dermis.gpu import Recorder
from dermis.gpu.program import Resources


@dataclass(frozen=True, eq=False)
class LabelSpace:
    """Buffers as label.wgsl and hair_label.wgsl read them.

    tables : by their names there
    fields : how many there are
    classes : of the hairs, None for no hairs
    hairs : what hairs make of each pixel
    """

    tables: dict[str, Any]
    fields: int
    classes: Any | None
    hairs: Any


def draw(
    graph: Recorder,
    planes: Planes,
    lit: Resources,
    look: tuple[Any, Triple],
    centres: Any,
    space: LabelSpace,
) -> None:
    """Fill the planes.

    lit, look, centres : as of `geometry.draw`
    """
    constants = ("FIELDS", space.fields), ("HAIRS", space.classes is not None)
    shader = outputs.stage_program(graph.device, planes, constants)
    bound = {**lit, **space.tables, "look": look_of(shader, *look), "centres": centres}
    outputs.draw(graph, planes, shader, bound | {"hair_labels": space.hairs})


def draw_hairs(
    graph: Recorder, space: LabelSpace, made: StrandResources, view: Any, head: HeadResources, centres: Any
) -> None:
    """Find the class of the hairs over each pixel, of those that the picture's strands were listed from.

    view : record of the shading
    """
    tables, picture, rows = made.tables, made.picture, 1
    if picture.ways > 1:
        shader = program(graph.device, "outputs/hair_label_tiles.wgsl", (("WAYS", picture.ways),))
    else:
        rows = strands.rows_for(graph.device, made, view)
        shader = program(graph.device, "outputs/hair_label.wgsl", (("ROWS", rows),))
    record, _ = strands.view_record(shader, made, view)
    record["samples"], record["jitter"][0, :2] = 1, 0.5
    bound = head.resources | {"strand_view": record, "drawn": tables.drawn, "hairs": tables.record}
    bound |= {"chains": picture.chains, "links": picture.links, "visibility_buffer": centres}
    bound |= {"hair_classes": space.classes, "hair_labels": space.hairs}
    width, height = picture.result.size[:2]
    graph.compute("outputs", shader, bound, (width, -(-height // rows)))
