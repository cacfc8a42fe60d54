"""The data of the parametric human in the package, against the published files that it is made of."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

TOOLS = Path(__file__).parents[2] / "tools"
DATA = Path(__file__).parents[2] / "src" / "dermis" / "human" / "data"
MOST_BYTES = 2_500_000


def test_it_is_small_and_says_whose_it_is() -> None:
    assert (DATA / "human.npz").stat().st_size < MOST_BYTES
    assert "CC0 1.0" in (DATA / "LICENCE.md").read_text("utf-8")


@pytest.mark.samples
def test_it_is_what_the_tool_makes(
    sample_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    import human_data

    monkeypatch.setattr(human_data, "OUT", tmp_path / "human.npz")
    monkeypatch.setattr(sys, "argv", ["human_data.py", str(sample_folder / "heads" / "human")])
    human_data.main()
    with np.load(tmp_path / "human.npz") as made, np.load(DATA / "human.npz") as kept:
        assert set(made) == set(kept)
        for name in kept:
            if kept[name].dtype.kind == "f":
                assert np.abs(made[name] - kept[name]).max() < 1e-4
            else:
                assert np.array_equal(made[name], kept[name])
