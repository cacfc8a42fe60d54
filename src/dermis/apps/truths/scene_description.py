"""Conversion of positions, colours, shapes and environments to the conventions of Mitsuba and Cycles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.environment.panorama import UNIFORM_PANORAMA, load_panorama
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment

Floats = NDArray[np.float64]
SceneDict = dict[str, Any]
"""Nested dictionary of numbers, strings, lists and Mitsuba objects, as input of Mitsuba or as JSON."""
Mitsuba = Any
"""Untyped module `mitsuba` with a variant set, or the exporter that writes XML instead."""
MitsubaObject = Any
"""Untyped object of Mitsuba: a scene, a mesh, a transform, a material or a medium."""
Vector = Sequence[float] | Floats
"""Vector of three components: a position, direction or colour."""
CYCLES_UNIT_MM = 100.0
"""Length of Cycles' unit; a head is a few units in size, as its sampling expects."""
_UP_AXIS = 0.0, 1.0, 0.0
_CYCLES_FROM_DERMIS_AXES = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def check_camera(camera: Camera, renderer: str) -> None:
    """Raise DermisError for a camera with a shifted principal point or non-square pixels.

    renderer : name of the renderer that does not support such cameras, for the message
    """
    if camera.principal_point != (0.5, 0.5) or camera.pixel_aspect != 1.0:
        expected = f"a principal point in the middle and square pixels, for {renderer}"
        actual = f"got principal_point {camera.principal_point} and pixel_aspect {camera.pixel_aspect:g}"
        refuse("camera", expected, actual, "Render with such a camera, and crop or resample the picture")


def mitsuba_rgb(colour: Iterable[float]) -> SceneDict:
    """Return Mitsuba's description of a linear Rec. 709 colour."""
    return {"type": "rgb", "value": [float(value) for value in colour]}


def mitsuba_look_at(mi: Mitsuba, origin: Vector, target: Vector, up: Vector = _UP_AXIS) -> MitsubaObject:
    """Return Mitsuba's transform of an object at `origin` whose local +Z axis points towards `target`.

    up : direction to which the local Y axis is turned as closely as possible
    """
    forward = np.subtract(target, origin)
    if np.linalg.norm(np.cross(forward, up)) < 1e-6 * np.linalg.norm(forward) * np.linalg.norm(up):
        up = (1.0, 0.0, 0.0)
    return mi.ScalarTransform4f().look_at(*([float(c) for c in v] for v in (origin, target, up)))


def mitsuba_shape(shape_type: str, radiance: Vector, **shape_properties: MitsubaObject) -> SceneDict:
    """Return Mitsuba's description of an emitting shape that neither casts shadows nor reflects.

    shape_type : Mitsuba's name of the shape
    shape_properties : further properties of the shape
    """
    emitter = {"type": "area", "radiance": mitsuba_rgb(radiance)}
    return {"type": shape_type, **shape_properties, "bsdf": {"type": "null"}, "emitter": emitter}


def mitsuba_projector(
    mi: Mitsuba, intensity: Floats, cosine: Floats, to_world: MitsubaObject, half_fov_tangent: float
) -> SceneDict:
    """Return Mitsuba's projector with a given intensity for each texel of its slide.

    intensity : (h, w, 3) radiant intensity, in units of irradiance times mm2
    cosine : (h, w) cosine of the angle between the axis and the direction towards each texel
    to_world : Mitsuba's transform of the projector, see `mitsuba_look_at`
    half_fov_tangent : tangent of half the horizontal field of view
    """
    # Mitsuba's slide is the irradiance on a plane perpendicular to the axis, divided by pi.
    slide = intensity * cosine[..., None] ** 3 / np.pi
    return {
        "type": "projector",
        "to_world": to_world,
        "fov_axis": "x",
        "fov": float(2.0 * np.degrees(np.arctan(half_fov_tangent))),
        "irradiance": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(slide.astype(np.float32)),
            "raw": True,
            "filter_type": "bilinear",
            "wrap_mode": "clamp",
        },
    }


def cycles_look_at(position: Vector, forward: Vector, up: Vector = _UP_AXIS) -> list[list[float]]:
    """Return the world matrix, in Cycles' units, of an object whose local -Z axis points along `forward`.

    position : position of the object [mm]
    up : direction to which the local Y axis is turned as closely as possible
    """
    right, upwards, view_direction = camera_axes(forward, up)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, upwards, -view_direction, np.divide(position, CYCLES_UNIT_MM)])
    return [[float(value) for value in row] for row in matrix]


def camera_axes(forward: Vector, up: Vector) -> tuple[Floats, Floats, Floats]:
    """Return three unit vectors of a camera, which point to the right, upwards and forward."""
    view_direction = np.asarray(forward, np.float64) / np.linalg.norm(forward)
    right = np.cross(view_direction, up)
    if np.linalg.norm(right) < 1e-6 * np.linalg.norm(up):
        right = np.cross(view_direction, (1.0, 0.0, 0.0))
    right /= np.linalg.norm(right)
    return right, np.cross(right, view_direction), view_direction


def cycles_light(
    lamp_type: str,
    irradiance: Vector,
    energy_per_irradiance: float,
    position: Vector,
    forward: Vector,
    **lamp_properties: float | str | bool,
) -> SceneDict:
    """Return Cycles' description of a light.

    lamp_type : Cycles' type of the light
    irradiance : (3,) field `irradiance` of the light in dermis
    energy_per_irradiance : factor from this irradiance to Cycles' energy of the light
    position : (3,) position of the light relative to the head's centre [mm]
    forward : (3,) direction in which the light shines
    lamp_properties : further properties of the light
    """
    brightest = float(max(irradiance))
    colour = [float(component) / brightest if brightest > 0.0 else 0.0 for component in irradiance]
    fields: SceneDict = {
        "color": colour,
        "energy": brightest * float(energy_per_irradiance),
        **lamp_properties,
    }
    for name, value in lamp_properties.items():  # NumPy's numbers are not valid JSON
        fields[name] = value if isinstance(value, str | bool) else float(value)
    return {"type": lamp_type, "set": fields, "to_world": cycles_look_at(position, forward)}


def mitsuba_environment(mi: Mitsuba, environment: Environment) -> SceneDict:
    """Return Mitsuba's description of an environment light."""
    if environment.name == UNIFORM_PANORAMA:
        return {"type": "constant", "radiance": mitsuba_rgb(np.full(3, environment.exposure))}
    panorama = environment.exposure * load_panorama(environment.name)
    # Mitsuba's panoramas begin at the middle column of ours.
    to_world = np.eye(4)
    to_world[:3, :3] = (np.diag([-1.0, 1.0, -1.0]) @ _environment_rotation(environment)).T
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(_move_rows_to_poles(panorama).astype(np.float32)),
        "to_world": mi.ScalarTransform4f(to_world),
    }


def cycles_world(environment: Environment | None) -> tuple[SceneDict, dict[str, NDArray[np.float32]]]:
    """Return Cycles' description of an environment, and a dictionary with its panorama if it has one."""
    if environment is None:
        return {"strength": 0.0}, {}
    world: SceneDict = {"strength": environment.exposure}
    if environment.name == UNIFORM_PANORAMA:
        return world, {}
    # Cycles' panoramas have their middle at +X and their top at +Z, ours at -Z and +Y.
    world["turn"] = (_CYCLES_FROM_DERMIS_AXES @ _environment_rotation(environment)).tolist()
    return world, {"panorama": load_panorama(environment.name).astype(np.float32)}


def _environment_rotation(environment: Environment) -> Floats:
    angle = np.radians(environment.rotation_degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])


def _move_rows_to_poles(panorama: Floats) -> Floats:
    """Return a panorama resampled to h + 1 rows, the first and the last at the poles, as in Mitsuba.

    panorama : (h, w, 3) radiance at the centres of rows
    """
    between_rows = 0.5 * (panorama[1:] + panorama[:-1])
    return np.concatenate((panorama[:1], between_rows, panorama[-1:]))
