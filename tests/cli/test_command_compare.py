"""`dermis compare specular`: its JSON, table and pictures; and the surface options of `dermis render`."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tolerances import RECIPROCAL

from dermis.cli.compare import _lobe_figure
from dermis.images.io import read_image
from dermis.specular.models import MODELS

Run = Callable[..., Any]


@pytest.fixture
def compare(run: Run, device: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return a function that runs `dermis compare` on the device of the session."""
    monkeypatch.setattr("dermis.gpu.open_device", lambda adapter: device)
    monkeypatch.chdir(tmp_path)
    return lambda *words: run("compare", *words)


def test_json_has_albedos_errors_and_costs_of_every_model(compare: Run, device: Any) -> None:
    ended = compare("specular", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)
    assert report["adapter"] == device.adapter.name
    assert report["hemispherical_fresnel"]["exact"] == pytest.approx(0.0768, abs=1e-4)
    assert list(report["models"]) == list(MODELS)
    for name, found in report["models"].items():
        rows = found["albedo"]
        assert [set(row) for row in rows] == [{"m", "cos_theta", "rho"}] * 100
        assert {row["m"] for row in rows} == {0.1, 0.2, 0.3, 0.4, 0.5}
        assert all(0 < row["rho"] < 1 for row in rows)
        assert (found["reciprocity_error"] < RECIPROCAL) is found["reciprocal"] is MODELS[name].reciprocal
        assert 0 <= found["gpu_ns"] < 1e4 and 0 <= found["gpu_ns_exact_fresnel"] < 1e4
    assert any(found["gpu_ns"] > 0 for found in report["models"].values())


def test_albedos_are_those_of_independent_tables(compare: Run, sample_folder: Path) -> None:
    truth = np.load(sample_folder / "reference" / "data" / "specular_rho_dt.npz")
    found = json.loads(compare("specular", "--json").stdout)["models"]["torrance-sparrow-smith"]["albedo"]
    rho = np.array([row["rho"] for row in found]).reshape(5, 20)
    assert [row["m"] for row in found[::20]] == pytest.approx(truth["m"])
    assert [row["cos_theta"] for row in found[:20]] == pytest.approx(truth["cos_theta"])
    assert np.abs(rho / truth["ts_smith"] - 1).max() < 0.005


def test_table_names_models_and_why_some_are_not_reciprocal(compare: Run) -> None:
    ended = compare("specular", "--roughness", "0.25")
    assert ended.code == 0 and ended.stdout.startswith("roughness 0.25")
    for name, model in MODELS.items():
        row = next(line for line in ended.stdout.splitlines() if line.startswith(f"{name} "))
        assert len(row.split()) == 10
        assert model.reciprocal or f"{name}: {model.note}." in ended.stdout
    percentage = re.search(r"reflects ([\d.]+)% of uniform illumination", ended.stdout)
    assert percentage and float(percentage[1]) == pytest.approx(7.68, abs=0.06)


def test_pictures_are_written_into_a_new_folder(compare: Run) -> None:
    assert compare("specular", "-o", "deep/plots").code == 0
    for name in ("lobes", "albedo"):
        picture = read_image(f"deep/plots/{name}.png")
        assert picture.shape[1] > 500 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize("m", [0.1, 1.0])
def test_curves_stay_inside_their_panel(m: float) -> None:
    for axes in _lobe_figure(m).axes:
        assert all(curve.get_ydata().max() <= axes.get_rmax() for curve in axes.lines)


def test_lobes_of_other_packages_have_panels_of_their_own() -> None:
    with MODELS.temporary_entry("other", MODELS["phong"]), MODELS.temporary_entry("another", MODELS["phong"]):
        assert [axes.get_title() for axes in _lobe_figure(0.3).axes][-2:] == ["other", "another"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("moon",), "expected a mesh file or a sample"),
        (("head.obj", "--against", "taste"), "--against: expected one of surface-integral"),
        (("head.obj", "--techniques", "none,magic"), "--techniques: expected"),
        (("head.obj", "--size", "wide"), "--size: expected WIDTHxHEIGHT"),
        (("head.obj", "-o", "report.pdf"), "expected a name that ends in .html"),
        ((), "expected a value"),
        (("specular", "--roughness", "2"), "--roughness: expected a number from 0.05 to 1 "),
        (("specular", "-o", "taken/plots"), "expected a writable path"),
        (("head.obj", "--roughness", "0.4"), "--roughness: expected no such option here"),
        (("head.obj", "--samples", "8"), "--samples: expected no such option here"),
        (("head.obj", "--against", "heat", "--samples", "8"), "only path-traced and cycles trace paths"),
        (("specular", "--light", "back"), "--light: expected no such option here"),
        (("specular", "--against", "heat"), "--against: expected no such option here"),
    ],
)
def test_invalid_options_are_refused(compare: Run, words: tuple[str, ...], says: str) -> None:
    Path("taken").write_text("a file")
    ended = compare(*words)
    assert (ended.code, ended.stdout) == (2, "")
    assert says in ended.stderr and ended.stderr.count("\n") == 1


def test_surface_options_of_render_reach_the_picture(render: Run) -> None:
    def picture(*words: str) -> Any:
        assert render("head.obj", "--rho-s", "1", "-o", "a.exr", *words).code == 0
        return read_image("a.exr")

    plain = picture()
    for words in (
        ("--specular", "phong"),
        ("--specular", "none"),
        ("--fresnel", "exact"),
        ("--energy", "published"),
        ("--energy", "none"),
        ("--oiliness", "1"),
    ):
        assert not np.array_equal(picture(*words), plain), words
    np.testing.assert_array_equal(picture("--specular", "two-lobe", "--energy", "full"), plain)
    Path("s.toml").write_text('[head]\nname = "head.obj"\n[skin]\nspecular = "phong"\nrho_s = 1\n')
    from_file = render("s.toml", "-o", "b.exr")
    assert from_file.code == 0
    np.testing.assert_array_equal(read_image("b.exr"), picture("--specular", "phong"))


def test_wrong_colour_needs_a_map_to_be_seen(render: Run, folder: Path) -> None:
    from dermis.images.io import write_png

    write_png(folder / "red.png", np.broadcast_to(np.uint8([200, 60, 40]), (16, 16, 3)).copy())
    words = ("--colour", "red.png", "--rho-s", "1", "-o", "a.exr")
    assert render("head.obj", *words).code == 0
    white = read_image("a.exr")
    assert render("head.obj", *words, "--specular-colour", "wrong").code == 0
    wrong = read_image("a.exr")
    assert (wrong <= white + 1e-6).all() and wrong[..., 2].sum() < white[..., 2].sum()


def test_techniques_are_compared_with_a_reference(run: Run, folder: Path, opened: None) -> None:
    """Rows in JSON, and a self-contained page."""
    words = ("--size", "24x24", "--atlas", "128", "--techniques", "none,texture-space")
    ended = run("compare", "head.obj", *words, "-o", "report.html", "--json")
    assert ended.code == 0, ended.stderr
    rows = json.loads(ended.stdout)["rows"]
    assert [row["technique"] for row in rows] == ["none", "texture-space"]
    for row in rows:
        assert row["against"] == "surface-integral" and row["relrmse_se"] == 0.0
        assert np.isfinite([row["relrmse"], row["energy_ratio"], row["ms"]]).all()
    assert Path("report.html").read_text(encoding="utf-8").count("<img") == 5
