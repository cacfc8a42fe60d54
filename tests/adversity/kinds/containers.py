"""Heads in other containers: avatars, compressed geometry, USD and STL."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from adversity.case import Input, Plan
from adversity.damage import damaged
from adversity.glb import split_glb
from adversity.kind import Kind
from adversity.kinds.meshes import take_head
from adversity.lines import changed_lines, encoded
from adversity.raw import changed_bytes
from draco_file import DracoFile
from stl_file import write_stl
from usd_file import material, mesh, stage, write_usd
from vrm_file import VrmFile

_PICTURE = "skin.png"


def _plan(name: str) -> Plan:
    return {"file": name, "words": [name]}


@cache
def _avatars() -> tuple[bytes, ...]:
    """Return avatars of both versions with expressions."""
    found = []
    with TemporaryDirectory() as folder:
        for version in (0, 1):
            avatar = VrmFile(version)
            avatar.add_expression("happy", {0: 1.0, 1: 0.5})
            avatar.add_expression("mine", {1: 0.5}, custom=True)
            avatar.avatar["firstPerson"] = {}
            found.append(avatar.write(Path(folder) / "a.vrm").read_bytes())
    return tuple(found)


def _avatar(rng: Random) -> Input:
    return Input({"head.vrm": rng.choice(_avatars())}, _plan("head.vrm"))


@cache
def _compressed_heads() -> tuple[bytes, ...]:
    with TemporaryDirectory() as folder:
        files = DracoFile(coloured=True), DracoFile(skinned=True)
        return tuple(one.write(Path(folder) / "a.glb").read_bytes() for one in files)


def _compressed(rng: Random) -> Input:
    return Input({"head.glb": rng.choice(_compressed_heads())}, _plan("head.glb"))


def _damage_compressed(sound: Input, rng: Random) -> Input:
    """Damage the compressed data half of the time, which are at the start of the buffer."""
    data = sound.files["head.glb"]
    if rng.random() < 0.5:
        return damaged(sound, rng)
    binary = split_glb(data)[1]
    return Input({"head.glb": data[: -len(binary)] + changed_bytes(binary, rng)[: len(binary)]}, sound.plan)


@cache
def _stages() -> dict[str, dict[str, bytes]]:
    """Return the files of a scene by the suffix of its root layer."""
    inputs = "float inputs:roughness = 0.3\ncolor3f inputs:emissiveColor = (0, 0.1, 0)"
    subset = """def GeomSubset "lower" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [0, 1, 2, 3]
        rel material:binding = </model/shirt>
    }"""
    text = stage(mesh(more=subset), material(inputs=inputs), material("shirt"))
    found = {}
    with TemporaryDirectory() as folder:
        for suffix in ("usda", "usdc", "usdz"):
            path = write_usd(Path(folder) / f"head.{suffix}", text)
            found[suffix] = {path.name: path.read_bytes(), _PICTURE: path.with_name(_PICTURE).read_bytes()}
    return found


def _stage(rng: Random) -> Input:
    suffix = rng.choice(("usda", "usda", "usdc", "usdz"))
    return Input(_stages()[suffix], _plan(f"head.{suffix}"), (f"head.{suffix}",))


def _damage_stage(sound: Input, rng: Random) -> Input:
    """Damage lines of text layers, layers in packages, or bytes."""
    (name,) = sound.changed
    data = sound.files[name]
    if name.endswith(".usda") and rng.random() < 0.8:
        changed = encoded(changed_lines(data.decode(), rng, rare=rng.random() < 0.7))
    elif name.endswith(".usdz") and rng.random() < 0.6:
        changed = _damaged_package(data, rng)
    else:
        changed = changed_bytes(data, rng)
    return Input({**sound.files, name: changed}, sound.plan)


def _damaged_package(data: bytes, rng: Random) -> bytes:
    """Return a package with a damaged or renamed entry."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as package, zipfile.ZipFile(made, "w") as other:
        names = package.namelist()
        chosen, renamed = rng.choice(names), rng.random() < 0.3
        for name in names:
            content = package.read(name)
            if name == chosen and not renamed:
                content = changed_bytes(content, rng)
            hostile = rng.choice(("../a.usda", "/a.usda", "a", "a.usdz", "\0.usda"))
            other.writestr(hostile if name == chosen and renamed else name, content)
    return made.getvalue()


@cache
def _stl_heads() -> tuple[bytes, ...]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "head.stl"
        return tuple(write_stl(path, text=text).read_bytes() for text in (False, True))


def _stl(rng: Random) -> Input:
    return Input({"head.stl": rng.choice(_stl_heads())}, _plan("head.stl"))


def _damage_stl(sound: Input, rng: Random) -> Input:
    data = sound.files["head.stl"]
    if data[:5] == b"solid" and rng.random() < 0.8:
        return Input({"head.stl": encoded(changed_lines(data.decode(), rng))}, sound.plan)
    return Input({"head.stl": changed_bytes(data, rng)}, sound.plan)


KINDS = (
    Kind("vrm", _avatar, take_head, share=6),
    Kind("draco", _compressed, take_head, _damage_compressed, share=6, warmed=2),
    Kind("usd", _stage, take_head, _damage_stage, share=8, warmed=4),
    Kind("stl", _stl, take_head, _damage_stl, share=5),
)
