"""Exports of skin in a state: maps and eyes show it, and targets without maps refuse it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import dermis.apps.export.targets.web.build as web_build
from dermis import DermisError, Human, export_skin
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import load_subject
from dermis.base.errors import DermisWarning
from dermis.human.hair.look import HairLook
from dermis.human.person_file import write_person_json
from dermis.human.skin.painted import PaintedMaps


@pytest.fixture(scope="module")
def person_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("person") / "bald.json"
    write_person_json(path, Human(hair=HairLook("none")))
    return path


def test_painted_maps_and_eyes_show_the_state(person_file: Path) -> None:
    plain, crying = (
        load_subject(person_file, state=state).with_painted_maps(256, "auto").scene
        for state in (None, {"crying": 1.0, "blush": 1.0})
    )
    assert plain and crying and plain.head.eyes and crying.head.eyes and crying.state is None
    assert crying.head.eyes.look.redness > plain.head.eyes.look.redness + 0.3
    before, after = (one.head.maps.colour for one in (plain, crying))
    assert before is not None and after is not None and (after[..., 1] < 0.8 * before[..., 1]).mean() > 0.02


@pytest.mark.parametrize("target", ["arnold", "renderman"])
def test_targets_without_maps_refuse_states(person_file: Path, tmp_path: Path, target: str) -> None:
    with pytest.raises(DermisError, match="state: expected a target with maps"):
        export_skin(person_file, target, tmp_path / "a.json", state={"blush": 1.0})
    assert not (tmp_path / "a.json").exists()


def test_a_web_page_captures_maps_with_the_state(
    person_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests: list[web_build.PageRequest] = []

    def refuse_capture(page_request: web_build.PageRequest) -> None:
        requests.append(page_request)
        raise InterruptedError

    monkeypatch.setattr(web_build, "build_page_content", refuse_capture)
    subject, target = load_subject(person_file, state={"crying": 1.0}), replace(TARGETS["web"], side=256)
    with pytest.warns(DermisWarning, match="sliders"), pytest.raises(InterruptedError):
        target.write(subject, (), tmp_path / "a.html", "1")
    (page,) = requests
    assert page.scene.state is None and not isinstance(page.scene.head.maps, PaintedMaps)
    assert {"melanin", "blood"}.isdisjoint(slider.name for slider in page.sliders)
