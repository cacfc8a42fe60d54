"""Media: presets, files, and refused input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.base.reading import read_toml
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.media import Layer, Medium, medium_from_toml, published_media
from dermis.optics.profiles import load_profile
from dermis.optics.tissue import load_tissue

ONE = np.array([1.0])


def parsed(tmp_path: Path, text: str) -> Medium:
    path = tmp_path / "own.toml"
    path.write_text(text)
    return medium_from_toml(path, read_toml(path))


def test_published_media() -> None:
    known = published_media()
    assert {"dj3", "skin1", "skin2", "marble", "wholemilk", "spectralon", "ketchup"} <= set(known)
    assert known["marble"].layers[0].sigma_s_prime.tolist() == [2.19, 2.62, 3.00]
    assert known["skin1"].layers[0].sigma_a.tolist() == [0.032, 0.17, 0.48]
    assert [layer.thickness_mm for layer in known["dj3"].layers] == [0.25, 0.20, np.inf]
    # The unit under which the deck's "0.02083 mm between events" is a tenth of a millimetre and more.
    assert 1.0 / known["dj3"].layers[0].sigma_s_prime[0] == pytest.approx(10 * 0.02083, rel=1e-3)


@pytest.mark.parametrize("name", sorted(published_media()))
def test_every_medium_has_a_profile(name: str) -> None:
    profile = diffusion_profile(published_media()[name])
    assert ((profile.total > 0.0) & (profile.total <= 1.0 + 1e-9)).all()
    assert profile.sources


def test_quantities_of_a_layer() -> None:
    """Expected values are those of marble in the notebook of [dEonLuebke2007]."""
    layer = published_media()["marble"].channel(1).layers[0]
    assert layer.mean_free_path_mm[0] == pytest.approx(0.38108304, abs=1e-8)
    assert layer.D[0] == pytest.approx(layer.mean_free_path_mm[0] / 3.0)
    assert layer.alpha_prime[0] == pytest.approx(0.99843756, abs=1e-8)


def test_medium_of_a_file(tmp_path: Path) -> None:
    text = """
        eta = 1.3
        [[layers]]
        name = "top"
        thickness_mm = 0.3
        absorption_per_mm = [0.1, 0.2, 0.3]
        scattering_per_mm = [4, 5.5, 6]
        [[layers]]
        absorption_per_mm = [0.01, 0.02, 0.03]
        scattering_per_mm = [1, 1, 1]
    """
    medium = parsed(tmp_path, text)
    assert (medium.name, medium.eta, len(medium.layers)) == ("own", 1.3, 2)
    assert medium.layers[0].sigma_s_prime.tolist() == [4.0, 5.5, 6.0]
    assert medium.layers[1].name == "layer" and medium.is_semi_infinite


LAYER = "[[layers]]\nabsorption_per_mm = [1,1,1]\nscattering_per_mm = [1,1,1]\n"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("eta = 1.4", r"\[\[layers\]\]"),
        ("layers = 3", r"\[\[layers\]\]"),
        ("layers = []", "at least one layer"),
        ("eta = 'x'\n" + LAYER, "eta: expected a number from 1 to 2.5"),
        ("eta = 0.7\n" + LAYER, "from 1 to 2.5"),
        ("eta = nan\n" + LAYER, "from 1 to 2.5"),
        ("colour = 1\n" + LAYER, "got colour"),
        (LAYER + "thickness = 1", "got thickness"),
        (LAYER + "thickness_mm = -1", "thickness_mm: expected a number from 1e-09 to 10000"),
        (LAYER + "thickness_mm = nan", "thickness_mm: expected a number from 1e-09 to 10000"),
        (LAYER + LAYER, "infinite in the last layer only"),
        (LAYER.replace("[1,1,1]", "[1,1]", 1), "absorption_per_mm: expected 3 numbers"),
        (LAYER.replace("[1,1,1]", "['a',1,1]", 1), "expected 3 numbers"),
        (LAYER.replace("[1,1,1]", "[-1,1,1]", 1), "3 numbers from 0 to 1000000"),
        (LAYER.replace("[1,1,1]", "[nan,1,1]", 1), "3 numbers from 0 to 1000000"),
        (LAYER.replace("scattering_per_mm = [1", "scattering_per_mm = [0"), "scattering from 1e-06 to"),
        ("[[layers", "cannot be understood"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(DermisError, match=complaint):
        parsed(tmp_path, text)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="No such file"):
        read_toml(tmp_path / "none.toml")


def test_layers_must_agree() -> None:
    with pytest.raises(DermisError, match="the same number of channels"):
        Medium("odd", (Layer(ONE, ONE, 1.0), Layer(np.ones(2), np.ones(2))))


def test_warnings_name_the_reason() -> None:
    assert any("absorbs" in text for text in diffusion_profile(published_media()["skin1"]).warnings)
    assert not diffusion_profile(published_media()["marble"]).warnings
    wide = Medium("thin air", (Layer(0.001 * ONE, 0.05 * ONE),))
    assert any("beyond the widest radius" in text for text in diffusion_profile(wide).warnings)
    printed = diffusion_profile(_thin(), "multipole", clamp="none")
    assert any("negative" in text for text in printed.warnings)


def test_absorption_is_reported_where_the_beam_meets_it() -> None:
    """An absorbing layer is reported below a thin clear layer, but not below the first mean free path."""
    clear, dark = Layer(0.01 * ONE, 2.0 * ONE, 0.05), Layer(2.0 * ONE, 2.0 * ONE)
    for top, expected in ((0.05, True), (2.0, False)):
        medium = Medium("skin", (Layer(clear.sigma_a, clear.sigma_s_prime, top), dark))
        assert any("absorbs" in text for text in diffusion_profile(medium).warnings) is expected


def test_light_below_zero_and_finer_than_its_numbers_is_told() -> None:
    corneum = Layer(0.02 * ONE, 5.0 * ONE, 0.01)
    medium = Medium("skin", (corneum, Layer(0.5 * ONE, 2.5 * ONE)))
    assert any("negative at some radii" in text for text in diffusion_profile(medium, "multipole").warnings)
    assert not diffusion_profile(Medium("skin", medium.layers[1:]), "multipole").warnings[1:]
    foil = Medium("foil", (Layer(0.02 * ONE, 5.0 * ONE, 1e-6), medium.layers[1]))
    assert any("more light than the total" in text for text in diffusion_profile(foil, "multipole").warnings)


def _thin() -> Medium:
    thin = Layer(0.02 * ONE, 0.98 * ONE, 0.1)
    return Medium("cut", (thin, Layer(0.02 * ONE, 0.98 * ONE)))


@pytest.mark.parametrize("name", ["skin1", "spectral"])
def test_rings_alone_are_those_of_the_profile(name: str) -> None:
    tissue = load_tissue(name)
    alone, whole = tissue.ring_target(), tissue.profile().ring_target()
    assert np.array_equal(alone.energy, whole.energy) and np.array_equal(alone.total, whole.total)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            LAYER + "g = 0.9\n",
            r"layer 1: .*it has g = 0\.9\. .* write scattering_per_mm = \[0\.1, 0\.1, 0\.1\]; ",
        ),
        (LAYER + "anisotropy = 0.75\n", r"no anisotropy, .*scattering_per_mm = \[0\.25, 0\.25, 0\.25\]; "),
        (LAYER + "g = [0.5, 0.6, 0.7]\n", r"scattering_per_mm = \[0\.5, 0\.4, 0\.3\]; "),
        (LAYER + "g = 'high'\n", r"scattering_per_mm = mu_s \(1 - g\); "),
        ("g = 0.9\n" + LAYER, r"own\.toml: .*it has g = 0\.9\. .*mu_s \(1 - g\); then take g out"),
    ],
)
def test_an_anisotropy_is_refused_with_the_reduced_scattering(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DermisError, match=words):
        parsed(tmp_path, text)


MCML = """\
1.0                      # file version
1                        # number of runs
temp1.mco  A             # output filename, ASCII/Binary
100000                   # No. of photons
20E-4  20E-4             # dz, dr
100  100  30             # No. of dz, dr & da.
2                        # No. of layers
# n  mua  mus  g  d      # One line for each layer
1.0                      # n for medium above.
1.4  1.5  200  0.9  0.01 # epidermis
1.4  0.2  100  0.8  1E8  # dermis
1.0                      # n for medium below.
"""


@pytest.mark.parametrize("load", [load_tissue, load_profile])
def test_files_of_mcml_are_refused_with_their_values_in_mm(
    tmp_path: Path, load: Callable[[Path], object]
) -> None:
    (tmp_path / "skin.mci").write_text(MCML)
    with pytest.raises(DermisError, match=r"skin\.mci: .*its scattering is not reduced") as caught:
        load(tmp_path / "skin.mci")
    assert "layer 1: absorption_per_mm 0.15, scattering_per_mm 2, thickness_mm 0.1, eta 1.4" in str(
        caught.value
    )
    assert "layer 2: absorption_per_mm 0.02, scattering_per_mm 2, no thickness_mm, eta 1.4" in str(
        caught.value
    )


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe\0", b"1 2 3 4 5\n" * 9000, b"1 2 3 4 nan\n1 1 1 1 1e999\n"]
)
def test_damaged_files_of_mcml_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "skin.mco").write_bytes(content)
    with pytest.raises(DermisError, match=r"mu_s' = mu_s \(1 - g\)") as caught:
        load_tissue(tmp_path / "skin.mco")
    assert len(str(caught.value)) < 1500
