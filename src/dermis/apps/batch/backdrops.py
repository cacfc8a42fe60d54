"""Pictures of users as backgrounds: cropped, blurred, and composited in linear light."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.sampling import Parameters, table_numbers
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import PICTURE_BACKGROUND
from dermis.base.arrays import Floats
from dermis.base.errors import refuse
from dermis.frame.observation import Observation
from dermis.images.colour import decode_srgb_levels, encode_srgb8
from dermis.images.io import read_colours

_BLUR_OF_HEIGHT = 0.1  # standard deviation of the largest blur, relative to the picture's height
_MIN_SOURCE_SIDE = 2


class Crop(NamedTuple):
    """Part of a picture: its size relative to the largest part with this aspect ratio, and its position.

    zoom : factor by which the part is smaller than the largest one, at least 1 [-]
    x, y : position, from 0 at the left and the upper end to 1 at the right and the lower end [-]
    """

    zoom: float
    x: float
    y: float


def with_backdrop(observation: Observation, parameters: Parameters, spec: Spec) -> Observation:
    """Return an observation with its picture over a background picture, if the image has one.

    observation : observation whose picture has an alpha channel
    parameters : sampled parameters of the image
    """
    if parameters["background.kind"] != PICTURE_BACKGROUND:
        return observation
    values, picture = table_numbers(parameters, "background"), observation.picture
    crop = Crop(values["zoom"], values["crop_x"], values["crop_y"])
    path = spec.folder / str(parameters["background.picture"])
    digest = spec.files.get(str(parameters["background.picture"]), "")
    backdrop = picture_backdrop(path, spec.size, crop, values["blur"], digest)
    return replace(observation, picture=_over(picture, backdrop))


@lru_cache(maxsize=4)
def picture_backdrop(
    path: Path, picture_size: tuple[int, int], crop: Crop, blur: float, digest: str = ""
) -> Floats:
    """Return a part of a picture file as a background (h, w, 3) in linear Rec. 709.

    picture_size : width and height of the background [pixel]
    blur : blur from 0 to 1; at 1 a Gaussian whose standard deviation is a tenth of the height [-]
    digest : hash of the file, by which results are cached

    Raises DermisError for files that are not pictures.
    """
    from PIL import Image
    from scipy.ndimage import gaussian_filter

    pixels, colour_space = read_colours(path, apply_exif_orientation=True)
    if pixels.ndim != 3 or min(pixels.shape[:2]) < _MIN_SOURCE_SIDE:
        actual = f"it has shape {pixels.shape}"
        refuse(path, "a picture of 2 x 2 pixels or more", actual, "Choose another picture")
    linear = np.asarray(colour_space.to_linear(pixels), np.float32)
    box = crop_box((linear.shape[1], linear.shape[0]), picture_size, crop)
    channels = [
        np.asarray(Image.fromarray(channel, "F").resize(picture_size, Image.Resampling.BILINEAR, box))
        for channel in np.ascontiguousarray(np.moveaxis(linear, 2, 0))
    ]
    backdrop = np.stack(channels, axis=-1)
    if blur:
        sd = blur * _BLUR_OF_HEIGHT * picture_size[1]
        backdrop = gaussian_filter(backdrop, (sd, sd, 0.0), mode="nearest")
    return np.asarray(np.maximum(backdrop, 0.0), np.float32)


def crop_box(
    source_size: tuple[int, int], picture_size: tuple[int, int], crop: Crop
) -> tuple[float, float, float, float]:
    """Return left, upper, right and lower edge of the part of a picture that a background shows [pixel].

    source_size, picture_size : width and height of the file and of the background [pixel]
    """
    width, height = source_size
    scale = min(width / picture_size[0], height / picture_size[1]) / crop.zoom
    own_width, own_height = scale * picture_size[0], scale * picture_size[1]
    left, upper = crop.x * (width - own_width), crop.y * (height - own_height)
    return left, upper, min(left + own_width, width), min(upper + own_height, height)


def _over(picture: NDArray[np.uint8 | np.float32], backdrop: Floats) -> NDArray[np.uint8 | np.float32]:
    """Return a picture with alpha (h, w, 4) over a background: linear floats, or sRGB bytes.

    Colours of floats are already multiplied by alpha, those of bytes are not.
    """
    if picture.dtype != np.uint8:
        return np.asarray(picture[..., :3] + (1.0 - picture[..., 3:]) * backdrop, np.float32)
    alpha = picture[..., 3:].astype(np.float32) / np.float32(255.0)
    person = decode_srgb_levels(np.ascontiguousarray(picture[..., :3]).astype(np.uint8))
    return encode_srgb8(alpha * person + (1.0 - alpha) * backdrop)
