"""Tissue of a skin: that of its profile, with overrides of pigments or layers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.optics.profiles import load_profile
from dermis.scene.field_errors import InvalidFieldsError
from dermis.scene.files import load_scene
from dermis.scene.skin import Pigments, Skin, TissueLayer
from dermis.scene.tissue import skin_tissue, tissue_layers


def with_layers(name: str, **fields: object) -> Skin:
    """Return a medium whose first layer has other values."""
    first, *rest = tissue_layers(Skin(profile=name))
    changed = TissueLayer(**(first.model_dump() | fields))
    return Skin(profile=name, layers=(changed, *rest))


def test_a_medium_s_own_layers_give_its_own_profile() -> None:
    layers = tissue_layers(Skin(profile="dj3"))
    assert [layer.name for layer in layers] == ["epidermis", "upper dermis", "bloody dermis"]
    assert layers[-1].thickness_mm is None
    own = SkinProfiles().profile(Skin(profile="dj3", layers=layers))
    assert own.weight == pytest.approx(load_profile("dj3").weight)


def test_a_layer_that_absorbs_more_red_returns_less_of_it() -> None:
    plain = SkinProfiles().profile(with_layers("dj3")).albedo
    darker = SkinProfiles().profile(with_layers("dj3", absorption_per_mm=(2.0, 0.21, 0.5))).albedo
    assert darker[0] < 0.6 * plain[0] and darker[1:] == pytest.approx(plain[1:], rel=0.02)


def test_incremental_fit_of_thicker_epidermis_matches_a_new_fit() -> None:
    profiles = SkinProfiles()
    profiles.profile(with_layers("dj3", thickness_mm=0.30))
    near = profiles.profile(with_layers("dj3", thickness_mm=0.32))
    fresh = SkinProfiles().profile(with_layers("dj3", thickness_mm=0.32))
    assert near.albedo == pytest.approx(fresh.albedo, rel=2e-3)
    radii = [0.1, 0.5, 2.0]
    assert near.energy_within(radii) == pytest.approx(fresh.energy_within(radii), rel=1e-2, abs=1e-3)


def test_alternating_skins_are_fitted_once() -> None:
    profiles = SkinProfiles()
    pair = with_layers("dj3"), Skin(profile="light", pigments=Pigments(structure="biospec"))
    first = [profiles.profile(skin) for skin in pair]
    assert all(profiles.profile(skin) is fit for skin, fit in zip(pair, first, strict=True))


def test_structures_give_their_layers() -> None:
    skins = (Skin(profile="light", pigments=Pigments(structure=name)) for name in ("dj2006", "biospec"))
    counts = [len(skin_tissue(skin).medium.layers) for skin in skins]
    assert counts == [2, 4]
    assert tissue_layers(Skin(profile="light")) == ()


@pytest.mark.parametrize("profile", ["light", "gpu-gems-3"])
def test_layers_need_a_medium(profile: str) -> None:
    layers = tissue_layers(Skin(profile="skin1"))
    with pytest.raises(DermisError, match=profile):
        SkinProfiles().profile(Skin(profile=profile, layers=layers))


@pytest.mark.parametrize(
    "fields",
    [{"thickness_mm": 0.0}, {"absorption_per_mm": (-1.0, 0.0, 0.0)}, {"scattering_per_mm": (0.0, 1.0, 1.0)}],
)
def test_impossible_layers_are_refused(fields: dict[str, object]) -> None:
    with pytest.raises(InvalidFieldsError, match=next(iter(fields))):
        with_layers("dj3", **fields)


def test_only_the_last_layer_is_semi_infinite() -> None:
    layers = tissue_layers(Skin(profile="skin1")) * 2
    with pytest.raises(DermisError, match="infinite in the last layer only"):
        skin_tissue(Skin(profile="skin1", layers=layers))
    assert np.isinf(skin_tissue(Skin(profile="skin1", layers=layers[:1])).medium.layers[0].thickness_mm)


def test_a_layer_with_an_anisotropy_is_refused_by_the_name_of_its_file(tmp_path: Path) -> None:
    layer = "absorption_per_mm = [1, 1, 1]\nscattering_per_mm = [20, 20, 20]\ng = 0.9\n"
    path = tmp_path / "scene.toml"
    path.write_text(f'[head]\nname = "human"\n[[skin.layers]]\n{layer}')
    with pytest.raises(DermisError, match=r"scene\.toml: .*g = 0\.9.* scattering_per_mm = \[2, 2, 2\]"):
        load_scene(path)
