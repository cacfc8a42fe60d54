"""EXR and HDR files as programs write them: layers, windows, primaries, orientations and exposures."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.base.errors import DermisError, DermisWarning
from dermis.images.colour_spaces import gamma_colour_space
from dermis.images.io import read_colours, read_image, read_size, repair_radiance

Floats = NDArray[np.float32]
SHAPE = (6, 12)
ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)


def exr(path: Path, channels: dict[str, Any], **header: Any) -> Path:
    import OpenEXR

    OpenEXR.File(header, channels).write(str(path))
    return path


def layers(*names: str, suffixes: str = "RGB") -> dict[str, Floats]:
    """Return channels of layers, the first one with the value 1, the second one with 2 and so on."""
    separator = {"": ""}
    return {
        f"{name}{separator.get(name, '.')}{suffix}": np.full(SHAPE, k, np.float32)
        for k, name in enumerate(names, 1)
        for suffix in suffixes
    }


@pytest.mark.parametrize(
    "channels",
    [
        layers("ViewLayer.Combined", suffixes="RGBA") | {"ViewLayer.Depth.Z": np.zeros(SHAPE, np.float32)},
        layers("", suffixes="rgb"),
        layers("beauty"),
        {f"beauty.{name}": np.ones(SHAPE, np.float32) for name in ("red", "green", "blue")},
        layers("", suffixes="Y") | {"N.X": np.zeros(SHAPE, np.float32), "N.Y": np.zeros(SHAPE, np.float32)},
        {"height": np.ones(SHAPE, np.float32)},
    ],
)
def test_single_picture_is_found_by_its_channels(tmp_path: Path, channels: dict[str, Floats]) -> None:
    image = read_image(exr(tmp_path / "a.exr", channels))
    assert image.shape[:2] == SHAPE and (image == 1.0).all()


@pytest.mark.parametrize(
    ("names", "used"),
    [
        (("", "diffuse"), "the one without a name"),
        (("diffuse", "specular", "beauty"), "beauty"),
        (("ViewLayer.Normal", "ViewLayer.Combined"), "ViewLayer.Combined"),
        (("left", "right"), "left"),
    ],
)
def test_picture_among_several_layers_is_read_and_named(
    tmp_path: Path, names: tuple[str, ...], used: str
) -> None:
    path = exr(tmp_path / "a.exr", layers(*names))
    with pytest.warns(DermisWarning, match=rf"a\.exr: of its layers, .*, only {used} is read"):
        image = read_image(path)
    assert (image == 1 + [name or "the one without a name" for name in names].index(used)).all()


def test_picture_among_several_parts_is_read_and_named(tmp_path: Path) -> None:
    import OpenEXR

    def part(name: str, value: float) -> Any:
        channels = {letter: np.full(SHAPE, value, np.float32) for letter in "RGB"}
        return OpenEXR.Part({"type": OpenEXR.scanlineimage}, channels, name)

    depth = OpenEXR.Part({"type": OpenEXR.scanlineimage}, {"Z": np.zeros(SHAPE, np.float32)}, "depth")
    OpenEXR.File([depth, part("albedo", 2.0), part("rgba", 1.0)]).write(str(tmp_path / "a.exr"))
    with pytest.warns(DermisWarning, match="of its layers, albedo, rgba, only rgba is read"):
        assert (read_image(tmp_path / "a.exr") == 1.0).all()


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        (
            {"Z": np.zeros(SHAPE, np.float32), "id": np.zeros(SHAPE, np.float32)},
            "channels Z, id, and no layer",
        ),
        (
            {"N.X": np.zeros(SHAPE, np.float32), "N.Y": np.zeros(SHAPE, np.float32)},
            "channels N.X, N.Y, and no layer",
        ),
        ({name: np.zeros(SHAPE, np.float32) for name in ("Y", "RY", "BY")}, "luminance and chroma"),
    ],
)
def test_files_without_a_picture_are_refused(tmp_path: Path, channels: dict[str, Floats], words: str) -> None:
    with pytest.raises(DermisError, match=rf"a\.exr: .*{words}.* Convert it"):
        read_image(exr(tmp_path / "a.exr", channels))


def test_a_data_window_is_placed_in_the_display_window(tmp_path: Path) -> None:
    picture = np.arange(3 * 4 * 6, dtype=np.float32).reshape(4, 6, 3) + 1
    windows = {"dataWindow": ((5, 3), (10, 6)), "displayWindow": ((3, 2), (14, 7))}
    path = exr(tmp_path / "a.exr", {"RGB": picture}, **windows)
    assert read_size(path) == (12, 6)
    with pytest.warns(DermisWarning, match="its data window is a part of its display window"):
        image = read_image(path)
    np.testing.assert_array_equal(image[1:5, 2:8], picture)
    assert image.sum() == picture.sum()


def test_pixels_outside_the_display_window_are_left_out(tmp_path: Path) -> None:
    picture = np.arange(3 * 6 * 8, dtype=np.float32).reshape(6, 8, 3)
    windows = {"dataWindow": ((-1, -2), (6, 3)), "displayWindow": ((0, 0), (5, 2))}
    path = exr(tmp_path / "a.exr", {"RGB": picture}, **windows)
    with pytest.warns(DermisWarning, match="its pixels outside its display window are left out"):
        np.testing.assert_array_equal(read_image(path), picture[2:5, 1:7])
    away = exr(
        tmp_path / "b.exr", {"RGB": picture}, dataWindow=((0, 0), (7, 5)), displayWindow=((20, 0), (25, 5))
    )
    with pytest.raises(DermisError, match="its data window is outside its display window"):
        read_image(away)


@pytest.mark.parametrize("header", [{"chromaticities": ACES}, {"colorInteropID": "lin_ap0_scene"}])
def test_primaries_of_exr_files_are_converted(tmp_path: Path, header: dict[str, Any]) -> None:
    picture = np.random.default_rng(1).uniform(0.2, 0.8, (*SHAPE, 3)).astype(np.float32)
    path = exr(tmp_path / "a.exr", {"RGB": picture}, **header)
    with pytest.warns(DermisWarning, match="its colours are converted from its primaries to Rec. 709"):
        pixels, space = read_colours(path)
    np.testing.assert_allclose(
        space.to_linear(pixels), gamma_colour_space("", None, ACES).to_linear(picture), rtol=1e-4
    )
    np.testing.assert_array_equal(read_image(path), picture)  # as numbers


def test_unknown_colours_and_pixel_aspects_of_exr_files_are_noted(tmp_path: Path) -> None:
    picture = np.ones((*SHAPE, 3), np.float32)
    path = exr(tmp_path / "a.exr", {"RGB": picture}, colorInteropID="g22_ap1_scene", pixelAspectRatio=2.0)
    with pytest.warns(
        DermisWarning, match="its pixel aspect of 2 is not used; its colour space, g22_ap1_scene"
    ):
        assert read_colours(path)[1].is_default


def hdr(rgbe: NDArray[np.uint8], size: str, *lines: str, kind: str = "rgbe") -> bytes:
    return (
        "\n".join(["#?RADIANCE", *lines, f"FORMAT=32-bit_rle_{kind}", "", size, ""]).encode() + rgbe.tobytes()
    )


@pytest.mark.parametrize(
    "size", ["-Y 4 +X 6", "+Y 4 +X 6", "-Y 4 -X 6", "+Y 4 -X 6", "+X 6 -Y 4", "-X 6 +Y 4"]
)  # fmt: skip
def test_hdr_files_are_upright_in_every_order_of_pixels(tmp_path: Path, size: str) -> None:
    rgbe = np.random.default_rng(2).integers(2, 200, (4, 6, 4)).astype(np.uint8)
    first, _, second, _ = size.split()
    stored = rgbe[::-1] if "+Y" in size else rgbe
    stored = stored[:, ::-1] if "-X" in size else stored
    stored = stored.swapaxes(0, 1) if first[1] == "X" else stored
    path = tmp_path / "a.hdr"
    path.write_bytes(hdr(np.ascontiguousarray(stored), size))
    assert read_size(path) == (6, 4) and second
    np.testing.assert_array_equal(
        read_image(path), np.float32(rgbe[..., :3] * 2.0 ** (rgbe[..., 3:] - 136.0))
    )


def test_hdr_exposure_and_colour_correction_are_applied(tmp_path: Path) -> None:
    rgbe = np.full((2, 3, 4), 128, np.uint8)
    path = tmp_path / "a.hdr"
    path.write_bytes(hdr(rgbe, "-Y 2 +X 3", "EXPOSURE=2", "EXPOSURE=4", "COLORCORR=1 2 0.5"))
    np.testing.assert_allclose(read_image(path), np.broadcast_to(0.5 / 8 / np.array([1, 2, 0.5]), (2, 3, 3)))
    path.write_bytes(hdr(rgbe, "-Y 2 +X 3", "COLORCORR=1 0 1"))
    with pytest.raises(DermisError, match="its COLORCORR is 1 0 1"):
        read_image(path)


def test_primaries_of_hdr_files_are_converted(tmp_path: Path) -> None:
    rgbe = np.random.default_rng(2).integers(20, 200, (2, 3, 4)).astype(np.uint8)
    rgbe[..., 3] = 128
    colours = np.float32(rgbe[..., :3] / 256)
    path, primaries = tmp_path / "a.hdr", " ".join(map(str, ACES))
    path.write_bytes(hdr(rgbe, "-Y 2 +X 3", f"PRIMARIES={primaries}"))
    with pytest.warns(DermisWarning, match="converted from its primaries"):
        pixels, space = read_colours(path)
    np.testing.assert_allclose(
        space.to_linear(pixels), gamma_colour_space("", None, ACES).to_linear(colours), rtol=1e-5
    )
    path.write_bytes(hdr(rgbe, "-Y 2 +X 3", "PRIMARIES=0 0 0 0 0 0 0 0", "GAMMA=1"))  # as Photoshop
    assert read_colours(path)[1].is_default
    path.write_bytes(hdr(np.full((2, 3, 4), 128, np.uint8), "-Y 2 +X 3", kind="xyze"))
    with pytest.warns(DermisWarning, match="converted from its primaries"):
        pixels, space = read_colours(path)
    np.testing.assert_allclose(space.to_linear(pixels), 0.5, rtol=1e-3)  # white stays white


def test_unused_hdr_values_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "a.hdr"
    path.write_bytes(hdr(np.full((2, 3, 4), 128, np.uint8), "-Y 2 +X 3", "GAMMA=2.2", "PIXASPECT=0.5"))
    with pytest.warns(
        DermisWarning, match=r"its GAMMA of 2\.2 is not used; its PIXASPECT of 0\.5 is not used"
    ):
        read_image(path)


def test_few_invalid_pixels_are_replaced_and_counted() -> None:
    radiance = np.full((4, 8, 3), 0.5, np.float32)
    radiance[0, 0, 1], radiance[1, 1], radiance[2, 2], radiance[3, 3, 0] = 7.0, np.inf, np.nan, -2.0
    with pytest.warns(DermisWarning, match="sky: 2 infinite or NaN and 1 negative pixels of 32") as notes:
        mended = repair_radiance("sky", radiance)
    assert "infinite values become 7, the largest finite one, others 0" in str(notes[0].message)
    assert (
        (mended[1, 1] == 7.0).all() and (mended[2, 2] == 0.0).all() and mended[3, 3].tolist() == [0, 0.5, 0.5]
    )
    assert (mended == radiance).sum() == 96 - 7
    sound = np.abs(np.nan_to_num(radiance[3:]))
    assert repair_radiance("sky", sound) is sound


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 0.0])
def test_mostly_invalid_radiance_is_refused(value: float) -> None:
    radiance = np.full((4, 8, 3), value, np.float32)
    with pytest.raises(DermisError, match="sky: expected a picture of radiance above 0"):
        repair_radiance("sky", radiance)
    radiance[:, 4:] = 1.0  # a half
    if value != 0.0:
        with pytest.warns(DermisWarning, match="16 "):
            repair_radiance("sky", radiance)


def test_an_exr_file_in_memory_has_no_name() -> None:
    import OpenEXR

    from dermis.images.hdr import decode_exr

    file = io.BytesIO()
    OpenEXR.File({}, {"RGB": np.ones((*SHAPE, 3), np.float32)}).write(file)
    assert (decode_exr(file.getvalue()) == 1.0).all()
