"""Gaussian profiles of skins whose pigments or layers change from frame to frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.diffusion.mixture import load_shares
from dermis.optics.fits.gaussian import shared_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import fit_profile, load_profile, preset_names
from dermis.scene.skin import Pigments, Skin
from dermis.scene.tissue import tissue_of

Mixed = tuple[tuple[GaussianSum, ...], NDArray[np.float32] | None]
_KEPT = 4  # the live skin, one to compare with, and those just before


class SkinProfiles:
    """Profiles of skins; fits start from a similar one, which is several times faster.

    With pigments alone that is the profile's own, so that a person's never follows from who was drawn before;
    with layers or a structure of one's own, as a hand changes them in a window, it is the last of the kind.
    Files are checked for changes when the skin changes, not for each frame of the same skin.
    """

    def __init__(self) -> None:
        self._fits: list[tuple[Skin, GaussianSum]] = []
        self._newest: tuple[Skin, GaussianSum] | None = None

    def of(self, skin: Skin) -> GaussianSum:
        """The skin's Gaussians.

        Raises DermisError for pigments or layers of a profile that is not made of them.
        """
        if self._newest is None or self._newest[0] is not skin:
            self._newest = skin, self._found(skin)
        return self._newest[1]

    def mixed(self, skin: Skin) -> Mixed:
        """The skin's profiles as sums of the same Gaussians, and the shares of all but the first by place.

        Raises DermisError for a map without other profiles, and for others without one.
        """
        first = self.of(skin)
        if not skin.other_profiles and skin.profile_map is None:
            return (first,), None
        if not skin.other_profiles or skin.profile_map is None:
            came = "there is only a map" if skin.profile_map else "there is no map"
            remedy = "Give profile_map and other_profiles both"
            refuse("profile_map", "a map of shares, and the profiles whose shares these are", came, remedy)
        others = (load_profile(name) for name in skin.other_profiles)
        return shared_gaussians((first, *others)), load_shares(skin.profile_map)

    def _found(self, skin: Skin) -> GaussianSum:
        known = self._last(_tissue, skin)
        if not skin.layers and skin.pigments in (None, Pigments()):
            profile = load_profile(skin.profile)
        elif known:
            profile = known[1]
        else:
            profile = fit_profile(tissue_of(skin), skin.profile, self._near(skin))
        self._fits = [*(fit for fit in self._fits if fit is not known), (skin, profile)][-_KEPT:]
        return profile

    def _near(self, skin: Skin) -> GaussianSum | None:
        plain = skin.pigments is not None and skin.pigments.structure is None and not skin.layers
        if plain and skin.profile in preset_names():
            return load_profile(skin.profile)
        fit = self._last(_kind, skin)
        return fit and fit[1]

    def _last(self, of: Callable[[Skin], object], skin: Skin) -> tuple[Skin, GaussianSum] | None:
        alike = (fit for fit in reversed(self._fits) if of(fit[0]) == of(skin))
        return next(alike, None)


def _tissue(skin: Skin) -> tuple[object, ...]:
    return skin.profile, skin.pigments, skin.layers


def _kind(skin: Skin) -> tuple[object, ...]:
    """Key that skins with similar profiles share."""
    return skin.profile, skin.pigments and skin.pigments.structure, len(skin.layers)
