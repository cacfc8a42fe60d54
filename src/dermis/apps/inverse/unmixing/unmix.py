"""Unmixing of a picture of skin into melanin and blood, recolouring, and files of the results."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.inverse.unmixing.device_unmixer import Unmixer, estimate_shading, recolour
from dermis.apps.inverse.unmixing.skin_model import ExtraUnknown, SkinModel, skin_model
from dermis.apps.inverse.unmixing.unknown_skin import sd_from_assumed_parameters
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.base.quantities import checked_number
from dermis.base.renamed import renamed_attribute, renamed_keywords, successor
from dermis.formats.maps import colour_map
from dermis.gpu import Device
from dermis.gpu.failures import LazyDevice
from dermis.images.colour import delta_e_2000
from dermis.images.hdr import encode_exr
from dermis.images.io import EmbeddedPicture, write_image
from dermis.images.skin_tone import skin_tone
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters

Pixels = NDArray[np.float32]
DEFAULT_NOISE = 0.01
MAX_SKIN_DELTA_E = 5.0
"""Largest CIEDE2000 difference from the model's nearest colour at which a texel counts as skin."""
_REPORTED_DELTA_E_LIMITS = 1.0, 2.0, MAX_SKIN_DELTA_E
_SUMMARY_SIDE_TEXELS = 512  # largest number of texels along the longer side that the summary reads
_RELATIVE_NOISE_RANGE = 1e-4, 0.5
_MAX_BACKGROUND_CHANNEL = 1e-3  # largest channel of texels between the charts of a map
_MAX_LOG_RESIDUAL = 0.15  # largest logarithm of the residual of a skin texel
_RECOLOUR_FACTOR_RANGE = 0.0, 100.0


@dataclass(frozen=True)
class FractionChange:
    """Change of a map of volume fractions, by a factor or to a given median.

    For a larger median, a constant is added to the map, because a factor would amplify the noise of pale
    skin. For a smaller median, the map is multiplied by a factor.

    factor : factor of all fractions; only used if `median` is None [-]
    median : median of the map after the change; None to use `factor` [-]
    """

    factor: float = 1.0
    median: float | None = None

    def scale_and_offset(self, map_median: float) -> tuple[float, float]:
        """Return the factor and the constant of this change: the new map is factor * map + constant.

        map_median : median of the map before the change [-]
        """
        if self.median is None:
            return self.factor, 0.0
        if self.median < map_median:
            return self.median / map_median, 0.0
        return 1.0, self.median - map_median


@dataclass(frozen=True)
class PigmentChange:
    """Change of a skin's pigments, for recolouring.

    melanin, blood : factor or new median of the map of each pigment, see `FractionChange`
    oxygen, eumelanin : new values of these parameters of `SkinParameters`; None for no change [-]
    """

    melanin: FractionChange = FractionChange()
    blood: FractionChange = FractionChange()
    oxygen: float | None = None
    eumelanin: float | None = None

    def applied_to(self, skin: SkinParameters) -> SkinParameters:
        """Return the skin parameters with the new fractions of oxygen and eumelanin."""
        changed = {name: getattr(self, name) for name in ("oxygen", "eumelanin")}
        return replace(skin, **{name: one for name, one in changed.items() if one is not None})

    def scales_and_offsets(self, melanin: float, blood: float) -> tuple[Floats, Floats]:
        """Return the factors (3,) and constants (3,) of this change: each new map is factor * map + constant.

        The maps are those of melanin, of blood and of the extra unknown of a `SkinModel`, such as oxygen. The
        last map keeps its values, so its factor is 1 and its constant is 0.

        melanin, blood : medians of the maps of melanin and blood before the change [-]
        """
        pairs = self.melanin.scale_and_offset(melanin), self.blood.scale_and_offset(blood), (1.0, 0.0)
        factors, added = np.array(pairs).T
        return factors, added


def parse_fraction_change(option_name: str, option_text: str) -> FractionChange:
    """Parse an option's text: "x2" multiplies a map of fractions by 2, "0.1" sets its median to 0.1.

    Raises DermisError for any other text.
    """
    is_factor = option_text[:1] in "x×*" and bool(option_text)
    try:
        value = float(option_text[1:] if is_factor else option_text)
    except ValueError:
        refuse(
            option_name,
            "a factor, such as x2, or a median, such as 0.1",
            f"got {option_text!r}",
            "Correct it",
        )
    if is_factor:
        return FractionChange(factor=checked_number(option_name, value, *_RECOLOUR_FACTOR_RANGE, "a factor"))
    return FractionChange(median=checked_number(option_name, value, 0.0, 1.0, "a volume fraction"))


@dataclass(frozen=True, eq=False)
class UnmixResult:
    """Pigment maps of a picture of skin, as found by `dermis.unmix`; row 0 of each map is at the top.

    melanin : (h, w) volume fraction of melanosomes in the epidermis [-]
    blood : (h, w) volume fraction of blood in the dermis [-]
    melanin_sd, blood_sd : (h, w) lower bounds of the standard deviations of melanin and blood that are due to
        noise (Cramér-Rao bound) [-]
    residual : (h, w, 3) colour divided by the model's colour; it differs from 1 where the picture shows
        something other than skin, such as paint or hair [-]
    oxygen : (h, w) oxygenated fraction of haemoglobin; None if it was not requested [-]
    shading : (h, w) shading by which the colours were divided; None if it was not requested [-]
    skin : parameters of the model's skins other than melanin and blood
    model : model of skin colours
    devices : dictionary from requested adapter to the device used for it; the devices stay open
    """

    melanin: Pixels
    blood: Pixels
    melanin_sd: Pixels
    blood_sd: Pixels
    residual: Pixels
    oxygen: Pixels | None
    shading: Pixels | None
    skin: SkinParameters
    model: SkinModel
    devices: dict[str, LazyDevice] = field(default_factory=dict)
    third = renamed_attribute("third", "oxygen")

    def maps(self) -> dict[str, Pixels]:
        """Return all maps that were computed, as a dictionary from file name without suffix to map."""
        names = "melanin", "blood", "melanin_sd", "blood_sd", "residual"
        named = {name: getattr(self, name) for name in names}
        optional = {"oxygen": self.oxygen, "shading": self.shading}
        return named | {name: one for name, one in optional.items() if one is not None}

    def summary(self) -> dict[str, Any]:
        """Return statistics of the pigments and of the colour error, the skin tone, and the fraction of skin.

        The colour error is the CIEDE2000 difference between the picture's colour and the model's colour for
        the estimated pigments. All results are computed from a grid of texels, with about 512 texels along
        the longer side. Black texels do not count as skin. The entry "sd" is the standard deviation
        due to noise, and "skin_sd" is that due to the values assumed for oxygen and epidermal thickness,
        which vary among people.
        """
        step = max(1, max(self.melanin.shape) // _SUMMARY_SIDE_TEXELS)
        maps = {name: one[::step, ::step].astype(np.float64) for name, one in self.maps().items()}
        fractions = {name: maps[name].ravel() for name in ("melanin", "blood", "oxygen") if name in maps}
        model_colours = self.model.colours(fractions["melanin"], fractions["blood"], fractions.get("oxygen"))
        colours = model_colours * maps["residual"].reshape(-1, 3)
        delta_e = delta_e_2000(model_colours, colours)
        skin = (delta_e <= MAX_SKIN_DELTA_E) & (colours.max(axis=-1) > _MAX_BACKGROUND_CHANNEL)
        result: dict[str, Any] = {"texels": int(delta_e.size), "skin": float(skin.mean())}
        if skin.any():
            above = {
                f"above_{limit:g}": float((delta_e > limit).mean()) for limit in _REPORTED_DELTA_E_LIMITS
            }
            result["delta_e"] = _percentile_summary(delta_e[skin]) | above
            result["skin_tone"] = skin_tone(np.median(colours[skin], axis=0)).as_json()
            for name, fraction in fractions.items():
                sd = {"sd": float(np.median(maps[f"{name}_sd"].ravel()[skin]))} if name != "oxygen" else {}
                result[name] = _percentile_summary(fraction[skin]) | sd
            median = {name: result[name]["median"] for name in ("melanin", "blood")}
            found = self.oxygen is not None
            spread = sd_from_assumed_parameters(**median, skin=self.skin, is_oxygen_fitted=found)
            for pigment, relative in spread.items():
                result[pigment]["skin_sd"] = relative * median[pigment]
        return result

    def recoloured(self, change: PigmentChange = PigmentChange(), adapter: str = "auto") -> Pixels:
        """Return the colours (h, w, 3) of this skin with changed pigments, linear Rec. 709.

        The residual is kept. Shading is kept too, unless `dermis.unmix` removed it.

        change : change of the pigments
        adapter : "auto", "cpu" or part of an adapter's name

        Raises DermisError when `dermis.gpu.open_device` does.
        """
        lazy_device = self.devices.setdefault(adapter, LazyDevice(adapter))
        return lazy_device.run(lambda device: self._recolour_on_device(device, change))

    def _recolour_on_device(self, device: Device, pigment_change: PigmentChange) -> Pixels:
        fixed = self.oxygen is None or pigment_change.oxygen is not None
        target = skin_model(pigment_change.applied_to(self.skin), "none") if fixed else self.model
        prior_mean = np.broadcast_to(np.float32(target.prior_mean), self.melanin.shape)
        extra_value = prior_mean if fixed or self.oxygen is None else self.oxygen
        estimate = np.stack([self.melanin, self.blood, extra_value], axis=-1)
        factors, added = pigment_change.scales_and_offsets(
            self._skin_median(self.melanin), self._skin_median(self.blood)
        )
        return recolour(device, target, estimate, self.residual, factors, added)

    def skin_texels(self) -> NDArray[np.bool_]:
        """Return the mask (h, w) of texels whose colour is close to a colour of the model."""
        logs = np.log(np.maximum(self.residual, _MAX_BACKGROUND_CHANNEL))
        return np.asarray(np.abs(logs).max(axis=-1) < _MAX_LOG_RESIDUAL)

    def _skin_median(self, fraction_map: Pixels) -> float:
        """Return the median of a map over the skin texels, or over all texels if none is skin."""
        skin = self.skin_texels()
        return float(np.median(fraction_map[skin] if skin.any() else fraction_map))


def _percentile_summary(texel_values: Floats) -> dict[str, float]:
    low, middle, high = np.percentile(texel_values, (5.0, 50.0, 95.0))
    return {"p5": float(low), "median": float(middle), "p95": float(high)}


@renamed_keywords(third="extra_unknown")
def unmix(
    picture: str | Path | EmbeddedPicture | ArrayLike,
    *,
    skin: SkinParameters = DEFAULT_SKIN,
    extra_unknown: ExtraUnknown = "none",
    noise: float = DEFAULT_NOISE,
    shading: bool = False,
    adapter: str = "auto",
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> UnmixResult:
    """Estimate melanin and blood in each texel of a picture of skin, such as the albedo map of a scan.

    Parameters
    ----------
    picture : str, Path, EmbeddedPicture or array_like
        File (PNG, JPEG, HEIC, EXR and others), or (h, w, 3) diffuse reflectance in linear Rec. 709 [-].
    skin : SkinParameters
        Epidermal thickness, eumelanin fraction and oxygenation that are assumed for all texels. Its melanin
        and blood are ignored, because they are estimated.
    extra_unknown : {"none", "oxygen"}
        "oxygen" also estimates the oxygenated fraction of haemoglobin; the mean of its prior is the fraction
        in `skin`, and the standard deviation is that among measured people. "none" keeps the fraction in
        `skin`.
    noise : float
        Standard deviation of the noise in each colour channel, relative to its value [-].
    shading : bool
        Whether to estimate low-frequency shading, and to divide the picture by this shading.
    adapter : str
        "auto", "cpu" or part of an adapter's name.
    progress : callable
        Function called with the number of finished rows and the number of all rows.

    Returns
    -------
    UnmixResult
        Maps of the pigments, their uncertainties and the residual.

    Raises
    ------
    DermisError
        For files and arrays that are not colour pictures, for numbers out of range, and when
        `dermis.gpu.open_device` raises it.

    References
    ----------
    [DonnerJensen2006] for the pigments; docs/fit.md for the method and its accuracy.

    Examples
    --------
    >>> import dermis
    >>> found = dermis.unmix([[[0.55, 0.33, 0.25]]], adapter="cpu")  # doctest: +SKIP
    >>> found.melanin.shape  # doctest: +SKIP
    (1, 1)
    """
    noise = checked_number("noise", noise, *_RELATIVE_NOISE_RANGE, "relative to each channel")
    model = skin_model(skin, extra_unknown)
    if extra_unknown == "shade":
        refuse("extra_unknown", '"none" or "oxygen"', "got 'shade'", "Set shading=True instead")
    if isinstance(picture, str | Path | EmbeddedPicture):
        colours = colour_map(picture, apply_exif_orientation=True)
    else:
        colours = _checked_colours(picture)

    def run_on_device(device: Device) -> UnmixResult:
        light = estimate_shading(device, colours, skin, noise) if shading else None
        unshaded = colours if light is None else colours / light[..., None]
        estimate, sd, residual = Unmixer(device, model, noise).unmix(unshaded, progress)
        oxygen = estimate[..., 2] if extra_unknown == "oxygen" else None
        maps = (estimate[..., 0], estimate[..., 1], sd[..., 0], sd[..., 1])
        return UnmixResult(*maps, residual, oxygen, light, skin, model, {adapter: lazy_device})

    lazy_device = LazyDevice(adapter)
    return lazy_device.run(run_on_device)


def _checked_colours(colours: ArrayLike) -> Pixels:
    result = np.asarray(colours)
    if result.ndim != 3 or result.shape[2] != 3 or not result.size or result.dtype.kind != "f":
        actual = f"got shape {result.shape} and type {result.dtype}"
        advice = "Decode sRGB first, or give the file's name"
        refuse("colours", "floats (h, w, 3), linear Rec. 709", actual, advice)
    if not (np.isfinite(result).all() and result.min() >= 0.0 and result.max() <= 1.0):
        refuse("colours", "reflectances from 0 to 1", "some are outside or not finite", "Scale them")
    return result.astype(np.float32, copy=False)


UNMIX_SUMMARY_FILE = "unmixed.json"


def save_maps(
    folder: Path,
    unmix_result: UnmixResult,
    recoloured_picture: NDArray[np.float32] | None = None,
    linear: bool = False,
) -> list[Path]:
    """Write all maps as EXR files, the summary, and the recoloured picture; return the paths of all files.

    Each file is written atomically.

    recoloured_picture : (h, w, 3) recoloured picture in linear Rec. 709; None to write no such picture
    linear : whether the recoloured picture is written as EXR instead of PNG

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = []
    for name, values in unmix_result.maps().items():
        path = folder / f"{name}.exr"
        with atomic_file(path) as file:
            file.write_bytes(encode_exr(values if values.ndim == 3 else values[..., None]))
        written.append(path)
    if recoloured_picture is not None:
        path = folder / ("recoloured.exr" if linear else "recoloured.png")
        write_image(path, recoloured_picture)
        written.append(path)
    with atomic_file(folder / UNMIX_SUMMARY_FILE) as file:
        file.write_text(json.dumps(unmix_result.summary(), indent=2) + "\n", encoding="utf-8")
    return [*written, folder / UNMIX_SUMMARY_FILE]


def __getattr__(name: str) -> Any:
    """Return an object of this module by the name that it had in the last release, for compatibility."""
    if new := successor(__name__, name):
        return globals()[new]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
