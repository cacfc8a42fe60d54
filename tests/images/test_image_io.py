"""Picture files are read back bit for bit, errors name the file, and no partial files remain."""

from __future__ import annotations

import io
import struct
import zlib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.images.colour import encode_srgb
from dermis.images.io import check_output, read_image, write_exr, write_image, write_png

SHAPE = (33, 47)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def _pillow_bytes(pixels: np.ndarray, kind: str, **options: object) -> bytes:
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(pixels).save(data, kind, **options)
    return data.getvalue()


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_keeps_every_bit(tmp_path: Path, rng: np.random.Generator, dtype: type, channels: int) -> None:
    levels = rng.integers(0, np.iinfo(dtype).max + 1, (*SHAPE, channels)).astype(dtype)
    write_png(tmp_path / "a.png", levels)
    read = read_image(tmp_path / "a.png")
    assert read.dtype == dtype
    np.testing.assert_array_equal(read, levels)


def test_png_written_by_ffmpeg_is_decoded_by_the_standard(tmp_path: Path, rng: np.random.Generator) -> None:
    # Pillow reads 16-bit grey exactly: an independent witness of byte order.
    from PIL import Image

    levels = rng.integers(0, 65536, SHAPE).astype(np.uint16)
    write_png(tmp_path / "a.png", levels)
    with Image.open(tmp_path / "a.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture), levels)


def test_percent_sign_in_a_name_is_not_a_sequence(tmp_path: Path, rng: np.random.Generator) -> None:
    levels = rng.integers(0, 65536, (*SHAPE, 3)).astype(np.uint16)
    write_png(tmp_path / "a%03d.png", levels)
    np.testing.assert_array_equal(read_image(tmp_path / "a%03d.png"), levels)


def test_grey_tiff_keeps_every_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    levels = rng.integers(0, 65536, SHAPE).astype(np.uint16)
    (tmp_path / "a.tif").write_bytes(_pillow_bytes(levels, "TIFF"))
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif")[..., 0], levels)


def test_rgb_tiff_keeps_every_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    import av

    levels = rng.integers(0, 65536, (*SHAPE, 3)).astype(np.uint16)
    encoder = av.CodecContext.create("tiff", "w")
    encoder.height, encoder.width, encoder.pix_fmt, encoder.time_base = *SHAPE, "rgb48le", Fraction(1, 1)
    packets = [*encoder.encode(av.VideoFrame.from_ndarray(levels, format="rgb48le")), *encoder.encode(None)]
    (tmp_path / "a.tif").write_bytes(b"".join(bytes(packet) for packet in packets))
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif"), levels)


def test_palette_and_grey_alpha_become_colour(tmp_path: Path, rng: np.random.Generator) -> None:
    from PIL import Image

    levels = rng.integers(0, 4, (*SHAPE, 3)).astype(np.uint8) * 85
    Image.fromarray(levels).quantize(64).save(tmp_path / "p.png")
    np.testing.assert_array_equal(read_image(tmp_path / "p.png"), levels)
    Image.fromarray(levels[..., :2].copy(), "LA").save(tmp_path / "la.png")
    np.testing.assert_array_equal(read_image(tmp_path / "la.png"), levels[..., [0, 0, 0, 1]])


@pytest.mark.parametrize("channels", [3, 4])
def test_exr_keeps_every_float(tmp_path: Path, rng: np.random.Generator, channels: int) -> None:
    linear = np.float32(10) ** rng.uniform(-6, 6, (*SHAPE, channels)).astype(np.float32)
    write_exr(tmp_path / "a.exr", linear)
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), linear)


def test_exr_layers_are_ignored(tmp_path: Path) -> None:
    import OpenEXR

    grey, colour = np.ones(SHAPE, np.float32), np.full((*SHAPE, 3), 2, np.float32)
    OpenEXR.File({}, {"RGB": colour, "depth": grey, "irradiance": grey + 4}).write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), colour)


def _radiance(rgbe: np.ndarray, exposure: str = "") -> bytes:
    """Return scanlines with one run and one literal sequence per channel."""
    height, width = rgbe.shape[:2]
    rows = [f"#?RADIANCE\n{exposure}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()]
    for row in rgbe:
        rows.append(struct.pack(">BBH", 2, 2, width))
        for channel in row.T:
            rows.append(bytes((128 + 8, channel[0], width - 8)) + channel[8:].tobytes())
    return b"".join(rows)


def test_radiance_matches_its_definition(tmp_path: Path, rng: np.random.Generator) -> None:
    rgbe = rng.integers(100, 160, (*SHAPE, 4)).astype(np.uint8)
    rgbe[:, :8] = rgbe[:, :1]
    expected = rgbe[..., :3] * 2.0 ** (rgbe[..., 3:] - 136.0)
    (tmp_path / "a.hdr").write_bytes(_radiance(rgbe))
    np.testing.assert_array_equal(read_image(tmp_path / "a.hdr"), expected.astype(np.float32))
    (tmp_path / "b.hdr").write_bytes(_radiance(rgbe, "EXPOSURE=4\n"))
    np.testing.assert_array_equal(read_image(tmp_path / "b.hdr"), (expected / 4).astype(np.float32))


def _damaged_files(folder: Path) -> dict[str, bytes]:
    noise = np.random.default_rng(3).integers(0, 65536, (64, 64, 3)).astype(np.uint16)
    noise8 = (noise >> 8).astype(np.uint8)
    write_png(folder / "16.png", noise)
    write_exr(folder / "a.exr", noise.astype(np.float32))
    whole = {
        "rgb8.png": _pillow_bytes(noise8, "PNG"),
        "rgb16.png": (folder / "16.png").read_bytes(),
        "a.jpg": _pillow_bytes(noise8, "JPEG"),
        "a.tif": _pillow_bytes(noise8, "TIFF"),
        "a.exr": (folder / "a.exr").read_bytes(),
        "a.hdr": _radiance(np.full((64, 64, 4), 130, np.uint8)),
    }
    cut = {f"half-{name}": data[: len(data) // 2] for name, data in whole.items()}
    starts = {f"start-{name}": data[:12] for name, data in whole.items()}
    almost = {f"almost-{name}": data[:-20] for name, data in whole.items()}
    pngs = {f"flipped-{name}": _flip(data, 2000) for name, data in whole.items() if name.endswith("png")}
    return cut | starts | almost | pngs | {"text.png": b"hello", "empty.png": b""}


def _flip(data: bytes, at: int) -> bytes:
    return data[:at] + bytes((data[at] ^ 0xFF,)) + data[at + 1 :]


def test_damaged_files_are_named(tmp_path: Path) -> None:
    for name, data in _damaged_files(tmp_path).items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(DermisError, match=name):
            read_image(tmp_path / name)


def test_missing_file_and_folder_are_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.png", tmp_path):
        with pytest.raises(DermisError, match=path.name):
            read_image(path)


def test_huge_pictures_are_refused(tmp_path: Path) -> None:
    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    huge = bytearray(_pillow_bytes(np.zeros((16, 16, 3), np.uint8), "PNG"))
    huge[16:33] = header + struct.pack(">I", zlib.crc32(b"IHDR" + header))
    (tmp_path / "huge.png").write_bytes(bytes(huge))
    with pytest.raises(DermisError, match="60000 x 60000"):
        read_image(tmp_path / "huge.png")


def test_write_image_rounds_srgb_to_nearest(tmp_path: Path) -> None:
    linear = np.linspace(-0.1, 1.2, 3 * 4000).reshape(40, 100, 3)
    write_image(tmp_path / "a.PNG", linear)
    exact = np.clip(encode_srgb(linear), 0, 1) * 255
    assert np.abs(read_image(tmp_path / "a.PNG") - exact).max() <= 0.5 + 1e-9
    write_image(tmp_path / "a.exr", linear)
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), linear.astype(np.float32))


def test_write_image_leaves_alpha_linear(tmp_path: Path) -> None:
    linear = np.full((16, 16, 4), 0.5, np.float32)
    write_image(tmp_path / "a.png", linear)
    assert read_image(tmp_path / "a.png")[0, 0].tolist() == [188, 188, 188, 128]


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, suffix: str) -> None:
    resource = pytest.importorskip("resource")
    target = tmp_path / f"a{suffix}"
    write_image(target, np.zeros((16, 16, 3), np.float32))
    before = target.read_bytes()
    noise = np.random.default_rng(1).random((400, 400, 3)).astype(np.float32)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))  # as a disk that fills up
    try:
        with pytest.raises(DermisError, match=target.name):
            write_image(target, noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == [target.name]
    assert target.read_bytes() == before


def test_interrupt_while_writing_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def half(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[: len(data) // 2])
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(KeyboardInterrupt):
        write_png(tmp_path / "a.png", np.zeros((16, 16, 3), np.uint8))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["none/a.png", "file/a.png", "a.jpg", "a", "folder.png"])
def test_impossible_outputs_are_refused_early(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.png").mkdir()
    before = sorted(tmp_path.iterdir())
    with pytest.raises(DermisError, match=Path(name).name):
        check_output(tmp_path / name)
    with pytest.raises(DermisError, match=Path(name).name):
        write_image(tmp_path / name, np.zeros((16, 16, 3)))
    assert sorted(tmp_path.iterdir()) == before


def test_writers_refuse_missing_folders_themselves(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"a\.png"):
        write_png(tmp_path / "none" / "a.png", np.zeros((16, 16, 3), np.uint8))
    with pytest.raises(DermisError, match=r"a\.exr"):
        write_exr(tmp_path / "none" / "a.exr", np.zeros((16, 16, 3), np.float32))


def test_check_output_leaves_no_trace(tmp_path: Path) -> None:
    assert check_output(tmp_path / "a.exr") == tmp_path / "a.exr"
    assert list(tmp_path.iterdir()) == []


def test_writers_refuse_wrong_shapes(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="float32"):
        write_png(tmp_path / "a.png", np.zeros((16, 16, 3), np.float32))  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="shape"):
        write_exr(tmp_path / "a.exr", np.zeros((16, 16)))
    assert list(tmp_path.iterdir()) == []
