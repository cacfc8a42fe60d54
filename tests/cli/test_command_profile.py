"""`dermis profile`: output, files and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.images.io import read_image
from dermis.optics.pigments.spectra import rgb_weights
from dermis.optics.profiles import load_profile

Run = Callable[..., Any]
KEYS = {
    "name", "model", "eta", "layers", "thickness_mm", "mean_free_path_mm", "per", "radius_mm",
    "absorption_per_mm", "scattering_per_mm", "model_error", "reflectance_per_mm2", "total",
    "gaussians", "warnings", "notes", "sources",
}  # fmt: skip


@pytest.fixture
def told(run: Run) -> Callable[..., dict[str, Any]]:
    """Return the JSON output of `dermis profile` with the given arguments."""

    def call(*words: object) -> dict[str, Any]:
        ended = run("profile", *words, "--json")
        assert (ended.code, ended.stderr) == (0, "")
        report: dict[str, Any] = json.loads(ended.stdout)
        return report

    return call


def test_json_holds_the_profile_and_its_fit(told: Callable[..., dict[str, Any]]) -> None:
    report = told("dj3", "--model", "multipole")
    assert set(report) == KEYS
    r, R = np.array(report["radius_mm"]), np.array(report["reflectance_per_mm2"])
    assert R.shape == (len(r), 3)
    integral = np.trapezoid(2 * np.pi * r[:, None] ** 2 * R, np.log(r), axis=0)
    assert integral == pytest.approx(report["total"], rel=2e-3)
    assert report["total"] == pytest.approx([0.487, 0.380, 0.295], abs=1e-3)
    assert report["thickness_mm"] == [0.25, 0.2, None]
    assert report["mean_free_path_mm"][0] == pytest.approx([1 / 5.01, 1 / 6.21, 1 / 7.0])
    fit = report["gaussians"]
    weights, variances = np.array(fit["weights"]), np.array(fit["variances_mm2"])
    assert weights.shape == (6, 3) and variances.shape == (6,)
    assert all(len(fit[key]) == 3 for key in ("error", "energy_error", "ring_error"))
    bells = np.exp(-(r[:, None] ** 2) / (2 * variances)) / (2 * np.pi * variances)
    miss = np.trapezoid(r[:, None] ** 2 * (bells @ weights - R) ** 2, np.log(r), axis=0)
    norm = np.trapezoid(r[:, None] ** 2 * R**2, np.log(r), axis=0)
    assert np.sqrt(miss / norm) == pytest.approx(fit["error"], rel=1e-3)
    assert weights.sum(axis=0) / report["total"] - 1 == pytest.approx(fit["energy_error"], abs=1e-9)
    assert any("thinner" in text for text in report["warnings"])
    assert any("1/cm" in text for text in report["notes"])
    assert "DonnerJensen2005" in report["sources"]


def test_a_skin_of_pigments_has_its_spectra(told: Callable[..., dict[str, Any]]) -> None:
    ended = told("light")
    wavelength, R = np.array(ended["wavelength_nm"]), np.array(ended["reflectance"])
    assert wavelength.shape == R.shape == (31,) and wavelength[0] == 400
    assert R.min() > 0.1 and R.max() < 0.75 and R[-1] > 1.3 * R[15]  # blood is red
    np.testing.assert_allclose(rgb_weights(wavelength) @ R, ended["total"], rtol=1e-9)
    a, s = np.array(ended["absorption_per_mm"]), np.array(ended["scattering_per_mm"])
    assert a.shape == s.shape == (2, 31) and (np.diff(s) < 0).all()
    np.testing.assert_allclose(1 / (a + s), ended["mean_free_path_mm"])
    assert "reflectance" not in told("dj3")


def test_the_error_of_the_model_is_reported_with_that_of_the_fit(
    told: Callable[..., dict[str, Any]], run: Run, tmp_path: Path
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "accuracy.md").read_text("utf-8")
    row = page.partition("| **skin2** |")[2].partition("| | layered |")[2].split("|")[1]
    own = told("skin2", "--model", "layered")["model_error"]
    assert own["tissues"] == ["skin2"] and own["least"] == own["most"]
    np.testing.assert_allclose(own["most"], [float(x) / 100 for x in row.split("%")[0].split()], atol=1e-9)
    other = told("skin2", "--eta", 1.2)["model_error"]
    assert len(other["tissues"]) == 6 and other["least"][0] <= own["most"][0] < other["most"][0]
    assert "\nmodel  " in run("profile", "skin2").stdout
    assert max(told("skin2")["model_error"]["most"]) < 0.1 * min(own["most"])  # counted photons
    assert "model_error" not in told("skin2", "--model", "montecarlo", "--photons", 2000)
    plot = told("skin2", "--plot", tmp_path / "a.svg", "--check", "--photons", 20000, "--model", "layered")
    np.testing.assert_allclose(
        plot["model_error"]["most"], own["most"], rtol=0.35
    )  # few photons, another index


@pytest.mark.parametrize("model", ["dipole", "better-dipole", "multipole", "layered", "layered-point"])
def test_every_model_gives_a_profile(told: Callable[..., dict[str, Any]], model: str) -> None:
    report = told("marble", "--model", model, "--fit", "4")
    assert report["model"] == model
    assert 0.7 < min(report["total"]) < max(report["total"]) < 0.9
    assert max(report["gaussians"]["error"]) < 0.1
    kind = "annulus" if model == "layered" else "pointwise"
    assert report["gaussians"]["error_kind"] == kind


def test_the_index_of_refraction_changes_the_profile(told: Callable[..., dict[str, Any]]) -> None:
    skin = told("skin1", "--model", "dipole")
    matched = told("skin1", "--model", "dipole", "--eta", "1")
    assert (skin["eta"], matched["eta"]) == (1.4, 1.0)
    assert min(np.array(matched["total"]) - skin["total"]) > 0.0


def test_photons_are_reproducible_and_carry_their_error(told: Callable[..., dict[str, Any]]) -> None:
    words = ("skin1", "--model", "montecarlo", "--photons", "20000", "--eta", "1.3", "--seed")
    one, same, other = told(*words, 1), told(*words, 1), told(*words, 2)
    assert one == same != other
    error = np.array(one["total_standard_error"])
    assert (error > 0.0).all() and (error < 0.01).all()
    truth = np.array([0.43953, 0.21313, 0.11548])  # 12 million photons
    assert (np.abs(one["total"] - truth) < 4 * error).all()
    assert np.shape(one["standard_error_per_mm2"]) == np.shape(one["reflectance_per_mm2"])


def test_photons_that_nothing_traces_are_noted(run: Run) -> None:
    assert "have no effect without --model montecarlo" in run("profile", "skin1", "--photons", 1000).stderr
    assert "traced" not in run("profile", "skin1").stderr


def test_the_option_overrides_the_structure_of_a_file(
    folder: Path, told: Callable[..., dict[str, Any]]
) -> None:
    (folder / "own.toml").write_text("[skin]\nstructure = 'biospec'\n")
    assert len(told("own.toml")["layers"]) == 4
    assert told("own.toml", "--skin", "donner2008")["layers"][1] == "melanin sheet"


def test_skin_of_pigments(told: Callable[..., dict[str, Any]]) -> None:
    pale, tanned = (told("spectral", "--melanin", m) for m in ("0.01", "0.1"))
    assert pale["per"].startswith("of incident light")
    assert (np.array(tanned["total"]) < pale["total"]).all()
    assert pale["total"] == sorted(pale["total"], reverse=True)  # skin is red before green before blue
    assert np.shape(pale["mean_free_path_mm"]) == (2, len(pale["wavelength_nm"]))
    assert told("light", "--skin", "biospec")["layers"][0] == "stratum corneum"


def test_colour_through_a_thickness(run: Run, told: Callable[..., dict[str, Any]]) -> None:
    through = told("dj3", "--through", "0.5,2,8")["transmission"]
    assert through["thickness_mm"] == [0.5, 2, 8]
    assert "8 mm, by slab" in run("profile", "dj3", "--through", "0.5,2,8").stdout
    for way in ("gaussians", "slab"):
        colour = np.array(through[way])
        assert colour.shape == (3, 3) and (np.diff(colour, axis=0) <= 0.0).all()
        assert (colour[1] == np.sort(colour[1])[::-1]).all()  # red comes through


@pytest.mark.parametrize("kind", ["burley", "separable"])
def test_other_kinds_of_fit(told: Callable[..., dict[str, Any]], kind: str) -> None:
    report = told("skin1", "--model", "layered", "--fit-kind", kind)
    assert np.shape(report[kind]["error"]) == (3,)
    assert min(report[kind]["error"]) > max(report["gaussians"]["ring_error"])
    if kind == "burley":
        assert report[kind]["unity_parameters"]["max_radius_mm"] > 0.0
        assert report[kind]["unreal_parameters"]["surface_albedo"] == pytest.approx(report["total"])


def test_own_widths_for_each_channel_fit_better(told: Callable[..., dict[str, Any]]) -> None:
    shared = told("skin1", "--fit", "3")["gaussians"]
    own = told("skin1", "--fit", "3", "--variances", "per-channel", "--keep-energy")["gaussians"]
    assert len(own["variances_mm2"]) == 9
    assert sum(own["error"]) < sum(shared["error"])
    assert own["energy_error"] == pytest.approx([0, 0, 0], abs=1e-6)


def test_written_profile_is_read_back(run: Run, folder: Path, told: Callable[..., dict[str, Any]]) -> None:
    assert run("profile", "light", "--melanin", "0.02", "-o", "own.toml").code == 0
    read = load_profile("own.toml")
    again = told("own.toml")
    fresh = told("light", "--melanin", "0.02")["gaussians"]
    assert again["model"] == "table"
    assert read.weight.tolist() == again["gaussians"]["weights"] == fresh["weights"]
    assert read.variance_mm2.tolist() == fresh["variances_mm2"]
    assert "melanin = 0.02" in (folder / "own.toml").read_text()


def test_render_accepts_the_written_profile(run: Run, render: Run, folder: Path) -> None:
    """Another profile gives another picture of the same head in the same light."""
    assert run("profile", "skin2", "-o", "own.toml").code == 0
    pictures = []
    for number, name in enumerate(("own.toml", "gpu-gems-3", "skin2")):
        ended = render("head.obj", "--profile", name, "-o", f"{number}.png")
        assert ended.code == 0, ended.stderr
        pictures.append(read_image(folder / f"{number}.png"))
    assert np.array_equal(pictures[0], pictures[2])  # the name computes what the file holds
    assert not np.array_equal(pictures[0], pictures[1])


def test_a_table_of_gaussians_is_its_own_fit(told: Callable[..., dict[str, Any]]) -> None:
    table = told("gpu-gems-3")
    assert table["gaussians"]["weights"][0] == [0.233, 0.455, 0.649]
    assert table["gaussians"]["error"] == [0, 0, 0]
    refit = told("gpu-gems-3", "--fit", "4")["gaussians"]
    assert 0.0 < max(refit["error"]) < 0.1


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_plot_is_written_and_repeatable(run: Run, folder: Path, suffix: str) -> None:
    for name in ("a", "b"):
        words = ("--check", "--photons", "2000") if suffix == ".png" else ()
        assert run("profile", "skin1", "--plot", f"{name}{suffix}", *words).code == 0
    one, two = ((folder / f"{name}{suffix}").read_bytes() for name in ("a", "b"))
    assert len(one) > 5000
    assert one == two


def test_the_report_is_readable_text(run: Run) -> None:
    ended = run("profile", "dj3", "--fit-kind", "burley", "--through", "1")
    assert ended.code == 0
    assert "epidermis" in ended.stdout and "variance mm2" in ended.stdout and "1 mm" in ended.stdout
    assert "warning" in run("profile", "skin1", "--model", "layered").stderr
    assert "skin1, model counted" in run("profile", "skin1").stdout


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nothing"], "dj3"),
        (["nothing.toml"], "No such file"),
        (["dj3", "--model", "dipole"], "one semi-infinite layer"),
        (["dj3", "--model", "monopole"], "monopole"),
        (["dj3", "--fit", "0"], "1 to 8"),
        (["dj3", "--fit", "9"], "1 to 8"),
        (["dj3", "--fit", "2.5"], "2.5"),
        (["dj3", "--eta", "0.5"], "1 to 2.5"),
        (["dj3", "--melanin", "0.1"], "--melanin"),
        (["dj3", "--skin", "biospec"], "--skin"),
        (["gpu-gems-3", "--model", "dipole"], "--model"),
        (["gpu-gems-3", "--eta", "1.3"], "--eta"),
        (["light", "--melanin", "1.5"], "--melanin"),
        (["light", "--melanin", "nan"], "--melanin"),
        (["light", "--epidermis-mm", "-1"], "--epidermis-mm"),
        (["skin1", "--model", "montecarlo", "--photons", "0"], "photons"),
        (["skin1", "--model", "montecarlo", "--photons", "1000", "--seed", "-1"], "seed"),
        (["skin1", "--model", "montecarlo", "--photons", "1000", "--anisotropy", "1"], "cosine"),
        (["dj3", "--through", "0"], "from 1e-06 to 10000"),
        (["dj3", "--through", "thick"], "0.5,1,2"),
        (["dj3", "-o", "own.csv"], ".toml"),
        (["dj3", "--plot", "own.bmp"], ".svg"),
        (["dj3", "--plot", "nowhere/own.png"], "no folder"),
        (["dj3", "--check"], "--plot"),
        (["gpu-gems-3", "--check", "--plot", "own.png"], "--check"),
        (["dj3", "-o", "own.toml", "--plot", "own.png", "--check", "--photons", "0"], "photons"),
        (["own.csv"], "no such file"),
        (["endless.csv"], "at most 1.0 MB"),
        (["a" * 5000], "no such file"),
    ],
)
def test_invalid_options_are_refused(run: Run, folder: Path, words: list[str], complaint: str) -> None:
    (folder / "endless.csv").write_bytes(b"0" * ((1 << 20) + 1))
    before = sorted(folder.iterdir())
    ended = run("profile", *words)
    assert (ended.code, ended.stdout) == (2, ""), ended.stdout
    assert ended.stderr.startswith("dermis: ") and complaint in ended.stderr
    assert "Traceback" not in ended.stderr and sorted(folder.iterdir()) == before
