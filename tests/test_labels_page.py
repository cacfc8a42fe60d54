"""The page about labels lists all classes and sets, and its Python code runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dermis.base.tables import read_rows
from dermis.human.labels.classes import label_classes
from dermis.human.landmarks.sets import LANDMARK_SETS, SILHOUETTE_SUFFIX

PAGE = (Path(__file__).parents[1] / "docs" / "labels.md").read_text("utf-8")


def test_all_classes_are_listed() -> None:
    for one in label_classes():
        assert f"| {one.number} | `{one.name}` | {one.face_synthetics} | {one.description} |\n" in PAGE
    assert [one.number for one in label_classes()] == list(range(len(label_classes())))


@pytest.mark.parametrize("name", LANDMARK_SETS)
def test_all_sets_are_listed_with_their_counts(name: str) -> None:
    rows = read_rows("dermis.human.landmarks", name)
    count = len({row["landmark"] for row in rows})  # candidates of a silhouette share a name
    assert f"| `{name}` | {count} |" in PAGE
    assert count == len(rows) or name.endswith(SILHOUETTE_SUFFIX)


def test_examples_of_the_labels_page_run(monkeypatch: pytest.MonkeyPatch, device: object) -> None:
    """At a small size."""
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    text = "".join(re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
    names: dict[str, object] = {}
    exec(text.replace("size=512", "size=48, atlas=128, samples=1, shadow_size=128"), names)
    assert getattr(names["label"], "shape", None) == (48, 48)
    assert getattr(names["gaze"], "shape", None) == (2, 3)
