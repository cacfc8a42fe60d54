"""Diffusion profiles of skins, which are fitted on demand and cached."""

from __future__ import annotations

from pathlib import Path

import pytest

from dermis.base.errors import DermisError
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.frame.features.translucency.build import rounded_sigma_mm
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import fit_profile, load_profile
from dermis.optics.tissue import Tissue
from dermis.scene.skin import Pigments, Skin


def skin(**pigments: float) -> Skin:
    return Skin(profile="light", pigments=Pigments(**pigments))


def test_incremental_pigment_fit_matches_a_new_fit() -> None:
    profiles = SkinProfiles()
    profiles.profile(skin(melanin=0.02))
    near, fresh = profiles.profile(skin(melanin=0.03)), load_profile("light", {"melanin": 0.03})
    radius = [0.1, 0.5, 2.0]
    assert near.albedo == pytest.approx(fresh.albedo, rel=2e-3)
    assert near.energy_within(radius) == pytest.approx(fresh.energy_within(radius), rel=5e-3, abs=1e-4)


def test_the_first_move_of_a_slider_starts_from_the_profile_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    starts, profiles = list[GaussianSum | None](), SkinProfiles()

    def fit(tissue: Tissue, name: str, near: GaussianSum | None) -> GaussianSum:
        starts.append(near)
        return fit_profile(tissue, name, near)

    monkeypatch.setattr("dermis.frame.features.diffusion.profiles.fit_profile", fit)
    plain = profiles.profile(Skin(profile="light"))
    first, fresh = profiles.profile(skin(melanin=0.03)), load_profile("light", {"melanin": 0.03})
    assert starts == [plain]
    assert first.albedo == pytest.approx(fresh.albedo, rel=1e-4)
    profiles.profile(Skin(profile="dark", pigments=Pigments(melanin=0.03)))
    assert starts[1] is load_profile("dark")


def test_the_same_pigments_are_not_fitted_again() -> None:
    profiles = SkinProfiles()
    first = profiles.profile(skin(melanin=0.02))
    assert profiles.profile(skin(melanin=0.02).model_copy(update={"mix": 1.0})) is first


def test_alternating_skins_are_fitted_once() -> None:
    """Two skins that alternate, as on both sides of the viewer's divider, are fitted once."""
    profiles = SkinProfiles()
    first = [profiles.profile(skin(melanin=share)) for share in (0.02, 0.05)]
    again = [profiles.profile(skin(melanin=share)) for share in (0.02, 0.05, 0.02)]
    assert [a is b for a, b in zip(again, [*first, first[0]], strict=True)] == [True] * 3


def test_changed_profile_file_is_read_again(tmp_path: Path) -> None:
    path, profiles = tmp_path / "own.csv", SkinProfiles()

    def written(green: float) -> None:
        path.write_text(f"variance_mm2,red,green,blue\n1.0,0.5,{green},0.2\n", encoding="utf-8")

    written(0.25)
    first, second = (Skin(profile=str(path)) for _ in range(2))
    found = profiles.profile(first)
    written(0.125)
    assert profiles.profile(first) is found  # not read for each frame
    changed = profiles.profile(second)
    assert (found.albedo[1], changed.albedo[1]) == (0.25, 0.125)
    assert profiles.profile(Skin(profile=str(path))) is changed


def test_a_table_has_no_pigments() -> None:
    with pytest.raises(DermisError, match="gpu-gems-3"):
        SkinProfiles().profile(Skin(pigments=Pigments(melanin=0.1)))


def test_nearly_equal_widths_are_merged() -> None:
    assert rounded_sigma_mm(2.0) == rounded_sigma_mm(2.1) == pytest.approx(2.0)
    assert all(0.84 <= rounded_sigma_mm(w) / w <= 1.19 for w in (0.6, 0.9, 1.3, 2.6, 7.0))
