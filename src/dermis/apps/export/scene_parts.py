"""Replacement of lights that a program does not support, and encoding of triangle meshes as PLY files."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import notify
from dermis.mesh.mesh import Mesh
from dermis.scene.lights import Light


def supported_lights(
    lights: Iterable[Light], supported_kinds: Container[str], program_name: str
) -> list[Light]:
    """Return the lights, with each unsupported one replaced by a similar supported one; warn of replacements.

    supported_kinds : kinds of light that the program supports, at least "point" and "directional"
    program_name : name of the program, for the warnings
    """
    return [
        _as_supported_light(light, supported_kinds, f"light {k}: {program_name}")
        for k, light in enumerate(lights, 1)
    ]


def _as_supported_light(light: Light, supported_kinds: Container[str], warning_start: str) -> Light:
    if light.kind in supported_kinds:
        return light
    bases = (one for one in type(light).__mro__ if issubclass(one, Light))
    base = next(one for one in bases if one.model_fields["kind"].default in supported_kinds)
    replacement = base(**{name: getattr(light, name) for name in base.model_fields if name != "kind"})
    notify(f"{warning_start} has no {light.kind} light, so it becomes a {replacement.kind} light")
    return replacement


def mesh_ply(
    mesh: Mesh, face_mask: NDArray[np.bool_], centre_mm: Sequence[float], *, is_v_upwards: bool
) -> bytes:
    """Return selected triangles of a mesh as a binary PLY file with normals and uv.

    face_mask : (t,) mask of the selected triangles
    centre_mm : (3,) point that becomes the origin of the file [mm]
    is_v_upwards : whether v points upwards in the file; in the mesh, v points downwards
    """
    vertex, corner = np.unique(mesh.triangles[face_mask], return_inverse=True)
    u, v = mesh.uv[vertex].astype("<f4").T
    positions = mesh.positions[vertex] - np.asarray(centre_mm)
    uv = np.column_stack([u, 1.0 - v if is_v_upwards else v])
    return encode_ply(corner.reshape(-1, 3), positions, mesh.normals[vertex], uv)


def encode_ply(
    triangles: NDArray[np.integer],
    positions: ArrayLike,
    normals: ArrayLike | None = None,
    uv: ArrayLike | None = None,
    vertex_colours: ArrayLike | None = None,
) -> bytes:
    """Return a triangle mesh as a binary PLY file.

    triangles : (t, 3) vertex indices
    positions, normals : (v, 3) positions and unit normals of the vertices
    uv : (v, 2) texture coordinates of the vertices
    vertex_colours : (v, 3) linear colour of the vertices
    """
    attributes = {"x y z": positions, "nx ny nz": normals, "u v": uv, "r g b": vertex_colours}
    columns = {names: values for names, values in attributes.items() if values is not None}
    vertices = np.concatenate([np.asarray(values, "<f4") for values in columns.values()], axis=1)
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for names in columns for name in names.split()),
        f"element face {len(triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.empty(len(triangles), [("count", "u1"), ("corner", "<i4", (3,))])
    faces["count"], faces["corner"] = 3, triangles
    return "\n".join(header).encode() + b"\n" + vertices.tobytes() + faces.tobytes()
