"""Unmixing and recolouring of pictures on the device, in strips of rows, and estimation of their shading."""

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
    Texture,
    UniformRecord,
    cached_program,
    download,
    make_texture,
)
from dermis.gpu.program import used_constants
from dermis.gpu.textures import texture_from_array, upload
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import SkinParameters

Pixels = NDArray[np.float32]
ProgressCallback = Callable[[int, int], None]
_SHADER_FOLDER = Path(__file__).parent
_INITIAL_GUESS_GRID_SIDE = 96  # number of nodes along each side of the grid of initial guesses
_MAX_STEPS = 8
_MAX_STRIP_TEXELS = 1 << 22  # texels of a strip, of 16 bytes each in five textures
_TEXTURE_FORMAT = "rgba32float"


class Unmixer:
    """Unmixer of pictures on the device: it inverts a skin model to find each texel's melanin and blood.

    device : device on which pictures are unmixed
    model : table of skin colours that is inverted
    relative_noise : relative standard deviation of a channel [-]
    """

    def __init__(self, device: Device, model: SkinModel, relative_noise: float) -> None:
        self.device, self.model, self.noise = device, model, relative_noise
        self._table = _table_texture(device, model)
        self._outputs: tuple[Texture, Texture] | None = None
        self._guesses = device.storage_buffer(8 * _INITIAL_GUESS_GRID_SIDE**2, "initial guesses")
        shader = _unmixing_program(device, "unmix_start", model)
        frame = CommandList(device, timed=False)
        frame.compute(
            "start",
            shader,
            self._shader_bindings(shader, 0),
            (_INITIAL_GUESS_GRID_SIDE, _INITIAL_GUESS_GRID_SIDE),
        )
        frame.submit()

    def unmix(
        self, colours: Pixels, progress: ProgressCallback = lambda done, of: None
    ) -> tuple[Pixels, Pixels, Pixels]:
        """Unmix a picture; return pigments (h, w, 3), standard deviations (h, w, 2) and residual (h, w, 3).

        The pigments are melanin, blood and the extra unknown of the model; the standard deviations are those
        of melanin and blood. The residual is the colour divided by the model's colour.

        colours : (h, w, 3) diffuse reflectance, linear Rec. 709 [-]
        progress : function called with the number of finished rows and the number of all rows
        """
        height, width = colours.shape[:2]
        estimate, sd, residual = (np.empty((height, width, n), np.float32) for n in (3, 2, 3))
        for rows in row_strips(height, width):
            frame = CommandList(self.device, timed=False)
            strip = texture_from_array(
                self.device, _with_alpha_channel(colours[rows]), _TEXTURE_FORMAT, "colours"
            )
            textures = self.record(frame, strip)
            frame.submit()
            fractions, residual_and_extra = (download(self.device, texture) for texture in textures)
            estimate[rows, :, :2], sd[rows] = fractions[..., :2], fractions[..., 2:]
            estimate[rows, :, 2], residual[rows] = residual_and_extra[..., 3], residual_and_extra[..., :3]
            progress(rows.stop, height)
        return estimate, sd, residual

    def record(self, command_list: CommandList, colours: Texture) -> tuple[Texture, Texture]:
        """Record the pass that unmixes a texture of colours into two textures; return the two textures.

        The first texture has melanin, blood and their standard deviations. The second texture has the
        residual, and the extra unknown of the model (see `SkinModel`). The next call for a texture of the
        same size overwrites both.
        """
        size = colours.size[:2]
        shader = _unmixing_program(self.device, "unmix", self.model)
        if self._outputs is None or self._outputs[0].size[:2] != size:
            self._outputs = (
                make_texture(self.device, size, _TEXTURE_FORMAT),
                make_texture(self.device, size, _TEXTURE_FORMAT),
            )
        fractions, residual = self._outputs
        bound = {"colours": colours, "fractions": fractions, "residual": residual}
        command_list.compute("unmix", shader, bound | self._shader_bindings(shader, _MAX_STEPS), size)
        return fractions, residual

    def _shader_bindings(self, shader: ComputeProgram, step_count: int) -> MutableBindings:
        record = _model_uniforms(shader, self.model, self.noise, step_count)
        return {"model": record, "table": self._table, "guesses": self._guesses}


def recolour(
    device: Device,
    model: SkinModel,
    unmixed_pigments: Pixels,
    residual: Pixels,
    pigment_factors: Floats,
    added_fractions: Floats,
) -> Pixels:
    """Return the model's colours (h, w, 3) for changed pigments, multiplied by the residual.

    unmixed_pigments : (h, w, 3) melanin, blood and the model's extra unknown (see `SkinModel`) before the
        change
    residual : (h, w, 3) original colour divided by the model's colour
    pigment_factors : (3,) factors by which melanin, blood and the extra unknown are multiplied
    added_fractions : (3,) constants that are added to these products
    """
    table, shader = _table_texture(device, model), _unmixing_program(device, "recolour", model)
    change = shader.make_record("Change", factors=pigment_factors, added=added_fractions)
    output = np.empty(residual.shape, np.float32)
    for rows in row_strips(*unmixed_pigments.shape[:2]):
        maps = (_with_alpha_channel(one[rows]) for one in (unmixed_pigments, residual))
        inputs = [texture_from_array(device, one, _TEXTURE_FORMAT, "maps") for one in maps]
        size = inputs[0].size[:2]
        texture = make_texture(device, size, _TEXTURE_FORMAT)
        bound: MutableBindings = {"model": _model_uniforms(shader, model, 1.0, 0), "table": table}
        bound |= {"estimate": inputs[0], "residual": inputs[1], "recoloured": texture, "change": change}
        frame = CommandList(device, timed=False)
        frame.compute("recolour", shader, bound, size)
        frame.submit()
        output[rows] = download(device, texture)[..., :3]
    return output


def row_strips(height: int, width: int) -> Iterator[slice]:
    """Return ranges of a picture's rows, each small enough for the device's memory."""
    rows = max(1, _MAX_STRIP_TEXELS // width)
    return (slice(first, min(first + rows, height)) for first in range(0, height, rows))


def _with_alpha_channel(pixels: Pixels) -> Pixels:
    return np.pad(pixels, ((0, 0), (0, 0), (0, 1)), constant_values=1.0)


def _table_texture(device: Device, model: SkinModel) -> Texture:
    layers = [_with_alpha_channel(layer.astype(np.float32)) for layer in model.log_colours]
    texture = make_texture(
        device, layers[0].shape[1::-1], _TEXTURE_FORMAT, layer_count=len(layers), content_source="map"
    )
    for index, layer in enumerate(layers):
        upload(device, texture, layer, layer=index)
    return texture


def _unmixing_program(device: Device, shader_name: str, model: SkinModel) -> ComputeProgram:
    extra_nodes, nodes = model.log_colours.shape[:2]
    numbers = {
        "NODES": nodes,
        "EXTRA_NODES": extra_nodes,
        "SHADE": int(model.extra_unknown == "shade"),
        "SIDE": _INITIAL_GUESS_GRID_SIDE,
    }
    path = _SHADER_FOLDER / f"{shader_name}.wgsl"
    constants = used_constants(path, (), tuple(numbers.items()))
    make = partial(ComputeProgram, device, path, (), constants)
    return cached_program(device, ("unmixing", shader_name), tuple(constants.items()), make)


def _model_uniforms(
    shader: ComputeProgram, model: SkinModel, relative_noise: float, step_count: int
) -> UniformRecord:
    priors = {"prior_mean": model.prior_mean, "prior_sd": model.prior_sd}
    priors |= {"blood_mean": skins.BLOOD_ROOT_MEAN, "blood_sd": skins.BLOOD_ROOT_SD}
    limits = {"floor": skins.COLOUR_FLOOR, "min_reflectance": skins.MIN_REFLECTANCE}
    numbers = {"extra_range": model.extra_range, "noise": relative_noise, "steps": step_count}
    return shader.make_record("Model", **numbers, **priors, **limits)


_SHADING_MAP_SIDE = 256  # longer side of the downsampled picture [texel]
_RELATIVE_SHADING_BLUR = 1.0 / 24.0  # standard deviation of the blur, relative to the longer side


def estimate_shading(device: Device, colours: Pixels, skin: SkinParameters, relative_noise: float) -> Pixels:
    """Return the low-frequency shading of each texel (h, w), with mean 1 over the skin [-].

    In a downsampled picture, shading is the part of the brightness that melanin and blood do not explain. It
    is then low-pass filtered, with larger weights for texels whose colour is close to a skin colour.

    colours : (h, w, 3) diffuse reflectance times shading, linear Rec. 709
    skin : parameters of the skin other than melanin and blood
    relative_noise : relative standard deviation of a channel [-]
    """
    small = _block_means(colours)
    estimate, _, residual = Unmixer(device, skin_model(skin, "shade"), relative_noise).unmix(small)
    misfit = (np.log(np.maximum(residual, 1e-6)) ** 2).sum(axis=-1) / relative_noise**2
    weight = (1.0 / (1.0 + misfit)) * (small.min(axis=-1) > 0.0)
    smooth = _weighted_blur(estimate[..., 2].astype(np.float64), weight.astype(np.float64))
    mean = float((smooth * weight).sum() / max(float(weight.sum()), 1e-12))
    return _upsample(np.exp(smooth - mean), (colours.shape[0], colours.shape[1]))


def _block_means(colours: Pixels) -> Pixels:
    """Return a picture reduced by averaging over blocks, to about 256 texels along its longer side."""
    block = max(1, max(colours.shape[:2]) // _SHADING_MAP_SIDE)
    height, width = (max(1, side // block) for side in colours.shape[:2])
    cropped = colours[: height * block, : width * block] if block > 1 else colours
    rows, columns = min(block, colours.shape[0]), min(block, colours.shape[1])
    return np.asarray(cropped.reshape(height, rows, width, columns, 3).mean(axis=(1, 3)), np.float32)


def _weighted_blur(
    block_means: NDArray[np.float64], block_weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    sigma = _RELATIVE_SHADING_BLUR * max(block_means.shape)
    blurred = [
        gaussian_filter(one, sigma, mode="nearest") for one in (block_means * block_weights, block_weights)
    ]
    return np.asarray(blurred[0] / np.maximum(blurred[1], 1e-6))


def _upsample(block_means: NDArray[np.float64], picture_shape: tuple[int, int]) -> Pixels:
    """Interpolate block means bilinearly; return a picture of the given height and width."""
    from scipy.ndimage import map_coordinates

    output = np.empty(picture_shape, np.float32)
    across = (np.arange(picture_shape[1]) + 0.5) * block_means.shape[1] / picture_shape[1] - 0.5
    for row in range(picture_shape[0]):
        down = np.full(picture_shape[1], (row + 0.5) * block_means.shape[0] / picture_shape[0] - 0.5)
        output[row] = map_coordinates(block_means, [down, across], order=1, mode="nearest")
    return output
