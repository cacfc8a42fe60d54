"""What each pixel shows, as a class: a part of the mesh, or the hairs over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, Recorder


@dataclass(frozen=True, eq=False)
class LabelSpace:
    """Buffers as label.wgsl and strand_labels.wgsl read them.

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
    lit: Bindings,
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


def of_hairs(space: LabelSpace, centres: Any) -> Bindings:
    """What the pass that draws the hairs is given, to find their class over each pixel.

    centres : texture of the triangles at the pixels' centres
    """
    return {"hair_classes": space.classes, "hair_labels": space.hairs, "centres": centres}
