"""People as JSON files of their numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis import Human, load_head
from dermis.base.errors import DermisError
from dermis.human.person_file import read_person, write_person_json
from dermis.human.skin.look import SkinLook
from dermis.human.skin.measured import SiteDifferences


@pytest.mark.parametrize("seed", [0, 7, 12])
def test_the_same_person_comes_back(tmp_path: Path, seed: int) -> None:
    person = Human.sampled(seed)
    write_person_json(tmp_path / "one.json", person)
    found = read_person(tmp_path / "one.json")
    assert np.array_equal(found.positions_mm, person.positions_mm)
    assert (found.look, found.iris) == (person.look, person.iris)


def test_what_is_left_out_is_as_usual(tmp_path: Path) -> None:
    (tmp_path / "old.json").write_text('{"person": {"age": 70}}')
    assert read_person(tmp_path / "old.json") == Human(age=70)


def test_files_of_the_first_version_open_with_their_pigments(tmp_path: Path) -> None:
    skin = {"melanin": 0.1, "eumelanin": 0.8, "blood": 0.012, "oxygen": 0.6, "redness": 0.4, "seed": 3}
    (tmp_path / "old.json").write_text(json.dumps({"person": {"age": 70, "skin": skin}}))
    look = read_person(tmp_path / "old.json").look
    assert {name: getattr(look, name) for name in skin} == skin
    assert look.sites == SkinLook().sites


def test_differences_of_sites_come_back(tmp_path: Path) -> None:
    sites = SiteDifferences(neck=(0.5, -1.0, 0.1))
    person = Human(skin=SkinLook(epidermis_mm=0.07, sites=sites), skin_ancestry="south asian", ita=20.0)
    write_person_json(tmp_path / "one.json", person)
    found = read_person(tmp_path / "one.json")
    assert found.look == person.look and (found.skin_ancestry, found.ita) == ("south asian", 20.0)


def test_it_is_a_head(tmp_path: Path) -> None:
    write_person_json(tmp_path / "one.json", Human(age=70))
    head = load_head(tmp_path / "one.json")
    assert np.array_equal(head.positions_mm, Human(age=70).positions_mm)
    assert head.eyes is not None and head.strands is not None


@pytest.mark.parametrize(
    "text",
    [
        '{"person": {"skin": {"sites": {"knee": [0, 0, 0]}}}}',
        '{"person": {"skin": {"sites": {"neck": [0, 0]}}}}',
        '{"person": {"ita": 100}}',
        '{"person": {"skin_ancestry": "martian"}}',
        '{"person": {"targets": {"nose/nose-hump-incr": 1' + 400 * "0" + "}}}",
        "", "[]", "{}", '{"person": 3}', '{"person": {"age": "old"}}', '{"person": {"age": 200}}',
        '{"person": {"skin": []}}', '{"person": {"skin": {"blood": NaN}}}', '{"person": {"nose": 1}}',
        '{"person": {"targets": 4}}', '{"person": {"eyes": {"seed": "x"}}}', "\x00\x01", "[" * 5000,
    ],
)  # fmt: skip
def test_what_is_no_person_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(DermisError):
        read_person(path)


def test_numbers_are_plain(tmp_path: Path) -> None:
    write_person_json(tmp_path / "one.json", Human.sampled(3))
    told: dict[str, Any] = json.loads((tmp_path / "one.json").read_text())["person"]
    assert told["skin"]["melanin"] == Human.sampled(3).look.melanin and isinstance(told["targets"], dict)
