"""Skin: its layers computed by hand, effects of parameters on colour, presets, and invalid parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from dermis.base import citations as cite
from dermis.base.errors import DermisError
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.media import Floats, Layer
from dermis.optics.pigments.parameters import SKINS, SkinParameters, Structure
from dermis.optics.pigments.skin import MELANIN_SHEET_ABSORPTION_RATIO, spectral_medium
from dermis.optics.pigments.spectra import (
    WAVELENGTHS_NM,
    baseline_absorption,
    blood_absorption,
    donner_jensen_scattering,
    jacques_scattering,
    melanosome_absorption,
    rgb_weights,
)

STRUCTURES: tuple[Structure, ...] = get_args(Structure)
SKIN = SkinParameters(melanin=0.02, eumelanin=0.6, blood=0.01, oxygen=0.8, epidermis_mm=0.1)


def colour(layer: Layer) -> Floats:
    """Return the linear Rec. 709 colour of a half-space of a layer's tissue, by the dipole [Jensen2001]."""
    q = np.sqrt(3.0 * (1.0 - layer.alpha_prime))
    A = boundary_mismatch(1.4)
    total = 0.5 * layer.alpha_prime * (1.0 + np.exp(-4.0 / 3.0 * A * q)) * np.exp(-q)
    return rgb_weights() @ total


def layer(structure: Structure, name: str, parameters: SkinParameters) -> Layer:
    (found,) = (one for one in spectral_medium(structure, parameters).layers if one.name == name)
    return found


@pytest.mark.parametrize("structure", STRUCTURES)
def test_a_channel_for_each_wavelength(structure: Structure) -> None:
    medium = spectral_medium(structure, SKIN)
    assert medium.channels == len(WAVELENGTHS_NM) == 31
    assert medium.is_semi_infinite and medium.eta == 1.4
    assert spectral_medium(structure, SKIN, np.array([550.0])).channels == 1
    assert medium.notes and cite.bibtex(medium.sources)


def test_layers_from_top_to_bottom() -> None:
    names = {s: [one.name for one in spectral_medium(s, SKIN).layers] for s in STRUCTURES}
    assert names == {
        "dj2006": ["epidermis", "dermis"],
        "donner2008": ["epidermis", "melanin sheet", "dermis"],
        "biospec": ["stratum corneum", "epidermis", "papillary dermis", "reticular dermis"],
    }


def test_dj2006_by_hand_at_550_nm() -> None:
    epidermis, dermis = spectral_medium("dj2006", SKIN, np.array([550.0])).layers
    tissue = 0.5 * (0.0244 + 8.53 * np.exp(-396.0 / 66.2))  # half of Jacques' law, after [Lu2025]
    melanin = 0.6 * 6.6e10 / 550**3.33 + 0.4 * 2.9e14 / 550**4.75
    haemoglobin = np.log(10.0) * 150.0 / 64500.0 * (0.8 * 43016.0 + 0.2 * 53412.0) / 10.0
    assert epidermis.sigma_a == pytest.approx(0.02 * melanin + 0.98 * tissue)
    assert dermis.sigma_a == pytest.approx(0.01 * haemoglobin + 0.99 * tissue)
    assert epidermis.sigma_s_prime == pytest.approx(6.0823, abs=1e-4)
    assert dermis.sigma_s_prime == pytest.approx(3.0411, abs=1e-4)
    assert epidermis.thickness_mm == 0.1


def test_the_sheet_absorbs_a_share_of_the_melanin_above_it() -> None:
    """The optical depth of the sheet does not depend on its nominal thickness."""
    sheet = layer("donner2008", "melanin sheet", SKIN)
    above = SKIN.melanin * melanosome_absorption(WAVELENGTHS_NM, SKIN.eumelanin) * SKIN.epidermis_mm
    assert np.allclose(sheet.sigma_a * sheet.thickness_mm, MELANIN_SHEET_ABSORPTION_RATIO * above)
    assert (sheet.sigma_s_prime * sheet.thickness_mm < 0.02).all()
    assert not layer("donner2008", "melanin sheet", replace(SKIN, melanin=0.0)).sigma_a.any()


def test_blood_in_the_epidermis() -> None:
    bloody = replace(SKIN, epidermal_blood=0.01)
    added = layer("donner2008", "epidermis", bloody).sigma_a - layer("donner2008", "epidermis", SKIN).sigma_a
    assert np.allclose(
        added, 0.01 * (blood_absorption(WAVELENGTHS_NM, 0.8) - 0.5 * baseline_absorption(WAVELENGTHS_NM))
    )
    for structure in ("dj2006", "biospec"):
        same = layer(structure, "epidermis", bloody), layer(structure, "epidermis", SKIN)
        assert np.array_equal(same[0].sigma_a, same[1].sigma_a)


def test_biospec_has_bare_corneum_and_less_blood_below() -> None:
    corneum, epidermis, papillary, reticular = spectral_medium("biospec", SKIN).layers
    tissue = 0.5 * baseline_absorption(WAVELENGTHS_NM)
    assert np.array_equal(corneum.sigma_a, tissue)
    assert [corneum.thickness_mm, epidermis.thickness_mm, papillary.thickness_mm] == [0.01, 0.1, 0.2]
    assert np.allclose((reticular.sigma_a - tissue) / (papillary.sigma_a - tissue), 0.0091 / 0.012)


def test_tissue_without_blood_and_melanin_absorbs_as_in_measured_people() -> None:
    bare = replace(SKIN, melanin=0.0, blood=0.0)
    measured, published = (
        spectral_medium("dj2006", replace(bare, baseline=factor)) for factor in (bare.baseline, 1.0)
    )
    assert bare.baseline == 0.5
    assert np.allclose(published.layers[1].sigma_a, baseline_absorption(WAVELENGTHS_NM))
    assert np.allclose(measured.layers[1].sigma_a, 0.5 * published.layers[1].sigma_a)
    assert "Lu2025" in measured.sources and "Lu2025" not in published.sources


def test_another_law_of_scattering() -> None:
    epidermis, dermis = spectral_medium("dj2006", SKIN, scattering=jacques_scattering).layers
    assert np.array_equal(epidermis.sigma_s_prime, jacques_scattering(WAVELENGTHS_NM))
    assert np.allclose(dermis.sigma_s_prime / jacques_scattering(WAVELENGTHS_NM), 0.5)
    assert not np.allclose(epidermis.sigma_s_prime, donner_jensen_scattering(WAVELENGTHS_NM), rtol=0.1)


def test_melanin_darkens() -> None:
    colours = [
        colour(layer("dj2006", "epidermis", replace(SKIN, melanin=m))) for m in (0, 0.01, 0.05, 0.2, 0.5)
    ]
    assert (np.diff(colours, axis=0) < 0.0).all()


def test_blood_reddens() -> None:
    colours = np.array(
        [colour(layer("dj2006", "dermis", replace(SKIN, blood=b))) for b in (0, 0.002, 0.01, 0.05)]
    )
    assert (np.diff(colours[:, 0] / colours[:, 1]) > 0.0).all()
    assert (np.diff(colours[:, 1]) < 0.0).all()


def test_oxygen_makes_blood_brighter_red() -> None:
    pale, bright = (colour(layer("dj2006", "dermis", replace(SKIN, oxygen=o))) for o in (0.2, 1.0))
    assert bright[0] / bright[2] > pale[0] / pale[2] and bright[0] > pale[0]


def test_pheomelanin_is_redder() -> None:
    brown, ginger = (colour(layer("dj2006", "epidermis", replace(SKIN, eumelanin=e))) for e in (1.0, 0.0))
    assert ginger[0] / ginger[2] > brown[0] / brown[2]


@pytest.mark.parametrize("structure", STRUCTURES)
def test_oil_changes_nothing_below_the_surface(structure: Structure) -> None:
    dry, oily = (spectral_medium(structure, replace(SKIN, oiliness=o)) for o in (0.0, 1.0))
    for one, other in zip(dry.layers, oily.layers, strict=True):
        assert np.array_equal(one.sigma_a, other.sigma_a)
        assert np.array_equal(one.sigma_s_prime, other.sigma_s_prime)


def test_examples_are_the_published_rows() -> None:
    rows = {
        n: (p.melanin, p.eumelanin, p.blood, p.oiliness, p.oxygen, p.epidermis_mm, p.baseline)
        for n, p in SKINS.items()
    }
    assert list(rows) == ["spectral", "light", "medium", "dark"]
    assert rows["light"] == (0.005, 0.7, 0.005, 0.3, 0.75, 0.25, 1.0)
    assert rows["medium"] == (0.15, 0.0, 0.01, 0.3, 0.75, 0.25, 1.0)
    assert rows["dark"] == (0.5, 0.7, 0.05, 0.3, 0.75, 0.25, 1.0)
    colours = [colour(layer("dj2006", "epidermis", SKINS[n])) for n in ("light", "medium", "dark")]
    assert (np.diff(colours, axis=0) < 0.0).all()


@pytest.mark.parametrize(
    "name", ["melanin", "eumelanin", "blood", "oxygen", "epidermal_blood", "baseline", "oiliness"]
)
@pytest.mark.parametrize("value", [-0.01, 1.01, np.nan])
def test_shares_beyond_one_are_refused_by_their_option(name: str, value: float) -> None:
    with pytest.raises(DermisError, match=f"--{name.replace('_', '-')}: expected a number from 0 to 1"):
        replace(SKIN, **{name: value})


@pytest.mark.parametrize("value", [0.0, -0.1, 2.1, np.nan, np.inf])
def test_impossible_epidermis_is_refused(value: float) -> None:
    with pytest.raises(DermisError, match=r"--epidermis-mm: expected a number from 0\.001 to 2"):
        replace(SKIN, epidermis_mm=value)


def test_more_than_a_whole_epidermis_is_refused() -> None:
    with pytest.raises(DermisError, match="--melanin and --epidermal-blood"):
        SkinParameters(melanin=0.7, epidermal_blood=0.4)
    for structure in STRUCTURES:
        spectral_medium(structure, SkinParameters(melanin=1.0, blood=1.0))


def test_unknown_structure_names_those_there_are() -> None:
    with pytest.raises(DermisError, match="dj2006, donner2008, biospec"):
        spectral_medium("dj2007", SKIN)  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="380 to 1000"):
        spectral_medium("dj2006", SKIN, np.array([1050.0]))
