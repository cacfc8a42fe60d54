"""`dermis unmix`: the maps it writes, and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tolerances import UNMIXED

from dermis.apps.inverse.unmixing.skin_model import skin_model
from dermis.images.io import read_image, write_image
from dermis.optics.pigments.spectra import WAVELENGTHS_NM
from dermis.optics.skin_spectra import skin_reflectance

Run = Callable[..., Any]


@pytest.fixture
def picture(folder: Path) -> Path:
    """Return the path of a map with 2 % melanin and 1 % blood, with a black border."""
    colours = np.zeros((24, 32, 3), np.float32)
    colours[:, 4:] = skin_model().colours(np.array([0.02]), np.array([0.01]))[0]
    write_image(folder / "skin.png", colours)
    return folder / "skin.png"


def test_writes_maps_a_table_and_other_colours(run: Run, picture: Path, folder: Path) -> None:
    ended = run("unmix", "skin.png", "-o", "maps", "--melanin", "x3", "--adapter", "cpu", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    told = json.loads(ended.stdout)
    names = ["melanin.exr", "blood.exr", "melanin_sd.exr", "blood_sd.exr", "residual.exr", "recoloured.png"]
    assert told["files"] == [f"maps/{name}" for name in (*names, "unmixed.json")]
    assert told["skin"] == pytest.approx(28 / 32)
    assert told["melanin"]["median"] == pytest.approx(0.02, rel=0.1)
    assert told["blood"]["median"] == pytest.approx(0.01, rel=0.1)
    kept = json.loads((folder / "maps" / "unmixed.json").read_text())
    assert {key: told[key] for key in kept} == kept
    melanin = read_image(folder / "maps" / "melanin.exr")
    assert melanin.shape == (24, 32, 1) and melanin[12, 20] == pytest.approx(0.02, rel=0.1)
    assert (read_image(folder / "maps" / "recoloured.png")[12, 20] < read_image(picture)[12, 20]).all()
    assert not [one for one in (folder / "maps").iterdir() if one.name.startswith(".")]


def test_a_colour_of_profile_is_unmixed_back_by_defaults(run: Run, folder: Path) -> None:
    words = ("profile", "spectral", "--melanin", 0.02, "--blood", 0.01, "--json")
    colour = json.loads(run(*map(str, words)).stdout)["total"]
    write_image(folder / "skin.exr", np.broadcast_to(np.float32(colour), (8, 8, 3)))
    told = json.loads(run("unmix", "skin.exr", "--adapter", "cpu", "--noise", "0.001", "--json").stdout)
    assert told["melanin"]["median"] == pytest.approx(0.02, rel=UNMIXED)
    assert told["blood"]["median"] == pytest.approx(0.01, rel=UNMIXED)
    tone = json.loads(run(*map(str, words)).stdout)["skin_tone"]
    assert tone["statement"] and set(tone) == set(told["skin_tone"])
    for name in ("L", "a", "b", "ita_degrees"):
        assert told["skin_tone"][name] == pytest.approx(tone[name], abs=0.05)


def test_help_prints_the_default_skin(run: Run) -> None:
    shown = {
        name: " ".join(run(name, "--help").stdout.replace("│", " ").split()) for name in ("profile", "unmix")
    }
    assert "[default: 0.055, light 0.25, medium 0.25, dark 0.25]" in shown["profile"]
    assert "[default: 0.018, light 0.005, medium 0.15, dark 0.5]" in shown["profile"]
    assert "[default: 0.85, light 0.75, medium 0.75, dark 0.75]" in shown["profile"]
    assert "[default: 0.5, light 1, medium 1, dark 1]" in shown["profile"]
    assert "[default: dj2006]" in shown["profile"]
    assert "Thickness of the epidermis [mm]. [default: 0.055]" in shown["unmix"]
    assert "[default: 0.85]" in shown["unmix"] and "[default: 0.7]" in shown["unmix"]


def test_medians_are_printed_as_text(run: Run, picture: Path) -> None:
    ended = run("unmix", "skin.png", "--adapter", "cpu", "--shading", "--find", "oxygen")
    assert ended.code == 0 and "melanin  median 0.0" in ended.stdout
    assert {"maps/oxygen.exr", "maps/shading.exr"} <= set(ended.stdout.split())


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing.png"], "nothing.png: expected"),
        (["skin.png", "--melanin", "much"], "--melanin: expected a factor, such as x2"),
        (["skin.png", "--oxygen", "nan"], "--oxygen: expected a number from 0 to 1"),
        (["skin.png", "--noise", "0"], "noise: expected a number from 0.0001"),
        (["skin.png", "--model-oxygen", "2"], "--oxygen: expected a number from 0 to 1"),
        (["skin.png", "-o", "skin.png"], "skin.png: expected a folder or a free name"),
        (["skin.png", "-o", "no/maps"], "no/maps: expected a folder inside one that exists"),
    ],
)
def test_invalid_options_are_refused(
    run: Run, picture: Path, folder: Path, words: list[str], told: str
) -> None:
    ended = run("unmix", *words, "--adapter", "cpu")
    assert ended.code == 2 and told in ended.stderr and ended.stderr.count("\n") == 1
    assert not list(folder.rglob("*.exr"))


def spectra_table(folder: Path) -> None:
    """Write two spectra of known skins with the reflection of the surface, and one with a missing value."""
    known = {"oxygen": 0.8, "eumelanin_fraction": 0.7, "epidermis_mm": 0.055, "baseline": 0.5}
    spectra = 0.0278 + skin_reflectance([0.03, 0.15], [0.008, 0.02], **known)
    rows = [",".join(["name", *(f"r{nm:.0f}" for nm in WAVELENGTHS_NM)])]
    rows += [",".join([name, *map(str, row)]) for name, row in zip(("pale", "dark"), spectra, strict=True)]
    rows.append(f"lost,,{','.join(map(str, spectra[0, 1:]))}")
    (folder / "spectra.csv").write_text("# measured\n" + "\n".join(rows) + "\n")


def test_prints_pigments_and_residuals_of_each_spectrum(run: Run, folder: Path) -> None:
    spectra_table(folder)
    ended = run("unmix", "--spectra", "spectra.csv", "--find", "oxygen", "--json")
    told = json.loads(ended.stdout)
    assert ended.code == 0 and "1 of 3 spectra have missing values" in ended.stderr
    assert (told["spectra"], told["missing"]) == (2, 1)
    assert [row["labels"] for row in told["rows"]] == [{"name": n} for n in ("pale", "dark", "lost")]
    pale, dark, lost = told["rows"]
    assert [pale[name] for name in ("melanin", "blood", "oxygen")] == pytest.approx(
        [0.03, 0.008, 0.8], rel=1e-3
    )
    assert [dark[name] for name in ("melanin", "blood", "oxygen")] == pytest.approx(
        [0.15, 0.02, 0.8], rel=1e-3
    )
    assert pale["rms"] < 1e-5 and len(pale["residual"]) == 31 and "melanin" not in lost
    lines = run("unmix", "--spectra", "spectra.csv").stdout.splitlines()
    assert lines[0].split() == ["row", "melanin", "blood", "rms", "delta_e"]
    assert lines[1].split()[-1] == "pale" and lines[3].split() == ["3", "-", "-", "-", "-", "lost"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["skin.png", "--spectra", "spectra.csv"], "--spectra: expected a table of spectra or a colour map"),
        (["--spectra", "spectra.csv", "--melanin", "x2"], "--melanin: expected a colour map"),
        (["--spectra", "spectra.csv", "--surface", "2"], "--surface: expected"),
        (["skin.png", "--find", "all"], "--find: expected none or oxygen"),
        ([], "colour map: expected a file, or --spectra"),
    ],
)
def test_refuses_mixtures_of_spectra_and_maps(
    run: Run, picture: Path, folder: Path, words: list[str], told: str
) -> None:
    spectra_table(folder)
    ended = run("unmix", *words)
    assert ended.code == 2 and told in ended.stderr
