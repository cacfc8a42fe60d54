"""Example files like those that other programs write: an avatar with hair cards, and two scans."""

from __future__ import annotations

import gzip
import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from dermis.apps.gallery.studio import Studio
from dermis.base.arrays import Bytes, Doubles, Index, Mask, Numbers
from dermis.formats.gltf.binary import BufferBuilder, glb_bytes
from dermis.formats.gltf.write import encode_head
from dermis.frame.features.surface.painting.painted_head import paint_head
from dermis.human.person import Human
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.head import Head
from dermis.mesh.strands import Roots, root_frames

_MESH_FOLDER = Path(__file__).parent / "meshes"
_SWEATER_STRIPE_MM, _SWEATER_STITCH_MM = (
    22.0,
    2.6,
)  # period of the sweater's stripes, and size of its stitches
_HAIR_CARD_COUNT, _HAIR_KNOT_COUNT, _HAIR_LENGTH_MM = 2600, 20, 230.0  # cards, points along each, and length
_HAIR_PARTING_X_MM, _MIN_EAR_X_MM, _SURFACE_NEIGHBOUR_COUNT = 15.0, 70.0, 40
_HAIR_CARD_COLUMNS = 8  # number of cards side by side in a picture of hairs


class _Surface(NamedTuple):
    """Mesh of one part of an avatar.

    points_mm : (v, 3) positions of the vertices [mm]
    normals : (v, 3) unit normals of the vertices
    uv : (v, 2) texture coordinates of the vertices
    triangles : (f, 3) vertex indices
    """

    points_mm: Numbers
    normals: Numbers
    uv: Numbers
    triangles: Index


class _Glb:
    """Contents of a .glb file, to which textured meshes can be added.

    encoded_glb : bytes of an existing file; empty for a new file
    """

    def __init__(self, encoded_glb: bytes = b"") -> None:
        lists = ("accessors", "bufferViews", "images", "materials", "meshes", "nodes", "textures")
        empty = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            **{key: [] for key in lists},
        }
        encoded_glb = encoded_glb or glb_bytes(empty, b"")
        length = struct.unpack_from("<I", encoded_glb, 12)[0]
        self._tree: dict[str, Any] = json.loads(encoded_glb[20 : 20 + length])
        views, accessors = self._tree["bufferViews"], self._tree["accessors"]
        self._buffer = BufferBuilder(bytearray(encoded_glb[28 + length :]), views, accessors)

    def add_mesh(self, mesh_name: str, surface: _Surface, picture: Bytes, roughness: float) -> None:
        """Add a mesh textured with a picture (h, w, 4); where alpha is low, the mesh is invisible."""
        add_rows = self._buffer.add_accessor
        attributes = {
            "POSITION": add_rows((surface.points_mm / 1000.0).astype("<f4"), with_bounds=True),
            "NORMAL": add_rows(surface.normals.astype("<f4")),
            "TEXCOORD_0": add_rows(surface.uv.astype("<f4")),
        }
        view = self._buffer.add_view(encode_png(picture))
        image = self._append_entry("images", bufferView=view, mimeType="image/png")
        texture = {"index": self._append_entry("textures", source=image)}
        model = {"baseColorTexture": texture, "metallicFactor": 0.0, "roughnessFactor": roughness}
        options = {"alphaMode": "MASK", "doubleSided": True}
        primitive = {
            "attributes": attributes,
            "indices": self._buffer.add_triangles(surface.triangles, len(surface.points_mm)),
            "material": self._append_entry(
                "materials", name=mesh_name, pbrMetallicRoughness=model, **options
            ),
        }
        mesh = self._append_entry("meshes", name=mesh_name, primitives=[primitive])
        self._tree["scenes"][0]["nodes"].append(self._append_entry("nodes", name=mesh_name, mesh=mesh))

    def write(self, path: Path) -> Path:
        """Write the file and return its path."""
        self._tree["buffers"] = [{"byteLength": len(self._buffer.data)}]
        path.write_bytes(glb_bytes(self._tree, self._buffer.data))
        return path

    def _append_entry(self, list_name: str, **json_entry: Any) -> int:
        """Append an entry to a list in the JSON of the file, and return the index of the entry.

        list_name : name of the list, such as "meshes"
        """
        self._tree[list_name].append(json_entry)
        return len(self._tree[list_name]) - 1


def write_avatar(studio: Studio, folder: Path) -> Path:
    """Write an avatar with a sweater and hair cards as a .glb file; return the path of the file.

    Hair, brows and lashes consist of hair cards: ribbons that each show a picture of several hairs.
    """
    plain = Human(sex=0.1, age=26).head()
    painted, eyes = paint_head(studio.renderer.device, plain, 1024)
    file = _Glb(encode_head(replace(painted, strands=None, hair=None), roughness=0.3, eyes=eyes))
    hair = _hair_card_picture((0.045, 0.022, 0.012), 26, (512, 1024), seed=1)
    file.add_mesh("hair", _hair_cards(*_scalp_hair_paths(plain), width_mm=7.0), hair, roughness=0.9)
    fringe = _hair_card_picture((0.02, 0.01, 0.006), 4, (128, 256), seed=2, taper_fraction=0.7)
    file.add_mesh("lashes", _hair_cards(*_brow_and_lash_paths(plain), width_mm=0.5), fringe, roughness=0.6)
    file.add_mesh("sweater", _sweater_surface(plain), _sweater_picture(), roughness=0.9)
    return file.write(folder / "avatar.glb")


def write_skin_as_three_meshes(head: Head, folder: Path) -> Path:
    """Write a head's skin as a .glb file with three meshes, each with its own part of the colour map.

    Returns the path of the file.
    """
    mesh, colour = head.mesh, _colour_map_srgb(head)
    file = _Glb()
    corner = mesh.triangles[_skin_triangle_mask(head)]
    middle = mesh.positions[corner].mean(axis=1)
    kind = np.where(middle[:, 1] < -110.0, "neck", np.where(middle[:, 2] > -60.0, "face", "ears"))
    size = np.array(colour.shape[1::-1])
    for name in ("face", "ears", "neck"):
        used, triangles = np.unique(corner[kind == name], return_inverse=True)
        low = np.floor(mesh.uv[used].min(axis=0) * size).astype(int)
        high = np.ceil(mesh.uv[used].max(axis=0) * size).astype(int)
        uv = (mesh.uv[used] * size - low) / (high - low)
        surface = _Surface(mesh.positions[used], mesh.normals[used], uv, triangles.reshape(-1, 3))
        picture = colour[low[1] : high[1], low[0] : high[0]]
        opaque = np.full((*picture.shape[:2], 1), 255, np.uint8)
        file.add_mesh(name, surface, np.concatenate([picture, opaque], axis=2), roughness=0.5)
    return file.write(folder / "three.glb")


def write_vertex_colours(head: Head, folder: Path) -> Path:
    """Write a head as a .ply file with vertex colours and no uv coordinates; return the path of the file."""
    mesh, colour = head.mesh, _colour_map_srgb(head)
    y, x = (mesh.uv[:, ::-1] * np.array(colour.shape[:2]) - 0.5).clip(0).astype(int).T
    kinds = [f"property float {axis}" for axis in "xyz"]
    kinds += [f"property uchar {channel}" for channel in ("red", "green", "blue")]
    header = ["ply", "format ascii 1.0", f"element vertex {len(mesh.positions)}", *kinds]
    header += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header"]
    vertices = np.column_stack([mesh.positions, colour[y, x]])
    rows = ["{:.4f} {:.4f} {:.4f} {:.0f} {:.0f} {:.0f}".format(*vertex) for vertex in vertices]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.triangles]
    path = folder / "scan.ply"
    path.write_text("\n".join([*header, *rows, ""]))
    return path


def unpack_mesh(mesh_name: str, folder: Path) -> Path:
    """Write the mesh of a hand or of a body as an .obj file; return the path of the file.

    mesh_name : "hand" or "body"
    """
    path = folder / f"{mesh_name}.obj"
    path.write_bytes(gzip.decompress((_MESH_FOLDER / f"{path.name}.gz").read_bytes()))
    return path


def _skin_triangle_mask(head: Head) -> Mask:
    """Return a mask (f,) of the triangles that are skin."""
    return np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]


def _colour_map_srgb(head: Head) -> Bytes:
    """Return the colour map (h, w, 3) of a head in 8-bit sRGB."""
    assert head.maps.colour is not None
    return encode_srgb8(head.maps.colour)


def _hair_cards(hair_paths: Doubles, outward_directions: Doubles, width_mm: float) -> _Surface:
    """Return hair cards: ribbons along paths, each of which shows a picture of several hairs.

    Each ribbon shows a randomly chosen column of the picture that `_hair_card_picture` returns.

    hair_paths : (n, k, 3) points of each path from root to tip [mm]
    outward_directions : (n, k, 3) outward directions at these points
    width_mm : width of the ribbons [mm]
    """
    count, knots = hair_paths.shape[:2]
    along = np.gradient(hair_paths, axis=1)
    side = _normalise(np.cross(along, outward_directions))
    normals = _normalise(np.cross(side, along))
    edges = np.stack([hair_paths - 0.5 * width_mm * side, hair_paths + 0.5 * width_mm * side], axis=2)
    column = np.random.default_rng(0).integers(_HAIR_CARD_COLUMNS, size=(count, 1))
    u = (column + np.array([0.02, 0.98])) / _HAIR_CARD_COLUMNS
    uv = np.stack(np.broadcast_arrays(u[:, None, :], np.linspace(0.01, 0.99, knots)[None, :, None]), axis=3)
    first = (np.arange(count)[:, None] * knots + np.arange(knots - 1)) * 2
    corners = [first, first + 1, first + 2, first + 2, first + 1, first + 3]
    triangles = np.stack(corners, axis=2).reshape(-1, 3)
    return _Surface(
        edges.reshape(-1, 3), np.repeat(normals, 2, axis=1).reshape(-1, 3), uv.reshape(-1, 2), triangles
    )


def _normalise(vectors: Doubles) -> Doubles:
    return np.asarray(vectors / (np.linalg.norm(vectors, axis=-1, keepdims=True) + 1e-9))


def _hair_card_picture(
    colour: tuple[float, float, float],
    hair_count: int,
    picture_size: tuple[int, int],
    seed: int,
    taper_fraction: float = 0.15,
) -> Bytes:
    """Return a picture (h, w, 4) with columns for different hair cards, each with hairs of different lengths.

    colour : mean colour of the hairs, linear Rec. 709
    hair_count : number of hairs in each hair card
    picture_size : height and width of the picture [pixel]
    taper_fraction : fraction of the picture's height over which a hair gets thinner towards its tip [-]
    """
    rng, (height, width) = np.random.default_rng(seed), picture_size
    picture = np.zeros((height, width, 4), np.uint8)
    picture[..., :3] = encode_srgb8(colour)
    card, y = width // _HAIR_CARD_COLUMNS, np.linspace(0.0, 1.0, height)
    x = np.arange(card)
    for column in range(_HAIR_CARD_COLUMNS):
        for _ in range(hair_count):
            middle, length = rng.uniform(0.06, 0.94) * card, rng.uniform(0.6, 1.0)
            bend, thickness = rng.normal(0.0, 0.05) * card, rng.uniform(0.7, 1.3) * card / hair_count
            tone = encode_srgb8(np.array(colour) * rng.lognormal(0.0, 0.25))
            half = 0.5 * thickness * np.clip((length - y) / taper_fraction, 0.0, 1.0)
            drawn = np.abs(x - middle - bend * np.sin(3.0 * y)[:, None]) < half[:, None]
            picture[:, column * card : (column + 1) * card][drawn] = (*tone, 255)
    return picture


def _covers_face(points_mm: Doubles) -> Mask:
    """Return a mask (n,) of the points that are in front of the face."""
    x, y, z = points_mm.T
    return np.asarray((np.abs(x) < 72.0) & (y < 60.0) & (y > -130.0) & (z > -45.0))


def _scalp_hair_paths(head: Head) -> tuple[Doubles, Doubles]:
    """Return the paths (n, k, 3) of long hair that falls from a parting, and outward directions (n, k, 3).

    Each path follows the surface of the head at a random distance from it, and gradually turns downwards.
    """
    assert head.hair is not None
    rng, mesh = np.random.default_rng(3), head.mesh
    roots = head.hair.roots.roots
    some = rng.permutation(len(roots.quad))[:_HAIR_CARD_COUNT]
    point = root_frames(mesh, Roots(roots.quad[some], roots.position[some]), mesh.points_mm)[0]
    skin = np.unique(mesh.triangles[mesh.material == 0])
    is_ear = (np.abs(mesh.positions[skin, 0]) > _MIN_EAR_X_MM) & (mesh.positions[skin, 1] > -100.0)
    skin = skin[~is_ear][::4]
    tree, step_mm = cKDTree(mesh.positions[skin]), _HAIR_LENGTH_MM / (_HAIR_KNOT_COUNT - 1)
    clearance_mm = rng.uniform(2.0, 11.0, len(point))
    side = np.where(point[:, 0] < _HAIR_PARTING_X_MM, -1.0, 1.0)
    front = np.clip((point[:, 2] + 90.0) / 90.0, 0.0, 1.0)
    course = np.column_stack([side, 0.1 + 0 * side, 0.25 - 1.1 * front]) + rng.normal(0.0, 0.06, point.shape)
    away = np.column_stack([side, 0 * side, -1.5 + 0 * side])
    paths, facings = [], []
    for knot in range(_HAIR_KNOT_COUNT):
        attachment = min(1.0, knot / 3.0)
        for neighbours in (
            _SURFACE_NEIGHBOUR_COUNT,
            1,
        ):  # a smooth surface that spans the ears; on top the skin itself
            nearest = skin[tree.query(point, np.arange(1, neighbours + 1))[1]]
            normal = _normalise(mesh.normals[nearest].mean(axis=1))
            height_mm = np.einsum("nc,nc->n", point - mesh.positions[nearest].mean(axis=1), normal)
            is_raised = (neighbours > 1) | (point[:, 1] > 35.0)
            lift_mm = np.where(is_raised, np.maximum(clearance_mm * attachment - height_mm, 0.0), 0.0)
            point = point + normal * lift_mm[:, None]
        paths.append(point)
        facings.append(normal)
        course = 0.7 * _normalise(course) + 0.3 * np.array([0.0, -1.0, 0.0])
        course += np.where(_covers_face(point), 0.25, 0.0)[:, None] * away
        outwards = np.einsum("nc,nc->n", course, normal)[:, None] * normal
        point = point + step_mm * _normalise(course - attachment * outwards)
    line, facing = np.stack(paths, axis=1), np.stack(facings, axis=1)
    smooth = np.clip(np.arange(_HAIR_KNOT_COUNT) / 4.0, 0.0, 1.0)[:, None]
    line += smooth * (gaussian_filter1d(line, 2.0, axis=1) - line)
    return line, gaussian_filter1d(facing, 2.0, axis=1)


def _brow_and_lash_paths(head: Head) -> tuple[Doubles, Doubles]:
    """Return the paths (n, k, 3) of every third brow and lash hair, and outward directions (n, k, 3)."""
    assert head.strands is not None
    paths = head.strands.knot_positions_mm(head.mesh, head.mesh.points_mm)[::3].astype(float)
    facing = paths[:, -1:] - paths[:, :1] + np.array([0.0, 0.0, 6.0])
    return paths, np.broadcast_to(facing, paths.shape)


def _sweater_surface(head: Head) -> _Surface:
    """Return the sweater: the surface of the shoulders and the neck, moved outwards."""
    mesh = head.mesh
    corner = mesh.triangles[mesh.material == 0]
    low = mesh.positions[corner][..., 1].max(axis=1) < -95.0
    used, triangles = np.unique(corner[low], return_inverse=True)
    points, normals = mesh.positions[used], mesh.normals[used]
    points = points + 5.0 * normals
    angle = np.arctan2(points[:, 0], points[:, 2] + 100.0)
    uv = np.column_stack([0.5 + angle / (2.0 * np.pi), (-90.0 - points[:, 1]) / 260.0])
    triangles = triangles.reshape(-1, 3)
    whole = np.ptp(uv[triangles, 0], axis=1) < 0.5
    return _Surface(points, normals, uv, triangles[whole])


def _sweater_picture(picture_size: tuple[int, int] = (1024, 2048)) -> Bytes:
    """Return a picture (h, w, 4) of striped knitwear, transparent where the neck shows."""
    y, x = np.mgrid[0 : picture_size[0], 0 : picture_size[1]] / np.array(picture_size).reshape(2, 1, 1)
    y_mm, angle = -90.0 - 260.0 * y, 2.0 * np.pi * (x - 0.5)
    neck_mm = -128.0 - 24.0 * np.maximum(np.cos(angle), 0.0)
    is_stripe = (np.mod(y_mm, _SWEATER_STRIPE_MM) < 0.35 * _SWEATER_STRIPE_MM) & (y_mm < -185.0)
    stitch = np.sin(2 * np.pi * y_mm / _SWEATER_STITCH_MM + 1.2 * np.abs(np.sin(angle * 160.0)))
    colour = np.where(is_stripe[..., None], (0.03, 0.05, 0.14), (0.62, 0.59, 0.52))
    colour *= 1 + 0.12 * stitch[..., None]
    return np.dstack([encode_srgb8(colour), np.where(y_mm < neck_mm, 255, 0).astype(np.uint8)])
