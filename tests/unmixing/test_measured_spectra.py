"""Spectral inversion: known skins, tables of spectra, and the spectra of measured people."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.inverse.unmixing.spectra_file import read_spectra
from dermis.apps.inverse.unmixing.spectral_inversion import (
    PIGMENT_AND_OXYGEN_UNKNOWNS,
    PIGMENT_UNKNOWNS,
    TISSUE_UNKNOWNS,
    colour_metric,
    fit_skin,
    skin_model_spectra,
)
from dermis.apps.validation.accuracy.measured.illuminants import ILLUMINANTS, colour_weights
from dermis.apps.validation.accuracy.measured.measure import CHEEK_AND_FOREHEAD
from dermis.apps.validation.spectral_archive import Archive, read_archive
from dermis.base.errors import DermisError, DermisWarning
from dermis.images.colour import delta_e_2000, lab, linear_of_lab
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM
from dermis.optics.skin_spectra import skin_reflectance
from dermis.optics.tissue import load_tissue


@pytest.fixture(scope="module")
def archive(sample_folder: Path) -> Archive:
    return read_archive()


def known_skins() -> tuple[dict[str, Floats], Floats]:
    """Return parameters of 40 skins, and their spectra."""
    rng = np.random.default_rng(3)
    values = {
        "melanin": rng.uniform(0.01, 0.2, 40),
        "blood": rng.uniform(0.004, 0.03, 40),
        "oxygen": rng.uniform(0.5, 0.95, 40),
        "scattering": rng.uniform(0.8, 1.3, 40),
        "epidermis_mm": rng.uniform(0.04, 0.09, 40),
    }
    return values, skin_model_spectra()(values)


def test_spectra_of_many_skins_are_those_of_single_skins() -> None:
    melanin, blood = np.array([0.01, 0.1, 0.4]), np.array([0.03, 0.01, 0.002])
    known = {"oxygen": 0.85, "eumelanin_fraction": 0.7, "epidermis_mm": 0.055, "baseline": 0.5}
    spectra = skin_reflectance(melanin, blood, **known)
    for m, b, spectrum in zip(melanin, blood, spectra, strict=True):
        single = load_tissue("spectral", pigments={"melanin": float(m), "blood": float(b)}).spectrum()
        assert single is not None and np.abs(spectrum - single).max() < 1e-14


def test_five_parameters_are_found_in_spectra() -> None:
    values, spectra = known_skins()
    found = fit_skin(spectra, TISSUE_UNKNOWNS)
    assert np.median(found.rms_residual) < 1e-8 and found.rms_residual.max() < 5e-4
    for name in PIGMENT_UNKNOWNS:
        assert np.median(np.abs(found.values[name] / values[name] - 1.0)) < 0.02, name


def test_three_parameters_are_found_in_colours() -> None:
    values, _ = known_skins()
    fixed = {name: values[name] for name in PIGMENT_AND_OXYGEN_UNKNOWNS}
    found = fit_skin(skin_model_spectra()(fixed), PIGMENT_AND_OXYGEN_UNKNOWNS, "colour")
    assert found.delta_e().max() < 1e-3
    for name in PIGMENT_AND_OXYGEN_UNKNOWNS:
        assert np.abs(found.values[name] / values[name] - 1.0).max() < 0.01, name


def test_the_metric_has_the_length_of_ciede2000() -> None:
    colours = lab(known_skins()[1] @ colour_weights("D65").T)
    step = 0.01 * np.random.default_rng(1).standard_normal(colours.shape)
    moved = delta_e_2000(linear_of_lab(colours + step), linear_of_lab(colours))
    length = np.linalg.norm(np.einsum("nij,nj->ni", colour_metric(colours), step), axis=1)
    assert np.abs(length / moved - 1.0).max() < 0.02


@pytest.mark.parametrize("illuminant", ILLUMINANTS)
def test_white_is_white_under_each_light(illuminant: str) -> None:
    white, grey = colour_weights(illuminant) @ np.full((31, 2), (1.0, 0.2))[:, 0], 0.2
    assert white == pytest.approx(np.ones(3), abs=1e-9)
    assert lab(grey * white) == pytest.approx([51.84, 0.0, 0.0], abs=0.01)


def rows_of(spectra: Floats, separator: str = ",") -> str:
    heads = separator.join(["site", *(f"{nm:.0f} nm" for nm in WAVELENGTHS_NM)])
    return "\n".join([heads, *(separator.join(["cheek", *map(str, row)]) for row in spectra)])


def columns_of(spectra: Floats) -> str:
    lines = ["nm," + ",".join(f"skin {k}" for k in range(len(spectra)))]
    lines += [
        f"{nm:.0f}," + ",".join(map(str, row)) for nm, row in zip(WAVELENGTHS_NM, spectra.T, strict=True)
    ]
    return "\n".join(lines)


def test_tables_by_row_by_column_in_percent_and_compressed(tmp_path: Path) -> None:
    spectra = known_skins()[1][:4]
    semicolons = rows_of(spectra, ";").replace(".", ",")
    texts = {"rows.csv": rows_of(spectra), "columns.csv": columns_of(spectra), "comma.csv": semicolons}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        assert np.abs(read_spectra(tmp_path / name).reflectance - spectra).max() < 1e-12, name
    (tmp_path / "packed.csv.gz").write_bytes(gzip.compress(rows_of(spectra).encode()))
    assert np.abs(read_spectra(tmp_path / "packed.csv.gz").reflectance - spectra).max() < 1e-12
    (tmp_path / "percent.csv").write_text(rows_of(100.0 * spectra))
    with pytest.warns(DermisWarning, match="percent"):
        percent = read_spectra(tmp_path / "percent.csv")
    assert np.abs(percent.reflectance - spectra).max() < 1e-12
    assert percent.labels == [{"site": "cheek"}] * 4


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a,b\n1,2\n", "wavelengths from 400 to 700 nm"),
        (rows_of(np.full((1, 31), 7.0))[:-4], "cells in each row"),
        (rows_of(np.full((1, 31), -0.5)), "reflectances from 0 to 1"),
        (rows_of(np.full((1, 31), np.nan)), "no numbers"),
        ("", "a table of reflectance spectra"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(DermisError, match=told):
        read_spectra(tmp_path / "table.csv")


def test_measured_people_have_the_colours_of_the_model(archive: Archive) -> None:
    """The limits are the goals of the model: without half of the baseline absorption all are exceeded."""
    sample = archive.select_rows(np.isin(archive.site, CHEEK_AND_FOREHEAD)).sample_rows(500)
    two, three = (
        fit_skin(sample.spectra, n, "colour").delta_e()
        for n in (PIGMENT_UNKNOWNS, PIGMENT_AND_OXYGEN_UNKNOWNS)
    )
    assert np.median(two) < 0.85 and np.median(three) < 0.25
    assert np.median(fit_skin(sample.spectra, TISSUE_UNKNOWNS).rms_residual) < 0.006


def test_people_are_in_one_part_only(archive: Archive) -> None:
    parts = {(person, fold) for person, fold in zip(archive.person, archive.fold, strict=True)}
    assert len(parts) == len(set(archive.person)) and len(archive.spectra) == 10464
