"""JSON description of captured frames, which the JavaScript player on the page reads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dermis.apps.export.targets.web.packing import ByteRunCollector, Bytes
from dermis.frame.features.post.picture import Picture
from dermis.gpu.capture import CapturedFrame, CapturedPass, FrameCapture

Json = dict[str, Any]
_TRIANGLE_TABLE_BINDINGS = "triangle_table", "triangle_buffer"


@dataclass(frozen=True)
class NamedFrame:
    """Captured frame with its name and output picture.

    name : technique of the frame
    captured : passes of the frame, and the uniform data that shaders read
    picture : output of the frame on the device
    size : width and height of the picture [pixel]
    merged_hairs : number of hairs drawn as one thicker hair during interaction; 0 at full quality
    """

    name: str
    captured: CapturedFrame
    picture: Picture
    size: tuple[int, int]
    merged_hairs: int = 0


class PictureMap(NamedTuple):
    """Map of the head, of which the first mip levels are stored as WebP images.

    role : name of the map's binding in shaders, such as "colour_map"
    mips : number of mip levels stored as WebP images
    mip_passes : passes that compute the remaining mip levels on the device; None if these levels are stored
        as texels
    """

    role: str
    mips: int
    mip_passes: CapturedFrame | None


Frames = list[CapturedFrame]
PictureMaps = dict[int, PictureMap]


def frames_json(
    frame_capture: FrameCapture,
    named_frames: list[NamedFrame],
    picture_maps: PictureMaps,
    quantisation_steps: dict[int, tuple[float, ...]],
    byte_runs: ByteRunCollector,
) -> Json:
    """Return captured frames as JSON (shaders, resources and passes); add their data to `byte_runs`.

    Data that is all zero is not stored, as the page creates resources filled with zeros.

    picture_maps : dictionary from resource index to map, for the maps that are stored as WebP images
    quantisation_steps : dictionary from resource index to rounding steps, for the buffers that hold rounded
        vectors; one step per vector component
    byte_runs : collector of buffer and texture data, to which the JSON refers by index
    """
    pictures = [
        [frame_capture.index_of_resource(f.picture.bytes), frame_capture.index_of_resource(f.picture.exposed)]
        for f in named_frames
    ]
    captured_frames = [frame.captured for frame in named_frames]
    contents, tables = {}, set(resources_bound_as(frame_capture, captured_frames, _TRIANGLE_TABLE_BINDINGS))
    for index in resources_read_before_write(frame_capture, captured_frames):
        if index in quantisation_steps:
            floats = (
                frame_capture.read_content(index)[0]
                .view(np.float32)
                .reshape(-1, len(quantisation_steps[index]))
            )
            contents[index] = [byte_runs.add_floats(floats, quantisation_steps[index])]
            continue
        _, picture_count, mip_passes = picture_maps.get(index, PictureMap("", 0, None))
        mips = [] if mip_passes else _mip_bytes(frame_capture, index)[picture_count:]
        if any(one.any() for one in mips):
            add = byte_runs.add if index not in tables else _triangle_column_packer(byte_runs)
            contents[index] = [-1] * picture_count + [add(one) for one in mips]
    return {
        "shaders": frame_capture.shaders,
        "programs": [_program_json(one) for one in frame_capture.programs],
        "resources": [_with_camel_case_keys(one) for one in frame_capture.resources],
        "structs": {name: _struct_json(dtype) for name, dtype in frame_capture.structs.items()},
        "contents": contents,
        "frames": [_frame_json(one, k, byte_runs) for one, k in zip(named_frames, pictures, strict=True)],
        "halved": {k: _passes_json(m.mip_passes, byte_runs) for k, m in picture_maps.items() if m.mip_passes},
    }


def _triangle_column_packer(byte_runs: ByteRunCollector) -> Callable[[Bytes], int]:
    """Return a function that adds a buffer of triangle data to `byte_runs`, and returns the run's index.

    The buffer contains three columns of equal length, one after another. Each column is packed separately.
    """
    return lambda data: byte_runs.add_parts(np.split(data, 3) if len(data) % 3 == 0 else [data])


def _mip_bytes(frame_capture: FrameCapture, resource_index: int) -> list[Bytes]:
    """Return the bytes of each mip level of a texture, with all layers of the level joined.

    The bytes of a buffer are returned as a single level.

    resource_index : index of the texture or buffer in the capture
    """
    parts, layers = (
        frame_capture.read_content(resource_index),
        frame_capture.resources[resource_index].get("size"),
    )
    count = layers[2] if isinstance(layers, list) else 1
    return [np.concatenate(parts[k : k + count]) for k in range(0, len(parts), count)]


def _frame_json(named_frame: NamedFrame, picture_entry: list[int], byte_runs: ByteRunCollector) -> Json:
    records = [(struct, byte_runs.add(record.tobytes())) for struct, record in named_frame.captured.records]
    return {
        "name": named_frame.name,
        "size": named_frame.size,
        "moving": named_frame.merged_hairs > 0,
        "picture": picture_entry[0],
        "linear": picture_entry[1],
        "views": {
            stage: _view_record_index(named_frame.captured, stage) for stage in ("visibility", "shadows")
        },
        "passes": _passes_json(named_frame.captured, byte_runs),
        "records": records,
    }


def _view_record_index(captured_frame: CapturedFrame, stage_name: str) -> int:
    """Return the index, in `captured_frame.records`, of a stage's view matrices; -1 if there are none.

    stage_name : "visibility" or "shadows"
    """
    views = [k for k, (struct, _) in enumerate(captured_frame.records) if struct == "Views"]
    records = (-1 - k for one in captured_frame.passes if one.stage == stage_name for k in one.bound if k < 0)
    return next((k for k in records if k in views), -1)


def _passes_json(captured_frame: CapturedFrame, byte_runs: ByteRunCollector) -> list[Json]:
    """Return the JSON of a frame's passes; data that the host writes to buffers is added to `byte_runs`."""
    writes = ((one, one.written) for one in captured_frame.passes)
    return [{**vars(one), "written": data and (data[0], byte_runs.add(data[1]))} for one, data in writes]


def _program_json(program_entry: Json) -> Json:
    return {
        **program_entry,
        "bindings": [
            (index, name, _with_camel_case_keys(entry)) for index, name, entry in program_entry["bindings"]
        ],
    }


def _struct_json(dtype: np.dtype[Any]) -> Json:
    """Return the size of a uniform struct [bytes], and each member's offset and size [words of 4 bytes]."""
    members = {name: _member_json(kind, offset) for name, (kind, offset, *_) in (dtype.fields or {}).items()}
    return {"size": dtype.itemsize, "members": members}


def _member_json(dtype: np.dtype[Any], byte_offset: int) -> list[int] | Json:
    base = dtype.base
    if base.fields is None:
        return [byte_offset // 4, dtype.itemsize // 4]
    return {"offset": byte_offset // 4, "each": base.itemsize // 4, "members": _struct_json(base)["members"]}


def _with_camel_case_keys(nested_value: object) -> object:
    """Return nested dictionaries with their keys in camel case, as WebGPU's JavaScript interface requires."""
    if isinstance(nested_value, dict):
        return {_camel_case(name): _with_camel_case_keys(one) for name, one in nested_value.items()}
    return nested_value


def _camel_case(snake_case: str) -> str:
    first, *others = snake_case.split("_")
    return first + "".join(word.title() for word in others)


def resources_read_before_write(frame_capture: FrameCapture, captured_frames: Frames) -> list[int]:
    """Return the sorted indices of the resources that a frame reads before writing to them.

    The page stores the data of these resources. A view of a texture counts as the whole texture, so a texture
    counts as written if any part of the texture is written.
    """
    found: set[int] = set()
    for frame in captured_frames:
        written: set[int] = set()
        for one in frame.passes:
            found |= {
                viewed_resource(frame_capture, k) for k in resources_read_by(frame_capture, one)
            } - written
            written |= {viewed_resource(frame_capture, k) for k in resources_written_by(frame_capture, one)}
    return sorted(found)


def resources_bound_as(
    frame_capture: FrameCapture, captured_frames: Frames, binding_names: tuple[str, ...]
) -> dict[int, str]:
    """Return a dictionary from resource index to name, for the resources that shaders bind by given names.

    binding_names : names of the bindings in the shaders
    """
    found: dict[int, str] = {}
    for one in (one for frame in captured_frames for one in frame.passes if one.program is not None):
        bound_names = [name for _, name, _ in frame_capture.programs[one.program or 0]["bindings"]]
        found |= {
            k: name
            for k, name in zip(one.bound, bound_names, strict=True)
            if name in binding_names and k >= 0
        }
    return found


def viewed_resource(frame_capture: FrameCapture, resource_index: int) -> int:
    """Return the index of the texture to which a texture view belongs.

    resource_index : index of a resource in the capture; returned unchanged if it is not a texture view
    """
    return int(frame_capture.resources[resource_index].get("of", resource_index))


def resources_read_by(frame_capture: FrameCapture, captured_pass: CapturedPass) -> Iterator[int]:
    """Yield the indices of the resources that a pass may read.

    captured_pass : pass of a captured frame
    """
    yield from (k for k, entry in _binding_entries(frame_capture, captured_pass) if _allows_reading(entry))
    if captured_pass.raster and captured_pass.raster["indices"] >= 0:
        yield int(captured_pass.raster["indices"])


def resources_written_by(frame_capture: FrameCapture, captured_pass: CapturedPass) -> Iterator[int]:
    """Yield the indices of the resources that a pass may write.

    captured_pass : pass of a captured frame
    """
    if captured_pass.written:
        yield captured_pass.written[0]
    yield from (k for k, entry in _binding_entries(frame_capture, captured_pass) if _allows_writing(entry))
    if captured_pass.raster:
        yield from (
            int(captured_pass.raster[name]) for name in ("depth", "target") if captured_pass.raster[name] >= 0
        )


def _binding_entries(frame_capture: FrameCapture, captured_pass: CapturedPass) -> Iterator[tuple[int, Json]]:
    if captured_pass.program is not None:
        bindings = frame_capture.programs[captured_pass.program]["bindings"]
        yield from (
            (k, entry) for k, (_, _, entry) in zip(captured_pass.bound, bindings, strict=True) if k >= 0
        )


def _allows_reading(layout_entry: Json) -> bool:
    return (
        "sampler" not in layout_entry
        and layout_entry.get("storage_texture", {}).get("access") != "write-only"
    )


def _allows_writing(layout_entry: Json) -> bool:
    return "storage_texture" in layout_entry or layout_entry.get("buffer") == {"type": "storage"}
