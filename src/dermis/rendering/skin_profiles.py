"""The Gaussians of skins whose pigments change from frame to frame."""

from __future__ import annotations

from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.skin import Skin


class SkinProfiles:
    """Profiles of skins; each fit of pigments starts from the last one, which is several times faster."""

    def __init__(self) -> None:
        self._skin: Skin | None = None
        self._fitted: GaussianSum | None = None

    def of(self, skin: Skin) -> GaussianSum:
        """The skin's Gaussians.

        Raises DermisError for pigments of a profile that is not made of them.
        """
        if skin.pigments is None:
            return load_profile(skin.profile)
        if self._fitted is None or self._skin is None or not _same_pigments(self._skin, skin):
            self._fitted = load_profile(skin.profile, skin.pigments.given(), self._fitted)
            self._skin = skin
        return self._fitted


def _same_pigments(a: Skin, b: Skin) -> bool:
    return (a.profile, a.pigments) == (b.profile, b.pigments)
