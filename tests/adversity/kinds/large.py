"""Valid files of the largest sizes: read or refused within the time and memory of small ones."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
from adversity.case import Input, Plan
from adversity.glb import joined_glb, split_glb
from adversity.kind import Kind
from adversity.kinds import clips, meshes, pictures, scenes

_SIDE = 16384  # texels, the most that a map may have
_MANY = 20_000
_ROWS = 1_000_000


def _png(channels: int) -> bytes:
    """Return a black PNG, compressed to a thousandth of its size."""
    packer, row = zlib.compressobj(1), bytes(1 + _SIDE * channels)
    packed = b"".join([*(packer.compress(row) for _ in range(_SIDE)), packer.flush()])
    head = struct.pack(">IIBBBBB", _SIDE, _SIDE, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", packed), (b"IEND", b""))
    whole = (struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts)
    return b"\x89PNG\r\n\x1a\n" + b"".join(whole)


def _exr() -> bytes:
    """Return a grey EXR of halves with run-length coding."""
    import OpenEXR

    side = _SIDE // 2
    how = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.scanlineimage}
    with TemporaryDirectory() as folder:
        OpenEXR.File(how, {"Y": np.ones((side, 2 * side), np.float16)}).write(f"{folder}/sky.exr")
        return (Path(folder) / "sky.exr").read_bytes()


def _obj() -> bytes:
    return meshes.head_files()["head.obj"] + b"v 0 0 0\n" * (4 * _ROWS)


def _grouped_obj() -> bytes:
    groups = "\n".join(f"g part{k}\nf 1/1 2/2 3/3" for k in range(_MANY))
    return meshes.head_files()["head.obj"] + groups.encode()


def _spaced_obj() -> bytes:
    return meshes.head_files()["head.obj"] + b"".join(
        word + b" " * 60_000 + b"x\n" for word in (b"g", b"mtllib")
    )


def _instances() -> bytes:
    tree, binary = split_glb(meshes.moving_files()[0])
    (face,) = (node for node in tree["nodes"] if "mesh" in node)
    tree["nodes"] += [{"mesh": face["mesh"], "translation": [0.2 * k, 0, 0]} for k in range(_MANY)]
    tree["scenes"] = [{"nodes": list(range(len(tree["nodes"])))}]
    return joined_glb(json.dumps(tree).encode(), binary)


def _chain() -> bytes:
    """Return a glTF file with a chain of nodes."""
    tree, binary = split_glb(meshes.moving_files()[0])
    first = len(tree["nodes"])
    tree["nodes"] += [{"children": [first + k + 1]} for k in range(_MANY)] + [{}]
    tree["scenes"][0]["nodes"].append(first)
    return joined_glb(json.dumps(tree).encode(), binary)


def _zeros() -> bytes:
    """Return a glTF file that declares targets without data."""
    tree, binary = split_glb(meshes.moving_files()[0])
    count = tree["accessors"][0]["count"]
    primitive = next(mesh for mesh in tree["meshes"])["primitives"][0]
    tree["accessors"].append({"count": count, "type": "VEC3", "componentType": 5126})
    primitive["targets"] = [{"POSITION": len(tree["accessors"]) - 1}] * _MANY
    return joined_glb(json.dumps(tree).encode(), binary)


def _dotted() -> bytes:
    return b".".join([b"a"] * 50_000) + b" = 1\n"


def _lines(name: str) -> bytes:
    """Return a capture whose last line is repeated."""
    rows = clips.files_of_motions()[name][name].strip().split(b"\n")
    return b"\n".join(rows + rows[-1:] * (60_000_000 // len(rows[-1])))


def _lights() -> bytes:
    return b'[[lights]]\nkind = "point"\nposition = [0, 0, 900]\nirradiance = [1, 1, 1]\n' * _MANY


_LARGE: Mapping[str, tuple[str, Callable[[], bytes]]] = {
    "grey map": ("grey8.png", lambda: _png(1)),
    "colour map": ("rgb8.png", lambda: _png(3)),
    "panorama": ("sky.hdr", lambda: pictures.hdr_bytes(_SIDE // 2, _SIDE, coded=True)),
    "panorama in halves": ("sky.exr", _exr),
    "vertices": ("head.obj", _obj),
    "groups": ("head.obj", _grouped_obj),
    "spaces": ("head.obj", _spaced_obj),
    "instances": ("head.glb", _instances),
    "chain of nodes": ("head.glb", _chain),
    "targets": ("head.glb", _zeros),
    "dotted key": ("scene.toml", _dotted),
    "many lights": ("lights.toml", _lights),
    "Live Link": ("take.csv", lambda: _lines("take.csv")),
    "MediaPipe": ("take.jsonl", lambda: _lines("take.jsonl")),
}
_BY_NAME = {kind.name: kind for part in (meshes, pictures, scenes, clips) for kind in part.KINDS}
_TAKEN_AS = {
    "grey8.png": ("picture", {"role": "roughness"}),
    "rgb8.png": ("picture", {"role": "colour"}),
    "sky.hdr": ("panorama", {}),
    "sky.exr": ("panorama", {}),
    "head.obj": ("obj", {}),
    "head.glb": ("gltf", {}),
    "scene.toml": ("scene", {}),
    "lights.toml": ("lights", {}),
    "take.csv": ("clip", {"head": "head.glb"}),
    "take.jsonl": ("clip", {"head": "head.glb"}),
}


@cache
def _made(which: str) -> bytes:
    return _LARGE[which][1]()


def _sound(rng: Random) -> Input:
    """Return a small file of the kind, to be replaced."""
    which = rng.choice(tuple(_LARGE))
    name = _LARGE[which][0]
    kind, more = _TAKEN_AS[name]
    plan = {"file": name, "kind": kind, "which": which, **more}
    small = pictures.picture_bytes(name) if kind in ("picture", "panorama") else _small(name)
    return Input({name: small}, plan)


def _small(name: str) -> bytes:
    found = {"head.glb": meshes.moving_files()[0], **meshes.head_files(), **scenes.files_of_scenes()}
    motions = {motion: files[motion] for motion, files in clips.files_of_motions().items() if motion in files}
    return (found | motions | {"scene.toml": b'[head]\nname = "human"\n'})[name]


def _grown(sound: Input, rng: Random) -> Input:
    return replace(sound, files={sound.plan["file"]: _made(sound.plan["which"])})


def _take(plan: Plan) -> None:
    _BY_NAME[plan["kind"]].take(plan)


KINDS = (Kind("large", _sound, _take, _grown, share=2),)
