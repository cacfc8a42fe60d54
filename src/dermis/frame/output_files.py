"""Writing of outputs as OpenEXR, PNG and NumPy files."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.base import atomic_write as files
from dermis.base.errors import refuse
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.images.codecs import encode_png
from dermis.images.io import encode_exr_parts
from dermis.scene.outputs import OUTPUTS, Output, Quantisation

FileFormat = Literal["exr", "png", "npy"]
_MAX_PNG_LEVEL = 65535
_PICTURE_PART_NAME = "rgba"  # name of the first part, a convention of compositing programs


def check_formats(output_names: Iterable[str], file_format: FileFormat) -> None:
    """Raise DermisError for an output that a file format cannot store.

    output_names : names of outputs
    file_format : file format
    """
    for name in output_names:
        if file_format == "png" and OUTPUTS[name].quantisation is None and OUTPUTS[name].kind != "uint8":
            refuse(f"output {name}", "exr or npy", "got png, which cannot hold it", "Choose one of these")


def output_path(picture_path: Path, output_name: str, file_format: FileFormat) -> Path:
    """Return the path of the file of an output, beside the picture: face.depth.exr beside face.png."""
    return picture_path.with_name(f"{picture_path.stem}.{output_name}.{file_format}")


def encode_output(output_name: str, output_array: OutputArray, file_format: FileFormat) -> bytes:
    """Return the bytes of a file that stores one output; equal arrays give equal bytes.

    output_name : name of the output
    output_array : (h, w) or (h, w, c) array of the output
    file_format : file format
    """
    return _ENCODERS[file_format](output_name, output_array)


def write_output(path: Path, output_name: str, output_array: OutputArray) -> None:
    """Write an output as .exr, .png or .npy, atomically.

    output_name : name of the output
    output_array : (h, w) or (h, w, c) array of the output
    """
    kinds: dict[str, FileFormat] = {".exr": "exr", ".png": "png", ".npy": "npy"}
    _write_atomically(path, encode_output(output_name, output_array, kinds[path.suffix.lower()]))


def write_multipart(path: Path, picture: OutputArray, output_arrays: Mapping[str, OutputArray]) -> None:
    """Write a linear picture and outputs as the parts of one OpenEXR file.

    picture : (h, w, 3 or 4) linear floats
    output_arrays : dictionary from the name of an output to its array
    """
    parts = {_PICTURE_PART_NAME: dict(zip("RGBA", np.moveaxis(picture, -1, 0), strict=False))}
    parts |= {name: _named_channels(OUTPUTS[name], one) for name, one in output_arrays.items()}
    _write_atomically(path, encode_exr_parts(parts))


def quantise(output_name: str, output_array: OutputArray) -> NDArray[np.uint8 | np.uint16]:
    """Return an output of a frame as integers for a PNG file, see `quantise_levels`."""
    return quantise_levels(output_array, OUTPUTS[output_name].quantisation)


def quantise_levels(
    output_array: OutputArray, quantisation: Quantisation | None
) -> NDArray[np.uint8 | np.uint16]:
    """Return an output as integers for a PNG file, (h, w) or (h, w, 3); bytes are returned unchanged.

    Outputs with two channels get a third channel of zeros, because PNG has no format with two colour
    channels.
    """
    if output_array.dtype == np.uint8:
        return output_array
    assert quantisation is not None, "check_formats accepts only quantised outputs"
    words = np.clip(np.rint(output_array / quantisation.step + quantisation.zero), 0, _MAX_PNG_LEVEL).astype(
        np.uint16
    )
    return words if words.ndim == 2 or words.shape[2] > 2 else np.pad(words, ((0, 0), (0, 0), (0, 1)))


def _named_channels(output: Output, output_array: OutputArray) -> dict[str, OutputArray]:
    """Return a dictionary from channel names in OpenEXR, such as normal.X, to channels of an output."""
    channels = np.atleast_3d(output_array)
    names = output.channel_names or [str(k) for k in range(channels.shape[2])]
    return {f"{output.name}.{name}": channels[..., k] for k, name in enumerate(names)}


def _encode_exr(output_name: str, output_array: OutputArray) -> bytes:
    return encode_exr_parts(
        {output_name: _named_channels(OUTPUTS[output_name], output_array)}, use_run_length_encoding=True
    )


def _encode_png(output_name: str, output_array: OutputArray) -> bytes:
    words = quantise(output_name, output_array)
    return encode_png(words[..., None] if words.ndim == 2 else words, 6)


def _encode_npy(output_name: str, output_array: OutputArray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, output_array, allow_pickle=False)
    return stream.getvalue()


_ENCODERS: Mapping[FileFormat, Callable[[str, OutputArray], bytes]] = {
    "exr": _encode_exr,
    "png": _encode_png,
    "npy": _encode_npy,
}


def _write_atomically(path: Path, file_bytes: bytes) -> None:
    with files.atomic_file(path) as temporary:
        temporary.write_bytes(file_bytes)
