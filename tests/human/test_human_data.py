"""Data of the parametric human in the package, compared with the published files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.human.skin.textures import detail_cavities, detail_heights_mm, detail_slopes

TOOLS = Path(__file__).parents[2] / "tools"
DATA = Path(__file__).parents[2] / "src" / "dermis" / "human" / "data"
MOST_BYTES = 2_500_000


def test_data_is_small_and_states_its_licence() -> None:
    assert (DATA / "human.npz").stat().st_size < MOST_BYTES
    assert "CC0 1.0" in (DATA / "LICENCE.md").read_text("utf-8")


@pytest.mark.samples
def test_data_equals_the_output_of_the_tool(
    sample_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    import human_data

    monkeypatch.setattr(human_data, "OUT", tmp_path / "human.npz")
    human_data.main(sample_folder / "heads" / "human")
    with np.load(tmp_path / "human.npz") as made, np.load(DATA / "human.npz") as kept:
        assert set(made) == set(kept)
        for name in kept:
            if kept[name].dtype.kind == "f":
                assert np.abs(made[name] - kept[name]).max() < 1e-4
            else:
                assert np.array_equal(made[name], kept[name])


@pytest.mark.samples
def test_average_person_equals_the_output_of_the_tool(
    sample_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    import human_fields

    monkeypatch.setattr(human_fields, "OUT", tmp_path / "average.npz")
    human_fields.main(sample_folder / "heads" / "human")
    with np.load(tmp_path / "average.npz") as made, np.load(DATA / "average.npz") as kept:
        assert set(made) == set(kept)
        assert np.abs(made["places"].astype(int) - kept["places"]).max() <= 1
        assert np.abs(made["fields"].astype(int) - kept["fields"]).max() <= 20  # hundredths of a mm


def test_detail_tile_equals_the_output_of_the_tool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    import human_detail
    from PIL import Image

    monkeypatch.setattr(human_detail, "OUT", tmp_path / "detail.png")
    human_detail.main()
    made, kept = (
        np.asarray(Image.open(path), int) for path in (tmp_path / "detail.png", DATA / "detail.png")
    )
    assert np.abs(made - kept).max() <= 1


def test_detail_tile_is_periodic() -> None:
    """Check that slopes at the edges are not steeper than inside."""
    slopes = np.abs(detail_slopes()[..., 2:])
    edge = np.concatenate([slopes[0], slopes[-1], slopes[:, 0], slopes[:, -1]])
    assert edge.mean() < 1.3 * slopes.mean()


def test_lines_follow_the_tension() -> None:
    """Both tiles are drawn for a tension line along +u: slopes across it are steeper."""
    pore_u, pore_v, line_u, line_v = np.moveaxis(detail_slopes(), -1, 0)
    assert line_v.std() > 1.25 * line_u.std()
    assert pore_v.std() > 1.05 * pore_u.std()


def test_cavities_keep_the_mean_colour() -> None:
    cavities, depth = detail_cavities(), np.asarray(detail_heights_mm())
    assert np.abs(cavities.mean(axis=(0, 1))).max() < 1e-4
    for pattern in (0, 1):
        assert np.corrcoef(cavities[..., pattern].ravel(), depth[pattern].ravel())[0, 1] < -0.6
