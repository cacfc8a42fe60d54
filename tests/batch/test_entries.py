"""Files of one image: decoded contents, and equality of their bytes."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from small_observation import OUTPUT_NAMES, observation, small_spec

from dermis.apps.batch.output_encoding import (
    Encoding,
    decode_output,
    encode_output,
    file_format,
    storage_description,
)
from dermis.apps.batch.reader import decode_image
from dermis.apps.batch.records import encode_record
from dermis.base.errors import DermisError
from dermis.images.skin_tone import skin_tone
from dermis.scene.outputs import OUTPUTS

ALL = tuple(OUTPUTS.names)


def image(number: int, **spec: Any) -> tuple[Any, dict[str, bytes]]:
    used = small_spec(**spec)
    seen = observation(number, outputs=used.outputs)
    return seen, encode_record(number, seen, used.parameters(number), used)


def used_parameters(found: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in found["parameters"].items() if value is not None}


@pytest.mark.parametrize("encoding", ["png", "exr", "npy"])
@pytest.mark.parametrize("name", ALL)
def test_each_output_comes_back_as_exactly_as_is_said(name: str, encoding: Encoding) -> None:
    values = observation(4, outputs=(name,)).outputs[name]
    kind, output = file_format(name, encoding), OUTPUTS[name]
    found = decode_output(name, kind, encode_output(name, values, encoding))
    assert found.shape == values.shape and found.dtype == output.kind
    description = storage_description(name, encoding)
    if "16-bit PNG" in description:
        assert output.quantisation is not None
        np.testing.assert_allclose(found, values, rtol=1e-6, atol=0.51 * output.quantisation.step)
    elif "16" in description:
        np.testing.assert_allclose(found, values, rtol=2**-11, atol=1e-7)
    else:
        np.testing.assert_array_equal(found, values)


@pytest.mark.parametrize("name", ALL)
def test_the_background_comes_back_exactly(name: str) -> None:
    output = OUTPUTS[name]
    values = np.full((3, 4, output.channels or 2), output.background, output.kind)
    values = values[..., 0] if output.channels == 1 else values
    found = decode_output(name, file_format(name, "png"), encode_output(name, values, "png"))
    np.testing.assert_array_equal(found, values)


def test_equal_observations_give_equal_bytes_and_others_do_not() -> None:
    assert image(3)[1] == image(3)[1]
    assert image(3)[1]["png"] != image(4)[1]["png"]


def test_names_and_order_of_the_files() -> None:
    _, files = image(1, outputs=("depth", "triangle"))
    assert set(files) == {"png", "depth.png", "triangle.exr", "json"}
    assert set(image(1, outputs=("depth",), encoding="npy")[1]) == {"png", "depth.npy", "json"}
    assert set(image(1, outputs=("depth",), encoding="exr")[1]) == {"png", "depth.exr", "json"}


def test_all_that_is_known_comes_back() -> None:
    seen, files = image(1)
    found = decode_image(files)
    assert found["number"] == 1 and used_parameters(found) == small_spec().parameters(1)
    np.testing.assert_array_equal(found["picture"], seen.picture)
    for ours, theirs in zip(found["camera"], seen.camera, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-4)
    np.testing.assert_allclose(found["head_pose"], seen.head_pose)
    np.testing.assert_allclose(found["gaze"], seen.gaze)
    points, truth = found["landmarks"]["ibug-68"], seen.landmarks["ibug-68"]
    np.testing.assert_allclose(points.pixels, truth.pixels, atol=0.0005)
    np.testing.assert_allclose(points.positions_mm, truth.positions_mm, atol=0.00005)
    np.testing.assert_array_equal(points.visible, truth.visible)
    assert set(OUTPUT_NAMES) < set(found)


def test_what_is_not_known_is_none_and_places_without_one_are_nan() -> None:
    spec, seen = small_spec(), observation(2)
    seen.landmarks["ibug-68"].pixels[1] = np.nan
    found = decode_image(encode_record(2, seen, spec.parameters(2), spec))
    assert found["gaze"] is None
    assert np.isnan(found["landmarks"]["ibug-68"].pixels[1]).all()
    assert np.isfinite(found["landmarks"]["ibug-68"].pixels[0]).all()


def test_records_are_plain_json_without_minus_zero() -> None:
    spec, seen = small_spec(), observation(1)
    seen.camera.t[:] = -0.0, -1e-9, 5.0
    record = encode_record(1, seen, spec.parameters(1), spec)["json"]
    assert b"-0.0," not in record and json.loads(record)["camera"]["t"] == [0.0, 0.0, 5.0]


def test_records_describe_the_colour_of_the_skin() -> None:
    spec, seen = small_spec(), observation(1)
    files = encode_record(1, seen, spec.parameters(1), spec, skin_tone((0.4, 0.25, 0.18)))
    tone = decode_image(files)["skin_tone"]
    assert tone["ita_degrees"] == pytest.approx(skin_tone((0.4, 0.25, 0.18)).ita_degrees, abs=0.01)
    assert decode_image(encode_record(1, seen, spec.parameters(1), spec))["skin_tone"] is None


def test_numbers_that_are_none_are_refused() -> None:
    spec, seen = small_spec(outputs=("depth",)), observation(1)
    seen.outputs["depth"][2, 3] = np.nan
    with pytest.raises(DermisError, match="output depth: expected finite numbers"):
        encode_record(1, seen, spec.parameters(1), spec)
