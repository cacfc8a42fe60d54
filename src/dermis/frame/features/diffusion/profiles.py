"""Diffusion profiles of skin, which are fitted again when the pigments or layers of the skin change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.diffusion.mixture import load_blend_weights
from dermis.optics.bands import Bands
from dermis.optics.fits.gaussian import shared_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import find_gaussians, fit_profile, load_profile, preset_names
from dermis.scene.skin import Pigments, Skin
from dermis.scene.tissue import skin_tissue

ProfileMix = tuple[tuple[GaussianSum, ...], NDArray[np.float32] | None]
"""Profiles as sums of the same Gaussians, and (h, w, 2) blend weights of all but the first."""
_CACHED_BAND_FIT_COUNT = 64  # three times the bands of a spectrum up to 1,000 nm
_CACHED_FIT_COUNT = 4  # the current skin, one to compare with, and two previous ones


class SkinProfiles:
    """Cache of the diffusion profiles of the most recent skins.

    A profile is fitted several times faster if the fit starts from a similar profile. For skin described by
    pigments alone, it starts from the published profile, so that results do not depend on the people rendered
    before. For skin that defines its layers or its structure, it starts from the last profile fitted for a
    skin with the same number of layers.
    """

    def __init__(self) -> None:
        self._fits: list[tuple[Skin, GaussianSum]] = []
        self._current: tuple[Skin, GaussianSum] | None = None
        self._band_fits: dict[tuple[object, ...], GaussianSum] = {}

    def profile(self, skin: Skin, bands: Bands | None = None) -> GaussianSum:
        """Return the diffusion profile of a skin; if a map blends several profiles, return the first of them.

        A file that holds the profile is read when the skin changes, not in every frame.

        bands : wavelengths in the place of red, green and blue

        Raises DermisError if the skin has pigments or layers, but names a profile that cannot be computed
        from them.
        """
        if self._current is None or self._current[0] is not skin:
            self._current = skin, self._load_or_fit(skin)
        return self._current[1] if bands is None else self._in_bands(skin, self._current[1], bands)

    def _in_bands(self, skin: Skin, rgb_profile: GaussianSum, bands: Bands) -> GaussianSum:
        """Return the profile of a skin at three wavelengths.

        It is computed from pigments. For profiles given in red, green and blue, the weights of the Gaussians
        are upsampled like colours.
        """
        if find_gaussians(skin.profile) is None and (tissue := skin_tissue(skin)).rgb is not None:
            key = (*_tissue_key(skin), bands)
            if key not in self._band_fits:
                if len(self._band_fits) >= _CACHED_BAND_FIT_COUNT:
                    self._band_fits.clear()
                spectral = tissue.in_bands(bands)
                self._band_fits[key] = fit_profile(spectral, skin.profile, rgb_profile, keep_energy=True)
            return self._band_fits[key]
        return replace(rgb_profile, weight=bands.reflectance(rgb_profile.weight))

    def mixture(self, skin: Skin, bands: Bands | None = None) -> ProfileMix:
        """Return all profiles of a skin, and the blend weights of all but the first.

        For a single profile the weights are None.

        bands : wavelengths in the place of red, green and blue

        Raises DermisError for a blend map without other profiles, and for other profiles without a blend map.
        """
        first = self.profile(skin, bands)
        if not skin.other_profiles and skin.profile_map is None:
            return (first,), None
        if not skin.other_profiles or skin.profile_map is None:
            actual = "there is only a map" if skin.profile_map else "there is no map"
            advice = "Give profile_map and other_profiles both"
            refuse("profile_map", "a map of blend weights, and the profiles that it blends", actual, advice)
        others = (self._other_profile(name, bands) for name in skin.other_profiles)
        return shared_gaussians((first, *others)), load_blend_weights(skin.profile_map)

    def _other_profile(self, name: str, bands: Bands | None) -> GaussianSum:
        profile = load_profile(name)
        return profile if bands is None else self._in_bands(Skin(profile=name), profile, bands)

    def _load_or_fit(self, skin: Skin) -> GaussianSum:
        cached = self._latest_fit(_tissue_key, skin)
        if not skin.layers and skin.pigments in (None, Pigments()):
            profile = load_profile(skin.profile)
        elif cached:
            profile = cached[1]
        else:
            profile = fit_profile(skin_tissue(skin), skin.profile, self._initial_guess(skin))
        self._fits = [*(fit for fit in self._fits if fit is not cached), (skin, profile)][-_CACHED_FIT_COUNT:]
        return profile

    def _initial_guess(self, skin: Skin) -> GaussianSum | None:
        pigments_only = skin.pigments is not None and skin.pigments.structure is None and not skin.layers
        if pigments_only and skin.profile in preset_names():
            return load_profile(skin.profile)
        fit = self._latest_fit(_similarity_key, skin)
        return fit and fit[1]

    def _latest_fit(
        self, similarity_key: Callable[[Skin], object], skin: Skin
    ) -> tuple[Skin, GaussianSum] | None:
        return next(
            (fit for fit in reversed(self._fits) if similarity_key(fit[0]) == similarity_key(skin)), None
        )


def _tissue_key(skin: Skin) -> tuple[object, ...]:
    return skin.profile, skin.pigments, skin.layers


def _similarity_key(skin: Skin) -> tuple[object, ...]:
    """Return a key that is equal for skins whose profiles are good initial guesses for one another."""
    return skin.profile, skin.pigments and skin.pigments.structure, len(skin.layers)
