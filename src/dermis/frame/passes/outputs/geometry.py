"""Outputs of the mesh, where the centre of each pixel meets it, and its normals."""

from __future__ import annotations

from typing import Any

from dermis.frame.passes.meter import rays_of
from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, ComputeProgram, Constants, Recorder


def look_of(shader: ComputeProgram, view: Any, centre_mm: Triple) -> Any:
    """A record of the struct Look of seen.wgsl.

    view : record of the shading
    centre_mm : the head's, from which places of a scene are counted
    """
    return shader.record("Look", rays=rays_of(shader, view), centre=centre_mm)


def draw(
    graph: Recorder,
    planes: Planes,
    lit: Bindings,
    look: tuple[Any, Triple],
    centres: Any,
    constants: Constants = (),
) -> None:
    """Fill the planes of a stage that reads the mesh, and its maps where it includes skin.wgsl.

    lit : resources of the shading
    look : record of the shading, and the head's centre
    centres : texture of the triangles at the pixels' centres
    constants : of the surface, for stages that have them
    """
    shader = outputs.stage_program(graph.device, planes, constants)
    bound = {**lit, "look": look_of(shader, *look), "centres": centres}
    outputs.draw(graph, planes, shader, bound)
