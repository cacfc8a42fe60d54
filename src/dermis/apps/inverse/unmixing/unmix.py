"""Melanin and blood of a picture of skin colour, recolouring, and their files."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.inverse.unmixing.device_unmixer import Unmixer, recolour, estimate_shading
from dermis.apps.inverse.unmixing.skin_model import SkinModel, ThirdUnknown, skin_model
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.base.quantities import checked_number
from dermis.formats.maps import colour_map
from dermis.gpu import Device
from dermis.gpu.failures import LazyDevice
from dermis.images.colour import delta_e_2000
from dermis.images.hdr import encode_exr
from dermis.images.io import EmbeddedPicture, write_image
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters

Pixels = NDArray[np.float32]
DEFAULT_NOISE = 0.01
MAX_SKIN_DELTA_E = 5.0
"""CIEDE2000 from the model's nearest colour up to which a texel counts as skin."""
_DELTA_E_LIMITS = 1.0, 2.0, MAX_SKIN_DELTA_E
_SUMMARY_SIDE = 512  # texels along the longer side, for the table
_NOISE_RANGE = 1e-4, 0.5
_BLACK_LEVEL = 1e-3  # as between the charts of a map
_MAX_LOG_RESIDUAL = 0.15  # largest logarithm of a residual that counts for medians
_FACTOR_RANGE = 0.0, 100.0


@dataclass(frozen=True)
class FractionChange:
    """Change of a map of shares: a factor, or another median.

    A larger median adds a constant, because a factor would multiply the noise of pale skin; a smaller one
    multiplies.
    """

    factor: float = 1.0
    median: float | None = None

    def over(self, median: float) -> tuple[float, float]:
        """Return the factor for a map of this median, and the constant that is then added."""
        if self.median is None:
            return self.factor, 0.0
        if self.median < median:
            return self.median / median, 0.0
        return 1.0, self.median - median


@dataclass(frozen=True)
class PigmentChange:
    """Change of the pigments of a skin; None keeps one.

    oxygen, eumelanin : shares, as of `SkinParameters` [-]
    """

    melanin: FractionChange = FractionChange()
    blood: FractionChange = FractionChange()
    oxygen: float | None = None
    eumelanin: float | None = None

    def of(self, skin: SkinParameters) -> SkinParameters:
        """Return a skin with the given oxygen and eumelanin."""
        given = {name: getattr(self, name) for name in ("oxygen", "eumelanin")}
        return replace(skin, **{name: one for name, one in given.items() if one is not None})

    def over(self, melanin: float, blood: float) -> tuple[Floats, Floats]:
        """Return factors and constants for melanin, blood and the third number of maps of these medians."""
        factors, added = zip(self.melanin.over(melanin), self.blood.over(blood), (1.0, 0.0), strict=True)
        return np.array(factors), np.array(added)


def parse_fraction_change(option: str, words: str) -> FractionChange:
    """Parse x2 as a factor, 0.1 as a median.

    Raises DermisError for anything else.
    """
    factor = words[:1] in "x×*" and bool(words)
    try:
        value = float(words[1:] if factor else words)
    except ValueError:
        refuse(option, "a factor, such as x2, or a median, such as 0.1", f"got {words!r}", "Correct it")
    if factor:
        return FractionChange(factor=checked_number(option, value, *_FACTOR_RANGE, "a factor"))
    return FractionChange(median=checked_number(option, value, 0.0, 1.0, "a share of the volume"))


@dataclass(frozen=True, eq=False)
class UnmixResult:
    """Pigments of a picture of skin. All maps are (h, w), row 0 at the top.

    melanin, blood : shares of the volume of epidermis and dermis [-]
    melanin_sd, blood_sd : standard deviations that noise leaves at least, by the Cramér-Rao bound [-]
    third : oxygen, the share of haemoglobin that carries it, where it was requested [-]
    shading : (h, w) shading by which the colours were divided, where it was requested [-]
    residual : (h, w, 3) colour divided by that of the model: paint, hair, and all else that is no skin [-]
    devices : that the skin was computed on, by requested adapter; they stay open
    """

    melanin: Pixels
    blood: Pixels
    melanin_sd: Pixels
    blood_sd: Pixels
    residual: Pixels
    third: Pixels | None
    shading: Pixels | None
    skin: SkinParameters
    model: SkinModel
    devices: dict[str, LazyDevice] = field(default_factory=dict)

    def maps(self) -> dict[str, Pixels]:
        """Return the maps that exist, by the names of their files."""
        names = "melanin", "blood", "melanin_sd", "blood_sd", "residual"
        named = {name: getattr(self, name) for name in names}
        further = {"oxygen": self.third, "shading": self.shading}
        return named | {name: one for name, one in further.items() if one is not None}

    def summary(self) -> dict[str, Any]:
        """Return medians over the skin, errors of the reconstruction, and the share of skin.

        Of every n-th texel, so that 512 are taken along the longer side; black is no skin.
        """
        apart = max(1, max(self.melanin.shape) // _SUMMARY_SIDE)
        maps = {name: one[::apart, ::apart].astype(np.float64) for name, one in self.maps().items()}
        shares = {name: maps[name].ravel() for name in ("melanin", "blood", "oxygen") if name in maps}
        back = self.model.colours(shares["melanin"], shares["blood"], shares.get("oxygen"))
        colours = back * maps["residual"].reshape(-1, 3)
        off = delta_e_2000(back, colours)
        skin = (off <= MAX_SKIN_DELTA_E) & (colours.max(axis=-1) > _BLACK_LEVEL)
        found: dict[str, Any] = {"texels": int(off.size), "skin": float(skin.mean())}
        if skin.any():
            above = {f"above_{limit:g}": float((off > limit).mean()) for limit in _DELTA_E_LIMITS}
            found["delta_e"] = _percentiles(off[skin]) | above
            for name, share in shares.items():
                sd = {"sd": float(np.median(maps[f"{name}_sd"].ravel()[skin]))} if name != "oxygen" else {}
                found[name] = _percentiles(share[skin]) | sd
        return found

    def recoloured(self, change: PigmentChange = PigmentChange(), adapter: str = "auto") -> Pixels:
        """Return the colours (h, w, 3), linear Rec. 709, of the same skin with other pigments.

        The residual stays, as does shading that was not removed.

        Raises DermisError as `dermis.gpu.open_device`.
        """
        kept = self.devices.setdefault(adapter, LazyDevice(adapter))
        return kept.run(lambda device: self._recoloured(device, change))

    def _recoloured(self, device: Device, change: PigmentChange) -> Pixels:
        fixed = self.third is None or change.oxygen is not None
        target = skin_model(change.of(self.skin), "none") if fixed else self.model
        usual = np.broadcast_to(np.float32(target.usual), self.melanin.shape)
        third = usual if fixed or self.third is None else self.third
        made = np.stack([self.melanin, self.blood, third], axis=-1)
        factors, added = change.over(self._median(self.melanin), self._median(self.blood))
        return recolour(device, target, made, self.residual, factors, added)

    def skin_texels(self) -> NDArray[np.bool_]:
        """Return a mask (h, w) of texels whose colour is near one of the model's."""
        return np.asarray(np.abs(np.log(np.maximum(self.residual, _BLACK_LEVEL))).max(axis=-1) < _MAX_LOG_RESIDUAL)

    def _median(self, share: Pixels) -> float:
        """Return the median over the skin."""
        skin = self.skin_texels()
        return float(np.median(share[skin] if skin.any() else share))


def _percentiles(values: Floats) -> dict[str, float]:
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0))
    return {"p5": float(low), "median": float(middle), "p95": float(high)}


def unmix(
    picture: str | Path | EmbeddedPicture | ArrayLike,
    *,
    skin: SkinParameters = DEFAULT_SKIN,
    third: ThirdUnknown = "none",
    noise: float = DEFAULT_NOISE,
    shading: bool = False,
    adapter: str = "auto",
    told: Callable[[int, int], None] = lambda done, of: None,
) -> UnmixResult:
    """Return melanin and blood of a picture of skin colour: an albedo map of a scan or by an artist.

    picture : a file (PNG or JPEG in sRGB, EXR linear), or (h, w, 3) diffuse reflectance, linear Rec. 709
    skin : of the model; its melanin and blood are ignored, its thickness, eumelanin and oxygen are held
    third : "oxygen" finds that too, as far as colour and what is usual tell: 0.1 of standard deviation around
        the skin's own; "none" holds it
    noise : standard deviation of a channel, relative [-]
    shading : whether to estimate low-frequency shading, and divide by it
    told : how many rows are done of how many

    Raises DermisError for what is no picture of colours, numbers that cannot be, and as
    `dermis.gpu.open_device`.
    """
    noise = checked_number("noise", noise, *_NOISE_RANGE, "relative to each channel")
    model = skin_model(skin, third)
    if third == "shade":
        refuse("third", '"none" or "oxygen"', "got 'shade'", "Set shading=True instead")
    colours = colour_map(picture) if isinstance(picture, str | Path | EmbeddedPicture) else _checked_colours(picture)

    def job(device: Device) -> UnmixResult:
        light = estimate_shading(device, colours, skin, noise) if shading else None
        even = colours if light is None else colours / light[..., None]
        made, sd, residual = Unmixer(device, model, noise).unmix(even, told)
        found = made[..., 2] if third == "oxygen" else None
        maps = (made[..., 0], made[..., 1], sd[..., 0], sd[..., 1])
        return UnmixResult(*maps, residual, found, light, skin, model, {adapter: kept})

    kept = LazyDevice(adapter)
    return kept.run(job)


def _checked_colours(colours: ArrayLike) -> Pixels:
    found = np.asarray(colours)
    if found.ndim != 3 or found.shape[2] != 3 or not found.size or found.dtype.kind != "f":
        actual = f"got shape {found.shape} and type {found.dtype}"
        advice = "Decode sRGB first, or give the file's name"
        refuse("colours", "floats (h, w, 3), linear Rec. 709", actual, advice)
    if not (np.isfinite(found).all() and found.min() >= 0.0 and found.max() <= 1.0):
        refuse("colours", "reflectances from 0 to 1", "some are outside, or no numbers", "Scale them")
    return found.astype(np.float32, copy=False)


SUMMARY = "unmixed.json"


def save_maps(
    folder: Path, found: UnmixResult, recoloured: NDArray[np.float32] | None = None, linear: bool = False
) -> list[Path]:
    """Write each map as EXR, the summary, and the recoloured picture if any; each file whole or not at all.

    linear : whether the recoloured picture is written as EXR rather than PNG

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = []
    for name, values in found.maps().items():
        path = folder / f"{name}.exr"
        with atomic_file(path) as trial:
            trial.write_bytes(encode_exr(values if values.ndim == 3 else values[..., None]))
        written.append(path)
    if recoloured is not None:
        path = folder / ("recoloured.exr" if linear else "recoloured.png")
        write_image(path, recoloured)
        written.append(path)
    with atomic_file(folder / SUMMARY) as trial:
        trial.write_text(json.dumps(found.summary(), indent=2) + "\n", encoding="utf-8")
    return [*written, folder / SUMMARY]
