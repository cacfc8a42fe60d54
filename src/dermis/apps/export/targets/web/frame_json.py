"""Description of captured frames as the player reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dermis.apps.export.targets.web.packing import Bytes, Packer
from dermis.frame.features.post.picture import Picture
from dermis.gpu.capture import CapturedFrame, CapturedPass, FrameCapture

Json = dict[str, Any]
_TABLES = "triangle_table", "triangle_buffer"


@dataclass(frozen=True)
class NamedFrame:
    """A captured frame with its name and picture.

    picture : what it fills
    fewer : of a frame that is drawn while hands move, how many coarse hairs became one; else 0
    """

    name: str
    captured: CapturedFrame
    picture: Picture
    size: tuple[int, int]
    merged_hairs: int = 0


class PictureMap(NamedTuple):
    """A map whose first mips come as pictures.

    halving : passes that fill the other mips; None where these come as texels
    """

    role: str
    mips: int
    mip_passes: CapturedFrame | None


PictureMaps = dict[int, PictureMap]
QuantisedBuffers = dict[int, tuple[float, ...]]
"""Buffers of floats that are multiples of steps."""


def describe_frames(
    capture: FrameCapture,
    frames: list[NamedFrame],
    picture_maps: PictureMaps,
    steps: QuantisedBuffers,
    packer: Packer,
) -> Json:
    """Return the description of frames; the bytes that it names by number are in the packer.

    Resources of zeros, which new ones are, have no content.
    """
    pictures = [
        [capture.resource(one.picture.bytes), capture.resource(one.picture.exposed)] for one in frames
    ]
    contents, tables = {}, set(resources_bound_as(capture, [one.captured for one in frames], _TABLES))
    for number in read_before_written(capture, [one.captured for one in frames]):
        if number in steps:
            floats = capture.read_content(number)[0].view(np.float32).reshape(-1, len(steps[number]))
            contents[number] = [packer.add_floats(floats, steps[number])]
            continue
        _, pictured, mip_passes = picture_maps.get(number, PictureMap("", 0, None))
        mips = [] if mip_passes else _mips(capture, number)[pictured:]
        if any(one.any() for one in mips):
            add = packer.add if number not in tables else _in_parts(packer)
            contents[number] = [-1] * pictured + [add(one) for one in mips]
    return {
        "shaders": capture.shaders,
        "programs": [_program(one) for one in capture.programs],
        "resources": [_camel(one) for one in capture.resources],
        "structs": {name: _struct(dtype) for name, dtype in capture.structs.items()},
        "contents": contents,
        "frames": [_frame(one, k, packer) for one, k in zip(frames, pictures, strict=True)],
        "halved": {k: _passes(one.mip_passes, packer) for k, one in picture_maps.items() if one.mip_passes},
    }


def _in_parts(packer: Packer) -> Callable[[Bytes], int]:
    """Return a function that packs each of three columns, one below the other, its own way."""
    return lambda data: packer.add_parts(np.split(data, 3) if len(data) % 3 == 0 else [data])


def _mips(capture: FrameCapture, number: int) -> list[Bytes]:
    """Return a buffer's bytes, or a texture's mip by mip, each with all its layers."""
    parts, layers = capture.read_content(number), capture.resources[number].get("size")
    count = layers[2] if isinstance(layers, list) else 1
    return [np.concatenate(parts[k : k + count]) for k in range(0, len(parts), count)]


def _frame(one: NamedFrame, picture: list[int], packer: Packer) -> Json:
    records = [(struct, packer.add(record.tobytes())) for struct, record in one.captured.records]
    return {
        "name": one.name,
        "size": one.size,
        "moving": one.merged_hairs > 0,
        "picture": picture[0],
        "linear": picture[1],
        "views": {stage: _views(one.captured, stage) for stage in ("visibility", "shadows")},
        "passes": _passes(one.captured, packer),
        "records": records,
    }


def _views(captured: CapturedFrame, stage: str) -> int:
    """Return the record by which a stage's passes see the head, -1 for none."""
    views = [k for k, (struct, _) in enumerate(captured.records) if struct == "Views"]
    records = (-1 - k for one in captured.passes if one.stage == stage for k in one.bound if k < 0)
    return next((k for k in records if k in views), -1)


def _passes(captured: CapturedFrame, packer: Packer) -> list[Json]:
    """Return a frame's passes; a write of the host has its buffer and the number of its bytes."""
    hosts = ((one, one.written) for one in captured.passes)
    return [{**vars(one), "written": host and (host[0], packer.add(host[1]))} for one, host in hosts]


def _program(one: Json) -> Json:
    return {**one, "bindings": [(index, name, _camel(entry)) for index, name, entry in one["bindings"]]}


def _struct(dtype: np.dtype[Any]) -> Json:
    """Return its size, and of each member the offset and the number of floats [4 bytes]."""
    members = {name: _member(kind, offset) for name, (kind, offset, *_) in (dtype.fields or {}).items()}
    return {"size": dtype.itemsize, "members": members}


def _member(kind: np.dtype[Any], offset: int) -> list[int] | Json:
    base = kind.base
    if base.fields is None:
        return [offset // 4, kind.itemsize // 4]
    return {"offset": offset // 4, "each": base.itemsize // 4, "members": _struct(base)["members"]}


def _camel(value: object) -> object:
    """Return a description with names of members as WebGPU spells them."""
    if isinstance(value, dict):
        return {_spelt(name): _camel(one) for name, one in value.items()}
    return value


def _spelt(name: str) -> str:
    first, *others = name.split("_")
    return first + "".join(word.title() for word in others)


def read_before_written(capture: FrameCapture, captured_frames: list[CapturedFrame]) -> list[int]:
    """Return the numbers of textures and buffers that some pass reads before any writes it, in order."""
    found: set[int] = set()
    for captured in captured_frames:
        written: set[int] = set()
        for one in captured.passes:
            found |= {
                base_resource(capture, k)
                for k in read_resources(capture, one)
                if not _is_written(capture, k, written)
            }
            written |= set(written_resources(capture, one))
    return sorted(found)


def resources_bound_as(
    capture: FrameCapture, captured_frames: list[CapturedFrame], names: tuple[str, ...]
) -> dict[int, str]:
    """Return the resources that are bound by some names."""
    found: dict[int, str] = {}
    for captured in captured_frames:
        for one in (each for each in captured.passes if each.program is not None):
            known = [name for _, name, _ in capture.programs[one.program or 0]["bindings"]]
            found |= {k: name for k, name in zip(one.bound, known, strict=True) if name in names and k >= 0}
    return found


def base_resource(capture: FrameCapture, number: int) -> int:
    """Return the texture of a view; other resources themselves."""
    return int(capture.resources[number].get("of", number))


def read_resources(capture: FrameCapture, one: CapturedPass) -> Iterator[int]:
    """Yield the resources that a pass may read."""
    yield from (k for k, entry in _entries(capture, one) if _reads(entry))
    if one.raster and one.raster["indices"] >= 0:
        yield int(one.raster["indices"])


def written_resources(capture: FrameCapture, one: CapturedPass) -> Iterator[int]:
    """Yield the resources that a pass writes."""
    if one.written:
        yield one.written[0]
    yield from (k for k, entry in _entries(capture, one) if _writes(entry))
    if one.raster:
        yield from (int(one.raster[name]) for name in ("depth", "target") if one.raster[name] >= 0)


def _entries(capture: FrameCapture, one: CapturedPass) -> Iterator[tuple[int, Json]]:
    if one.program is not None:
        bindings = capture.programs[one.program]["bindings"]
        yield from ((k, entry) for k, (_, _, entry) in zip(one.bound, bindings, strict=True) if k >= 0)


def _reads(entry: Json) -> bool:
    return "sampler" not in entry and entry.get("storage_texture", {}).get("access") != "write-only"


def _writes(entry: Json) -> bool:
    return "storage_texture" in entry or entry.get("buffer") == {"type": "storage"}


def _is_written(capture: FrameCapture, number: int, written: set[int]) -> bool:
    """Return whether a pass has written a resource, or any part of it."""
    return any(base_resource(capture, k) == base_resource(capture, number) for k in written)
