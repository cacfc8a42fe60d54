"""Uniform record of the shading pass: camera rays, sample positions, all materials, and poses of the eyes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.surface.record import DEFAULT_COLOUR, fill_eye_records
from dermis.frame.projection import (
    Axes,
    Triple,
    Views,
    depth_range,
    perspective_rows,
    pixel_sample_positions,
    vector_between,
    view_axes,
    view_rows,
    world_position,
)
from dermis.frame.technique import ProfileSplit
from dermis.gpu import ComputeProgram, UniformRecord
from dermis.human.living.zones import eye_redness
from dermis.mesh.fabric import WEAVES
from dermis.mesh.head import Head
from dermis.mesh.mesh import MOUTH_PARTS, Mesh
from dermis.mesh.outline import Outline
from dermis.optics.bands import Bands
from dermis.scene.camera import Camera, ImageRectangle
from dermis.scene.living import SkinState
from dermis.scene.settings import Settings
from dermis.scene.skin import MAX_OTHER_PROFILES

_MAX_MATERIALS = 64
_WET_MATERIAL_MARKER = -1.0  # roughness of plain materials, see parts.wgsl
# Factors of light from below the surface and of reflected light, by `Settings.parts` and `.polarisation`.
_LIGHT_FACTORS = {"all": (1.0, 1.0), "diffuse": (1.0, 0.0), "specular": (0.0, 1.0)}
_POLARISER_FACTORS = {None: (1.0, 1.0), "parallel": (0.5, 1.0), "cross": (0.5, 0.0)}
_CAMERA_RAY_MEMBERS = ("eye", "forward", "right", "up", "shift")


class Pinhole(NamedTuple):
    """Pinhole camera in world space.

    eye : position of the pinhole [mm]
    axes : unit vectors to the right, up and forward
    image_rectangle : half extents and centre of the picture on the image plane at distance 1
    """

    eye: Triple
    axes: Axes
    image_rectangle: ImageRectangle


class EyePoses(NamedTuple):
    """Poses of the modelled eyes of a head.

    frames : (2, 4, 4) matrices from the space of the head to the space of each of the two eyes
    edges_mm : (2, r, 3) points along the eyelid edges of each eye [mm]; None if they are unknown, as for
        heads from files
    """

    frames: NDArray[np.float64]
    edges_mm: NDArray[np.float64] | None


def world_space_pinhole(camera: Camera, head: Head, settings: Settings) -> Pinhole:
    """Return the pinhole camera of a scene in world space, for the aspect ratio of the settings."""
    eye = world_position(camera.position, head.centre_mm)
    forward = vector_between(camera.position, camera.target)
    width, height = settings.size
    return Pinhole(eye, view_axes(forward, camera.up), camera.image_rectangle(width / height))


def camera_views(pinhole: Pinhole, outline: Outline, sample_count: int) -> Views:
    """Return the projection of a camera, and the positions of the samples within a pixel.

    sample_count : number of samples per pixel
    """
    rows = view_rows(pinhole.eye, pinhole.axes)
    clip = perspective_rows(rows, pinhole.image_rectangle, *depth_range(outline, rows))
    return Views(np.array([clip]), pixel_sample_positions(sample_count))


def view_record(
    shading_program: ComputeProgram,
    head: Head,
    settings: Settings,
    profile_split: ProfileSplit,
    bands: Bands | None = None,
) -> UniformRecord:
    """Return the uniform record of the struct Shade; `with_camera` adds the camera and the eye poses.

    profile_split : division of the diffusion profile into Gaussians that blur light over the atlas, and a
        narrower Gaussian that is evaluated at each pixel
    bands : wavelengths in the place of red, green and blue

    Raises DermisError for a head with too many materials.
    """
    jitter = np.zeros((64, 4), np.float32)
    jitter[: settings.samples, :2] = pixel_sample_positions(settings.samples)
    materials = head.mesh.materials
    record = shading_program.make_record(
        "Shade",
        samples=settings.samples,
        unblurred_weight=profile_split.unblurred_weight,
        unblurred_differences=np.pad(
            profile_split.unblurred_differences, ((0, MAX_OTHER_PROFILES - len(profile_split.others)), (0, 1))
        ),
        total=profile_split.total,
        light_factors=np.multiply(_LIGHT_FACTORS[settings.parts], _POLARISER_FACTORS[settings.polarisation]),
        material_colour=material_colours(head, bands),
        jitter=jitter,
    )
    for index, material in enumerate(materials):
        part = record["part_materials"][index]
        emission = material.emission if bands is None else bands.reflectance(material.emission)
        part["emission"], part["metalness"] = emission, material.metalness
        part["roughness"] = _WET_MATERIAL_MARKER if material.roughness is None else material.roughness
        part["has_maps"] = material.has_maps
        if (fabric := material.fabric) is not None:
            part["weave"], part["thread_mm"] = 1 + WEAVES.index(fabric.weave), fabric.thread_mm
            part["relief"], part["contrast"] = fabric.relief, fabric.contrast
            part["crumple"], part["sheen"] = fabric.crumple, fabric.sheen
    record["tongue"][:, :3] = tongue_coordinates(head.mesh)
    for name, value in profile_split.fine.items():
        record["fine"][name] = value
    if head.eyes is not None:
        fill_eye_records(record["eyes"], head.eyes.look)
        record["eyes"]["material"] = head.eyes.material
        record["eyes"]["middle_mm"] = head.eyes.centre_offset_mm
    return record


def material_colours(head: Head, bands: Bands | None = None) -> NDArray[np.float32]:
    """Return the albedos of a head's materials as rows (64, 4); the last column is the part of the mouth.

    bands : wavelengths in the place of red, green and blue

    Raises DermisError for a head with too many materials.
    """
    colours = np.zeros((_MAX_MATERIALS, 4), np.float32)
    materials = head.mesh.materials
    if len(materials) > _MAX_MATERIALS:
        count = f"it has {len(materials)}"
        refuse(head.name, f"at most {_MAX_MATERIALS} materials", count, "Join some groups")
    for index, material in enumerate(materials):
        colours[index, :3] = material.colour
        colours[index, 3] = 1 + MOUTH_PARTS.index(material.part) if material.part else 0
    if bands is not None:
        colours[:, :3] = bands.reflectance(colours[:, :3])
    return colours


def mean_skin_albedo(head: Head) -> tuple[float, ...]:
    """Return the mean RGB albedo of the colour map, or a default albedo if there is no map [-]."""
    colour = head.maps.mean_colour
    return (DEFAULT_COLOUR,) * 3 if colour is None else tuple(colour.tolist())


def with_camera(shade_record: UniformRecord, pinhole: Pinhole, eyes: EyePoses | None) -> UniformRecord:
    """Return a copy of a Shade record with camera rays and the poses of the eyes.

    shade_record : result of `view_record`
    eyes : poses of modelled eyes, None for a head without such eyes
    """
    eye, (right, up, forward), (half, shift) = pinhole
    # A copy of the bytes: NumPy copies structs member by member and leaves the padding undefined.
    record: UniformRecord = np.ndarray((), shade_record.dtype, bytearray(shade_record.tobytes()))
    record["eye"], record["forward"] = eye, forward
    record["right"], record["up"] = tuple(half[0] * c for c in right), tuple(half[1] * c for c in up)
    record["shift"] = shift
    if eyes is not None:
        record["eyes"]["to_own"] = eyes.frames.transpose(0, 2, 1)  # by columns
    if eyes is not None and eyes.edges_mm is not None:
        edges = eyes.edges_mm
        a, b, c = (np.roll(edges, -k, axis=1) for k in (-1, 1, 2))
        # A point of a smooth curve is added between each two points.
        points = np.stack([edges, (9.0 * (edges + b) - a - c) / 16.0], axis=2).reshape(2, -1, 3)
        homogeneous = np.concatenate([points, np.ones((*points.shape[:2], 1))], axis=-1)
        record["lids"] = np.einsum("kij,krj->kri", eyes.frames, homogeneous).reshape(-1, 4)
    return record


def with_mouth(shade_record: UniformRecord, mouth_edge_mm: NDArray[np.float64] | None) -> UniformRecord:
    """Return a Shade record with the opening between the lips.

    shade_record : result of `with_camera`, which is changed
    mouth_edge_mm : (r + 1, 3) result of `Rig.mouth_edge_mm` [mm]; None for unknown lips
    """
    if mouth_edge_mm is not None:
        lips, biting_edge = mouth_edge_mm[:-1], mouth_edge_mm[-1]
        area = np.cross(lips, np.roll(lips, -1, axis=0)).sum(axis=0) / 2.0
        across = lips[len(lips) // 2] - lips[0]
        below = (biting_edge - lips[0]) @ across / max(across @ across, 1e-6)
        shade_record["lips"][:, :3] = lips
        shade_record["lips"][:, 3] = np.linalg.norm(area)
        shade_record["teeth_below_lip"] = min(max(below, 0.0), 1.0) * across
    return shade_record


def tongue_coordinates(mesh: Mesh) -> NDArray[np.float64]:
    """Return the matrix (2, 3) from (u, v, 1) to positions on the tongue [mm].

    The positions are the distance from the midline towards +X and the distance behind the tip, by a
    least-squares fit to the mesh. The result is zeros for a mesh without a tongue.
    """
    is_tongue = np.array([one.part == "tongue" for one in mesh.materials])[mesh.material]
    if not is_tongue.any():
        return np.zeros((2, 3))
    vertices = np.unique(mesh.triangles[is_tongue])
    x, _, z = mesh.positions[vertices].astype(np.float64).T
    known = np.column_stack([mesh.uv[vertices].astype(np.float64), np.ones(len(vertices))])
    across, behind = x - 0.5 * (x.min() + x.max()), z.max() - z
    return np.asarray(np.linalg.lstsq(known, np.column_stack([across, behind]), rcond=None)[0].T)


def with_redness(shade_record: UniformRecord, head: Head, skin_state: SkinState | None) -> UniformRecord:
    """Return a Shade record in which states of the skin redden the white of the eyes.

    shade_record : result of `with_camera`, which is changed
    """
    redness = eye_redness(skin_state.weights) if skin_state else 0.0
    if redness and head.eyes is not None:
        shade_record["eyes"]["redness"] = min(head.eyes.look.redness + redness, 1.0)
    return shade_record


def ray_record(shader: ComputeProgram, shade_record: UniformRecord) -> UniformRecord:
    """Return a record of the struct Rays, for shaders that need only the camera rays of a Shade record."""
    return shader.make_record("Rays", **{name: shade_record[name] for name in _CAMERA_RAY_MEMBERS})
