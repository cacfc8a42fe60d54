"""Heads: OBJ with materials and maps, PLY, glTF with targets, skins, instances and pictures."""

from __future__ import annotations

import base64
import json
import re
import struct
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from adversity.case import Input, Plan
from adversity.checks import check_finite
from adversity.glb import joined_glb, split_glb
from adversity.kind import Kind
from adversity.kinds.pictures import picture_bytes
from encoded_glb import encode_glb
from moving_head import write_moving_head
from ply_file import ORDERS, ply_bytes
from rigged_head import write_rigged_head
from small_head import SIZE, obj_text

from dermis.mesh.primitives import uv_sphere

_MTL = """newmtl skin
Kd 0.8 0.6 0.5
map_Kd -s 1 1 1 skin.png
map_Bump -bm 0.02 height.png
map_Ks grey.png
norm normal.png
newmtl eye_L
Kd 1 1 1
"""
_MAPS = {
    "skin.png": "rgb8.png",
    "height.png": "grey16.png",
    "grey.png": "grey8.png",
    "normal.png": "normal.png",
}
_INSTANCES, _APART_M = 30, 0.09


@cache
def head_files() -> Mapping[str, bytes]:
    """Return an OBJ head with its materials and maps, by name."""
    before, sign, faces = obj_text().partition("usemtl skin\n")
    lines = faces.splitlines()
    parts = [
        f"mtllib head.mtl\n{before}g face\n{sign.rstrip()}",
        *lines[:-4],
        "usemtl eye_L",
        *lines[-4:],
        "",
    ]
    pictures = {name: picture_bytes(kind) for name, kind in _MAPS.items()}
    return {"head.obj": "\n".join(parts).encode(), "head.mtl": _MTL.encode(), **pictures}


@cache
def _varied_obj() -> bytes:
    """Return the OBJ head with a byte order mark, relative indices, colours, polypaint, curves and lines."""
    lines = head_files()["head.obj"].decode().splitlines()
    places, uv, faces = ([line for line in lines if line.startswith(key)] for key in ("v ", "vt", "f"))
    mixed = re.sub(r"/\d+$", "//", faces[0])
    relative = [
        re.sub(r"\d+", lambda one: str(int(one[0]) - len(places) - 1), face) for face in [mixed, *faces[1:]]
    ]
    more = [
        "o head",
        "s off",
        "#MRGB " + "ff804020" * len(places),
        "vp 0.5",
        "curv 0 1 -1 -2",
        "l 1 2 \\",
        " 3",
    ]
    rows = [*(f"{place} 0.5 0.25 1" for place in places), *uv, *more, "usemtl skin", *relative]
    return "\r\n".join(["\ufeffmtllib head.mtl", *rows, ""]).encode()


def _obj(rng: Random) -> Input:
    changed = ("head.obj",) * 4 + ("head.mtl",) * 2 + tuple(_MAPS)
    varied = {"head.obj": _varied_obj()} if rng.random() < 0.5 else {}
    return Input({**head_files(), **varied}, _plan("head.obj"), changed)


@cache
def _ply_text() -> str:
    ball = uv_sphere(0.5, 24, 12)
    kinds = "\n".join(f"property float {name}" for name in ("x", "y", "z", "s", "t"))
    points = np.hstack([ball.positions * SIZE, ball.uv]).tolist()
    rows = [" ".join(f"{one:.6g}" for one in row) for row in points]
    faces = [f"3 {a} {b} {c}" for a, b, c in ball.triangles]
    head = f"ply\nformat ascii 1.0\ncomment a head\nelement vertex {len(rows)}\n{kinds}\n"
    lists = f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header"
    return "\n".join([head + lists, *rows, *faces, ""])


@cache
def _ply_binary() -> bytes:
    head, _, body = _ply_text().partition("end_header\n")
    rows = [line.split() for line in body.splitlines()]
    points = np.array([row for row in rows if len(row) == 5], "<f4").tobytes()
    faces = b"".join(struct.pack("<Biii", *map(int, row)) for row in rows if len(row) == 4)
    return head.replace("ascii", "binary_little_endian").encode() + b"end_header\n" + points + faces


@cache
def _varied_ply(order: str) -> bytes:
    """Return the PLY head with uv of corners, colours, a picture, strips and lists of several lengths."""
    ball = uv_sphere(0.5, 24, 12)
    wedges = ball.uv[ball.triangles].reshape(-1, 6).tolist()
    places = [(*place, 200, 150, 120, 255) for place in (ball.positions * SIZE).tolist()]
    faces = [
        ([*face], 0, uv if face[0] % 5 else [])
        for face, uv in zip(ball.triangles.tolist(), wedges, strict=True)
    ]
    colours = "uchar red, uchar green, uchar blue, uchar alpha"
    elements = {
        "vertex": (f"double x, double y, double z, {colours}", places),
        "face": ("list uchar int vertex_index, int texnumber, list uchar float texcoord", faces),
        "tristrips": ("list int int vertex_indices", [([0, 1, 25, -1],)]),
    }
    return ply_bytes(elements, order, ["TextureFile gone.png"])


def _ply(rng: Random) -> Input:
    data = rng.choice((_ply_text().encode(), _ply_binary(), *map(_varied_ply, ORDERS)))
    return Input({"head.ply": data}, _plan("head.ply"))


@cache
def moving_files() -> tuple[bytes, bytes]:
    """Return two .glb heads: with clips, targets and a bone; with sparse targets and two bones."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "head.glb"
        return write_moving_head(path, clips=2).read_bytes(), write_rigged_head(path).read_bytes()


@cache
def _gltf_heads() -> tuple[bytes, ...]:
    """Return .glb files: moving ones, one with pictures, and one with many instances of its mesh."""
    with TemporaryDirectory() as folder:
        Input(head_files(), {}).write(Path(folder))
        pictured = _with_pictures(Path(folder) / "head.obj")
    tree, binary = split_glb(pictured)
    tree["nodes"] = [
        {"mesh": 0, "scale": [1e-3] * 3, "translation": [_APART_M * k, 0, 0]} for k in range(_INSTANCES)
    ]
    tree["scenes"] = [{"nodes": list(range(_INSTANCES))}]
    return *moving_files(), pictured, joined_glb(json.dumps(tree).encode(), binary)


def _with_pictures(path: Path) -> bytes:
    from loaded_mesh import load_mesh

    pictures = {name: picture_bytes(kind) for name, kind in _MAPS.items()}
    surface = {"baseColorTexture": {"index": "skin.png"}, "baseColorFactor": [1, 1, 1, 1]}
    material = {"name": "skin", "pbrMetallicRoughness": surface, "normalTexture": {"index": "normal.png"}}
    roles = {"height": {"index": "height.png"}, "height_mm": 0.02, "roughness": {"index": "grey.png"}}
    return encode_glb(load_mesh(path), pictures, material, roles)


def _gltf(rng: Random) -> Input:
    data = rng.choice(_gltf_heads())
    if rng.random() < 0.7:
        return Input({"head.glb": data}, _plan("head.glb"))
    tree, binary = split_glb(data)
    if rng.random() < 0.5:
        tree["buffers"][0]["uri"] = "head.bin"
        return Input({"head.gltf": json.dumps(tree).encode(), "head.bin": binary}, _plan("head.gltf"))
    within = base64.b64encode(binary).decode()
    tree["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{within}"
    return Input({"head.gltf": json.dumps(tree).encode()}, _plan("head.gltf"))


def _plan(name: str) -> Plan:
    return {"file": name, "words": [name]}


def take_head(plan: Plan) -> Any:
    """Load the head of a file with its maps and motions."""
    from dermis.mesh.pose import Pose
    from dermis.scene.heads import load_head

    head = load_head(plan["file"])
    check_finite((head.mesh, head.maps, head.rig), "head")
    if head.targets:
        check_finite(Pose(dict.fromkeys(head.targets, 1.0)).to_arrays(head.control_rig), "pose")
    return head


KINDS = (
    Kind("obj", _obj, take_head, share=14),
    Kind("ply", _ply, take_head, share=8),
    Kind("gltf", _gltf, take_head, share=20),
)
