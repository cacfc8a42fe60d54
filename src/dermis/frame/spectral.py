"""Spectral pictures: three wavelengths at a time take the place of red, green and blue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_array, checked_number
from dermis.base.summary import ShortRepr
from dermis.frame.renderer import Renderer
from dermis.images.colour import XYZ_OF_REC709
from dermis.images.colour_spaces import BRADFORD_MATRIX
from dermis.optics.bands import Bands, rgb_spectra
from dermis.optics.lamps import (
    band_power,
    read_sensitivities,
    seen_wavelengths,
    sensor_weights,
    xyz_weights,
)
from dermis.optics.pigments.spectra import (
    LONGEST_WAVELENGTH_NM,
    SHORTEST_WAVELENGTH_NM,
    WAVELENGTHS_NM,
    rgb_weights,
)
from dermis.scene.conversions import as_model
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

FIRST_BAND_NM, BAND_NM = 400.0, 10.0
MAX_BANDS = 61
"""Largest number of bands of 10 nm: from 400 to 1,000 nm."""
_CHANNELS = 3
_MAX_COLOUR_STEP_NM = 20.0  # largest distance of wavelengths from which colours are computed


@dataclass(frozen=True, eq=False, repr=False)
class SpectralPicture(ShortRepr):
    """Picture with a spectrum in each pixel, for light whose power is the same at all wavelengths.

    Parameters
    ----------
    wavelengths_nm : ndarray
        (n,) wavelengths [nm].
    reflected : ndarray
        (h, w, n) float32 radiance after exposure, if white light has the power 1 at each wavelength [-].
    alpha : ndarray
        (h, w) coverage by the head; `reflected` is premultiplied by it [-].
    rgb : ndarray
        (h, w, 3) the picture in red, green and blue, without background, for comparison.
    backdrop : ndarray, optional
        (h, w, 3) light of the background in linear Rec. 709; None for the background "none".
    exposure : float
        Factor from radiance to the values of the picture [-].

    Examples
    --------
    >>> import dermis
    >>> import numpy as np
    >>> wavelengths = np.arange(400.0, 701.0, 10.0)
    >>> white, alpha = np.ones((1, 1, 31), np.float32), np.ones((1, 1), np.float32)
    >>> picture = dermis.SpectralPicture(wavelengths, white, alpha, white[..., :3], None, 1.0)
    >>> picture.linear("FL11").round(3).tolist()
    [[[1.0, 1.0, 1.0]]]
    """

    wavelengths_nm: Doubles
    reflected: Floats
    alpha: Floats
    rgb: Floats
    backdrop: Floats | None
    exposure: float

    def radiance(self, lamp: str | Path = "D65") -> Floats:
        """Return the radiance (h, w, n) in the light of a lamp, relative to the power of D65 at 560 nm.

        Parameters
        ----------
        lamp : str or Path
            "D65", "A", "FL11", "LED-B3", "E", or a CSV file of wavelength [nm] and relative power. All lamps
            have the same luminance. Lights that are not white filter the light of the lamp.

        Returns
        -------
        ndarray
            (h, w, n) radiance at the wavelengths, without the background. The power of the lamp is the mean
            over a triangular band of 10 nm.

        Raises
        ------
        DermisError
            For wavelengths at which the power of the lamp is not known.
        """
        return np.asarray(self.reflected * band_power(lamp, self.wavelengths_nm), np.float32)

    def linear(self, lamp: str | Path = "D65") -> Floats:
        """Return the picture in the light of a lamp for an eye that is adapted to it.

        Parameters
        ----------
        lamp : str or Path
            Lamp as in `radiance`.

        Returns
        -------
        ndarray
            (h, w, 3) linear Rec. 709 with background; white skin in white light is white.

        Raises
        ------
        DermisError
            For spectra that do not cover visible light in steps of at most 20 nm.
        """
        self._check_covers(WAVELENGTHS_NM[0], WAVELENGTHS_NM[-1])
        return self._with_backdrop(colour_weights(lamp, self.wavelengths_nm))

    def camera(self, sensitivities: str | Path, lamp: str | Path = "D65") -> Floats:
        """Return the signals of a camera, balanced so that white has the signals 1.

        Parameters
        ----------
        sensitivities : str or Path
            CSV file of wavelength [nm] and the sensitivities of red, green and blue.
        lamp : str or Path
            Lamp as in `radiance`.

        Returns
        -------
        ndarray
            (h, w, 3) linear signals with background.

        Raises
        ------
        DermisError
            For invalid files, and for spectra that do not cover the sensitivities.
        """
        grid, response = read_sensitivities(sensitivities, lamp)
        seen = seen_wavelengths(grid, response)
        self._check_covers(max(seen[0], WAVELENGTHS_NM[0]), seen[-1])
        return self._with_backdrop(sensor_weights(lamp, grid, response, self.wavelengths_nm))

    def _with_backdrop(self, weights: Doubles) -> Floats:
        """Return signals (h, w, 3) for weights (3, n) of the spectra, with the background."""
        picture = self.reflected @ weights.T.astype(np.float32)
        if self.backdrop is not None:
            picture += self.backdrop @ (weights @ rgb_spectra(self.wavelengths_nm)).T.astype(np.float32)
        return np.asarray(picture, np.float32)

    @property
    def covers_visible_light(self) -> bool:
        """Return whether colours can be computed: from 400 to 700 nm in steps of at most 20 nm."""
        return self._covers(WAVELENGTHS_NM[0], WAVELENGTHS_NM[-1])

    def _covers(self, low_nm: float, high_nm: float) -> bool:
        wavelengths, margin = self.wavelengths_nm, 0.5 * _MAX_COLOUR_STEP_NM
        gap = np.diff(np.clip(wavelengths, low_nm, high_nm)).max(initial=0.0)
        reaches = wavelengths[0] <= low_nm + margin and wavelengths[-1] >= high_nm - margin
        return bool(reaches and gap <= _MAX_COLOUR_STEP_NM)

    def _check_covers(self, low_nm: float, high_nm: float) -> None:
        if self._covers(low_nm, high_nm):
            return
        wavelengths = self.wavelengths_nm
        expected = f"spectra from {low_nm:g} to {high_nm:g} nm in steps of at most {_MAX_COLOUR_STEP_NM:g} nm"
        actual = f"got {len(wavelengths)} wavelengths from {wavelengths[0]:g} to {wavelengths[-1]:g} nm"
        refuse("colours", expected, actual, f"Render {len(WAVELENGTHS_NM)} bands, or {MAX_BANDS} to 1,000 nm")


def colour_weights(lamp: str | Path, wavelength_nm: Doubles) -> Doubles:
    """Return weights (3, n) from reflectance spectra, lit by a lamp, to linear Rec. 709 [-].

    White in the light of the lamp becomes white, by the adaptation of Bradford.

    lamp : lamp as in `SpectralPicture.radiance`
    wavelength_nm : (n,) wavelengths of the spectra, increasing [nm]
    """
    if lamp == "D65":
        return rgb_weights(wavelength_nm)
    xyz = xyz_weights(lamp, wavelength_nm)
    cones, white = BRADFORD_MATRIX @ xyz, BRADFORD_MATRIX @ XYZ_OF_REC709.sum(axis=1)
    adapted = cones * (white / cones.sum(axis=1))[:, None]
    return np.asarray(np.linalg.solve(BRADFORD_MATRIX @ XYZ_OF_REC709, adapted), np.float64)


def band_wavelengths(bands: int | Sequence[float]) -> Doubles:
    """Return the wavelengths (n,) of bands of 10 nm from 400 nm on, or the given wavelengths [nm].

    Raises DermisError for more than 61 bands, and for wavelengths that do not increase from 380 to 1,000 nm.
    """
    if isinstance(bands, int):
        count = int(checked_number("spectral", bands, 1, MAX_BANDS, "bands of 10 nm from 400 nm"))
        return np.asarray(FIRST_BAND_NM + BAND_NM * np.arange(count), np.float64)
    ends = SHORTEST_WAVELENGTH_NM, LONGEST_WAVELENGTH_NM
    wavelengths: Doubles = checked_array("spectral", bands, (0,), *ends, "wavelengths in nm")
    if len(wavelengths) == 0 or (np.diff(wavelengths) <= 0.0).any():
        refuse("spectral", "wavelengths that increase", f"got {format_value(bands)}", "Sort them")
    return wavelengths


def render_spectrum(
    renderer: Renderer,
    scene: Scene,
    settings: Settings | None = None,
    bands: int | Sequence[float] = len(WAVELENGTHS_NM),
) -> SpectralPicture:
    """Render a picture with a spectrum in each pixel.

    Skin whose profile or colour is computed from pigments has the spectrum of the pigments. Colours given in
    red, green and blue, such as those of eyes, hair, clothing, colour maps and lights, are upsampled to
    smooth spectra.

    Parameters
    ----------
    renderer : Renderer
        Renderer, which draws a frame for every three wavelengths.
    scene : Scene
        Scene to render.
    settings : Settings, optional
        Settings of the picture; a metered exposure is that of the picture in red, green and blue.
    bands : int or sequence of float
        Number of bands of 10 nm from 400 nm on, at most 61, or wavelengths from 380 to 1,000 nm.

    Returns
    -------
    SpectralPicture
        Spectra, coverage and background.

    Raises
    ------
    DermisError
        For invalid wavelengths, and for the setting gamma "wrong".

    References
    ----------
    [MallettYuksel2019] for the spectra of RGB colours.

    Examples
    --------
    >>> import dermis
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
    >>> renderer, settings = dermis.Renderer("cpu"), dermis.Settings(size=64)
    >>> picture = dermis.render_spectrum(renderer, scene, settings)  # doctest: +SKIP
    >>> picture.linear("FL11").shape  # doctest: +SKIP
    (64, 64, 3)
    """
    wavelengths = band_wavelengths(bands)
    settings = as_model(Settings, settings or {}, "settings", "size=(512, 512)")
    if settings.gamma == "wrong":
        refuse("gamma", '"right" for spectra', 'got "wrong"', "Leave it out")
    frame = renderer.draw(scene, settings, timed=False)
    exposure, with_background = frame.exposure, frame.linear_rgba()
    settings = settings.model_copy(update={"exposure": exposure})
    backdrop = None
    if settings.background != "none":
        settings = settings.model_copy(update={"background": "none"})
        rgba = renderer.draw(scene, settings, timed=False).linear_rgba()
        backdrop = np.maximum(with_background[..., :3] - rgba[..., :3], 0.0)
    else:
        rgba = with_background
    reflected = np.empty((*rgba.shape[:2], len(wavelengths)), np.float32)
    for first in range(0, len(wavelengths), _CHANNELS):
        some = wavelengths[first : first + _CHANNELS]
        red, green, blue = np.pad(some, (0, _CHANNELS - len(some)), mode="edge").tolist()
        picture = renderer.draw(scene, settings, timed=False, bands=Bands((red, green, blue))).linear()
        reflected[..., first : first + len(some)] = picture[..., : len(some)]
    rgb = np.ascontiguousarray(rgba[..., :3])
    return SpectralPicture(wavelengths, reflected, rgba[..., 3].copy(), rgb, backdrop, exposure)
