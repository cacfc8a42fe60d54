"""Gallery scripts run at a small size and have descriptions."""

from __future__ import annotations

import csv
import re
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.apps.gallery.panels import first_frame, to_srgb8
from dermis.apps.gallery.script import Script, find_scripts, read_script
from dermis.apps.gallery.studio import Studio
from dermis.apps.truths import slab_mc
from dermis.base import citations as cite
from dermis.base.errors import DermisError
from dermis.human.person import Human
from dermis.mesh.head import Head

SCRIPTS = find_scripts()
DECK = (resources.files("dermis.apps.gallery") / "deck.csv").read_text(encoding="utf-8").splitlines()
ROWS = {row["row"]: row for row in csv.DictReader(line for line in DECK if not line.startswith("#"))}


class CoarseStudio(Studio):
    """Studio that shows heads with the triangles of their files."""

    def head(self, name: str | None = None, **options: Any) -> Head:
        return self._load(name or self.name, subdivide=0, **options)


@pytest.fixture(scope="module")
def studio() -> Studio:
    return CoarseStudio("lee_perry_smith", 48, atlas=128, samples=1, shadow_size=256)


@pytest.fixture
def coarse_people(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load people with the triangles of their template, which is enough for small pictures."""
    head = Human.head
    monkeypatch.setattr(Human, "head", lambda self, **options: head(self, **{**options, "subdivide": 0}))


@pytest.fixture
def few_photons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate few photons, which is enough for small pictures."""
    simulate = slab_mc.monte_carlo_profile
    monkeypatch.setattr(
        slab_mc,
        "monte_carlo_profile",
        lambda medium, **options: simulate(medium, **{**options, "photons": 20_000}),
    )


@pytest.mark.samples
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_script_runs(script: Script, studio: Studio, coarse_people: None, few_photons: None) -> None:
    panels = script.draw(studio)
    for caption, panel in panels.items():
        picture = to_srgb8(first_frame(panel))
        assert picture.ndim == 3 and picture.shape[2] == 3
        assert np.ptp(picture) > 20 or "difference" in caption
    assert script.slider is None or set(script.slider) <= set(panels)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_script_has_a_description(script: Script) -> None:
    assert script.title and len(script.caption) > 40
    assert set(script.sources) <= cite.citation_keys()
    assert set(script.deck) <= set(ROWS)
    assert len(script.path.read_text(encoding="utf-8").splitlines()) <= 40


def test_every_row_of_the_talk_has_a_picture_or_a_command() -> None:
    shown = {row for script in SCRIPTS for row in script.deck}
    assert [row for row, says in ROWS.items() if not says["command"] and row not in shown] == []
    assert set(ROWS) == {f"S{number}" for number in range(1, 26)} | {"+"}


def test_docstring_is_read_without_running_the_script(tmp_path: Path) -> None:
    path = tmp_path / "01_one.py"
    path.write_text('"""A title.\n\nWhat to\nsee.\n\nDeck: S1, S2\nSlider: a | b\n"""\nraise SystemExit\n')
    script = read_script(path)
    assert (script.title, script.caption) == ("A title", "What to see.")
    assert (script.deck, script.slider, script.sources) == (("S1", "S2"), ("a", "b"), ())


def test_unknown_script_names_are_refused() -> None:
    with pytest.raises(DermisError, match=r"--only.*got 'nothing'.*01_portrait"):
        find_scripts(["nothing"])
    assert [script.name for script in find_scripts(["seams", "01"])] == ["01_portrait", "17_seams"]


def test_figure_numbers_are_unique() -> None:
    assert [script.name for script in find_scripts(["1", "01"])] == ["01_portrait"]
    for nothing in ("", "99"):
        with pytest.raises(DermisError, match="--only"):
            find_scripts([nothing])


def test_pages_show_only_pictures_drawn_by_scripts() -> None:
    """Pages may also show other pictures of that folder, such as the viewer's."""
    root = Path(__file__).parents[2]
    drawn = {script.name for script in SCRIPTS}
    for page in (root / "README.md", *(root / "docs").glob("*.md")):
        shown = re.findall(r"images/([\w-]+)\.webp", page.read_text(encoding="utf-8"))
        for name in set(shown) - drawn:
            assert (root / "docs" / "images" / f"{name}.webp").is_file(), f"{page.name}: {name}"
