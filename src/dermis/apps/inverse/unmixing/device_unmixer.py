"""Unmixing and recolouring of pictures on a device, in strips; separation of slow shading."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing import skin_model as skins
from dermis.apps.inverse.unmixing.skin_model import SkinModel, skin_model
from dermis.gpu import (
    CommandList,
    ComputeProgram,
    Device,
    MutableBindings,
    UniformRecord,
    Texture,
    cached_program,
    download,
    make_texture,
)
from dermis.gpu.program import declared
from dermis.gpu.textures import texture_from_array, upload
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import SkinParameters

Pixels = NDArray[np.float32]
ProgressCallback = Callable[[int, int], None]
_FOLDER = Path(__file__).parent
_GUESS_SIDE = 96  # of the grid of first guesses
_MAX_STEPS = 8
_STRIP_TEXELS = 1 << 22  # texels, of 16 bytes each in five textures
_FORMAT = "rgba32float"


class Unmixer:
    """Inverse of a skin model on a device: colours to melanin and blood.

    noise : standard deviation of a channel, relative [-]
    """

    def __init__(self, device: Device, model: SkinModel, noise: float) -> None:
        self.device, self.model, self.noise = device, model, noise
        self._table = _table_texture(device, model)
        self._found: tuple[Texture, Texture] | None = None
        self._starts = device.storage_buffer(8 * _GUESS_SIDE**2, "first guesses")
        shader = _program(device, "unmix_start", model)
        frame = CommandList(device, timed=False)
        frame.compute("start", shader, self._bound(shader, 0), (_GUESS_SIDE, _GUESS_SIDE))
        frame.submit()

    def unmix(self, colours: Pixels, told: ProgressCallback = lambda done, of: None) -> tuple[Pixels, Pixels, Pixels]:
        """Return melanin, blood and the third number (h, w, 3) of colours (h, w, 3), the standard deviations
        of the first two (h, w, 2), and the residual (h, w, 3).
        """
        height, width = colours.shape[:2]
        made, unsure, residual = (np.empty((height, width, n), np.float32) for n in (3, 2, 3))
        for rows in row_strips(height, width):
            frame = CommandList(self.device, timed=False)
            strip = texture_from_array(self.device, _rgba(colours[rows]), _FORMAT, "colours")
            textures = self.record(frame, strip)
            frame.submit()
            shares, left = (download(self.device, texture) for texture in textures)
            made[rows, :, :2], unsure[rows] = shares[..., :2], shares[..., 2:]
            made[rows, :, 2], residual[rows] = left[..., 3], left[..., :3]
            told(rows.stop, height)
        return made, unsure, residual

    def record(self, frame: CommandList, colours: Texture) -> tuple[Texture, Texture]:
        """Record the pass from a texture of colours to melanin, blood and their standard deviations, and to
        the residual with the third number; the textures are reused for the next of the same size.
        """
        size = colours.size[:2]
        shader = _program(self.device, "unmix", self.model)
        if self._found is None or self._found[0].size[:2] != size:
            self._found = make_texture(self.device, size, _FORMAT), make_texture(self.device, size, _FORMAT)
        shares, residual = self._found
        bound = {"colours": colours, "shares": shares, "residual": residual}
        frame.compute("unmix", shader, bound | self._bound(shader, _MAX_STEPS), size)
        return shares, residual

    def _bound(self, shader: ComputeProgram, steps: int) -> MutableBindings:
        record = _model_record(shader, self.model, self.noise, steps)
        return {"model": record, "table": self._table, "starts": self._starts}


def recolour(
    device: Device, model: SkinModel, made: Pixels, residual: Pixels, factors: Floats, added: Floats
) -> Pixels:
    """Return the colours (h, w, 3) of the model's skins with a residual (h, w, 3).

    made : (h, w, 3) melanin, blood and the third number
    factors, added : (3,) applied to each of them, in this order
    """
    table, shader = _table_texture(device, model), _program(device, "recolour", model)
    change = shader.record("Change", factors=factors, added=added)
    found = np.empty(residual.shape, np.float32)
    for rows in row_strips(*made.shape[:2]):
        first, second = (
            texture_from_array(device, _rgba(one[rows]), _FORMAT, "maps") for one in (made, residual)
        )
        size = first.size[:2]
        texture = make_texture(device, size, _FORMAT)
        bound: MutableBindings = {"model": _model_record(shader, model, 1.0, 0), "table": table, "change": change}
        bound |= {"made": first, "residual": second, "recoloured": texture}
        frame = CommandList(device, timed=False)
        frame.compute("recolour", shader, bound, size)
        frame.submit()
        found[rows] = download(device, texture)[..., :3]
    return found


def row_strips(height: int, width: int) -> Iterator[slice]:
    """Return the strips of rows of a picture, few enough for a device's memory."""
    rows = max(1, _STRIP_TEXELS // width)
    return (slice(first, min(first + rows, height)) for first in range(0, height, rows))


def _rgba(colours: Pixels) -> Pixels:
    return np.pad(colours, ((0, 0), (0, 0), (0, 1)), constant_values=1.0)


def _table_texture(device: Device, model: SkinModel) -> Texture:
    layers = [_rgba(layer.astype(np.float32)) for layer in model.logs]
    texture = make_texture(device, layers[0].shape[1::-1], _FORMAT, layers=len(layers), use="map")
    for number, layer in enumerate(layers):
        upload(device, texture, layer, layer=number)
    return texture


def _program(device: Device, name: str, model: SkinModel) -> ComputeProgram:
    thirds, nodes = model.logs.shape[:2]
    numbers = {"NODES": nodes, "THIRDS": thirds, "SHADE": int(model.third == "shade"), "SIDE": _GUESS_SIDE}
    path = _FOLDER / f"{name}.wgsl"
    constants = declared(path, (), tuple(numbers.items()))
    make = partial(ComputeProgram, device, path, (), constants)
    return cached_program(device, ("unmixing", name), tuple(constants.items()), make)


def _model_record(shader: ComputeProgram, model: SkinModel, noise: float, steps: int) -> UniformRecord:
    numbers = {"usual": model.usual, "spread": model.spread, "noise": noise, "floor": skins.COLOUR_FLOOR}
    believed = {"blood": (skins.BLOOD_ROOT_MEAN, skins.BLOOD_ROOT_SD), "darkest": skins.MIN_REFLECTANCE}
    return shader.record("Model", span=model.span, steps=steps, **believed, **numbers)


_SHADING_SIDE = 256  # of the picture that is looked at
_SHADING_SIGMA = 1.0 / 24.0  # of the longer side: standard deviation of the blur


def estimate_shading(device: Device, colours: Pixels, skin: SkinParameters, noise: float) -> Pixels:
    """Return the shading of each texel (h, w), 1 on average over the skin [-].

    Each texel of a smaller picture has the brightness that its melanin and blood do not explain; its low
    frequencies are kept, weighted by how well the colour fits a skin.
    """
    small = _block_means(colours)
    made, _, residual = Unmixer(device, skin_model(skin, "shade"), noise).unmix(small)
    off = (np.log(np.maximum(residual, 1e-6)) ** 2).sum(axis=-1) / noise**2
    weight = (1.0 / (1.0 + off)) * (small.min(axis=-1) > 0.0)
    slow = _weighted_blur(made[..., 2].astype(np.float64), weight.astype(np.float64))
    mean = float((slow * weight).sum() / max(float(weight.sum()), 1e-12))
    return _upsampled(np.exp(slow - mean), (colours.shape[0], colours.shape[1]))


def _block_means(colours: Pixels) -> Pixels:
    """Return means of blocks of texels."""
    apart = max(1, max(colours.shape[:2]) // _SHADING_SIDE)
    height, width = (max(1, side // apart) for side in colours.shape[:2])
    whole = colours[: height * apart, : width * apart] if apart > 1 else colours
    rows, columns = min(apart, colours.shape[0]), min(apart, colours.shape[1])
    return np.asarray(whole.reshape(height, rows, width, columns, 3).mean(axis=(1, 3)), np.float32)


def _weighted_blur(values: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    sigma = _SHADING_SIGMA * max(values.shape)
    both = [gaussian_filter(one, sigma, mode="nearest") for one in (values * weight, weight)]
    return np.asarray(both[0] / np.maximum(both[1], 1e-6))


def _upsampled(values: NDArray[np.float64], shape: tuple[int, int]) -> Pixels:
    """Return a picture interpolated bilinearly between the centres of blocks."""
    from scipy.ndimage import map_coordinates

    found = np.empty(shape, np.float32)
    across = (np.arange(shape[1]) + 0.5) * values.shape[1] / shape[1] - 0.5
    for row in range(shape[0]):
        down = np.full(shape[1], (row + 0.5) * values.shape[0] / shape[0] - 0.5)
        found[row] = map_coordinates(values, [down, across], order=1, mode="nearest")
    return found
