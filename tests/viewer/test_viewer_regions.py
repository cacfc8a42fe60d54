"""Choice of a table of face regions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dermis.apps.viewer.session import with_region_table
from dermis.apps.viewer.state import ViewerState
from dermis.base.errors import DermisError
from dermis.human.regions.region_table import REGIONS
from dermis.scene.head_table import AUTO
from dermis.scene.skin import Skin


@pytest.fixture
def table(tmp_path: Path) -> str:
    """Return the path of a table of regions with a label picture whose lower half is another region."""
    labels = np.zeros((16, 16), np.uint8)
    labels[8:] = 3
    Image.fromarray(labels).save(tmp_path / "labels.png")
    rows = [f'"{name}" = {{ m = 0.3, rho_s = {0.1 + 0.05 * k:.2f} }}' for k, name in enumerate(REGIONS)]
    (tmp_path / "regions.toml").write_text("\n".join(['labels = "labels.png"', *rows, ""]))
    return str(tmp_path / "regions.toml")


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.human.regions.apply.MIN_MAP_SIDE", 64)


def test_table_adds_maps_and_none_removes_them(state: ViewerState, table: str) -> None:
    found = with_region_table(state, table)
    maps = found.scene.head.maps
    assert maps.specular is not None and np.ptp(maps.specular) > 0.05
    assert 0.1 < found.scene.skin.rho_s < 0.25 and found.head["regions"] == table
    bare = with_region_table(found, AUTO)
    assert bare.scene.head.maps.specular is None and "regions" not in bare.head
    assert bare.scene.skin.rho_s == Skin().rho_s


def test_loaded_heads_are_not_rebuilt(state: ViewerState, table: str) -> None:
    found = with_region_table(state, table)
    assert with_region_table(found, AUTO, [state, found]).scene.head is state.scene.head
    assert with_region_table(state, table, [state, found]).scene.head is found.scene.head


def test_heads_without_known_regions_are_refused(state: ViewerState) -> None:
    with pytest.raises(DermisError):
        with_region_table(state, "default")
    with pytest.raises(DermisError, match="created in memory"):
        with_region_table(ViewerState(state.scene), "default")
