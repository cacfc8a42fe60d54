"""Skin of people against the table of measured people in the package."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from tolerances import SITE_MEDIAN

from dermis import DermisError, Human
from dermis.apps.validation.people.drawn import RandomPeople, sample_people
from dermis.apps.validation.people.inversion import model_lab
from dermis.base.tables import Rows, read_rows
from dermis.human.skin.colours import skin_colour_table
from dermis.human.skin.measured import (
    FACE_SITES,
    GROUP_OF_CODE,
    SITES,
    measured_table,
    pigment_ancestry,
    symmetric_square_root,
)
from dermis.human.skin.painted import mean_colour
from dermis.images.colour import lab
from dermis.images.skin_tone import skin_tone

PEOPLE = 3000
HEAD = ("cheek", *(name.replace("_", " ") for name in FACE_SITES))


@pytest.fixture(scope="module")
def cells() -> Rows:
    return [one for one in read_rows("dermis.human", "data/measured_cells") if not one["sex"] + one["age"]]


@pytest.fixture(scope="module")
def drawn() -> dict[str, RandomPeople]:
    return {group: sample_people(group, range(120)) for group in ("caucasian", "south asian", "african")}


def ita(person: Human) -> float:
    return skin_tone(mean_colour(person.look)).ita_degrees


@pytest.mark.parametrize("group", GROUP_OF_CODE.values())
def test_medians_of_all_sites_of_the_head_are_those_of_the_archive(group: str, cells: Rows) -> None:
    """Sample the distribution of each group for adults of all ages, half of them women."""
    table, rng, weights = measured_table(), np.random.default_rng(5), {group: 1.0}
    scores = rng.standard_normal((PEOPLE, 4)) @ symmetric_square_root(table.groups[group].correlation[:4, :4])
    ages, sexes = 25.0 + 65.0 * rng.beta(1.2, 2.2, PEOPLE), rng.integers(0, 2, PEOPLE)
    y = table.cheek_variables(weights, sexes, ages, scores)
    differences = table.site_differences(weights, y, rng.standard_normal((PEOPLE, len(SITES), 2)))
    checked = 0
    for cell in cells:
        if cell["group"] == group and cell["site"] in HEAD and int(cell["people"]) >= 50:
            z = y.copy()
            z[:, :3] += differences[:, SITES.index(cell["site"])]
            median = np.median(model_lab(z), axis=0)
            target = [float(cell[name]) for name in "Lab"]
            np.testing.assert_allclose(median, target, atol=SITE_MEDIAN, err_msg=cell["site"])
            checked += 1
    assert checked >= 3


def test_people_are_drawn_from_these_distributions(drawn: dict[str, RandomPeople], cells: Rows) -> None:
    """Compare medians of 120 people within three standard errors of the median."""
    for group, people in drawn.items():
        cell = next(one for one in cells if (one["group"], one["site"]) == (group, "cheek"))
        colours = people.cielab[:, 0]
        error = 3.0 * 1.253 * colours.std(axis=0) / np.sqrt(len(colours))
        target = np.array([float(cell[name]) for name in "Lab"])
        assert (np.abs(np.median(colours, axis=0) - target) < error).all(), group
    lightness = [np.median(one.cielab[:, 0, 0]) for one in drawn.values()]
    assert lightness == sorted(lightness, reverse=True)


def test_women_are_lighter_and_old_people_darker(drawn: dict[str, RandomPeople]) -> None:
    for people in drawn.values():
        L = people.cielab[:, 0, 0]
        assert np.median(L[people.sex < 0.5]) > np.median(L[people.sex > 0.5]) + 2.0
    young, old = (mean_colour(Human(age=age, caucasian=1, african=0, asian=0).look) for age in (30, 70))
    assert 2.0 < lab(young)[0] - lab(old)[0] < 8.0


def test_the_neck_has_less_blood_than_the_cheek() -> None:
    for group in GROUP_OF_CODE.values():
        assert Human(skin_ancestry=group).look.sites.neck[1] < -0.3


@pytest.mark.parametrize("angle", [-60.0, -30.0, 0.0, 30.0, 60.0])
def test_people_have_the_ita_that_is_asked_for(angle: float) -> None:
    people = [Human(ita=angle), *(Human.sampled(seed, ita=angle) for seed in range(6))]
    people += [Human(ita=angle, african=1, asian=0, caucasian=0), Human(ita=angle, skin_ancestry="asian")]
    for person in people:
        assert ita(person) == pytest.approx(angle, abs=0.05)
    assert len({one.look.blood for one in people}) == len(people)


def test_ancestry_follows_the_ita_unless_it_is_given() -> None:
    dark, light = ([Human.sampled(seed, ita=angle) for seed in range(30)] for angle in (-55.0, 45.0))
    assert np.mean([one.african for one in dark]) > 0.6
    assert np.mean([one.african for one in light]) < 0.1
    given = Human.sampled(3, ita=-55.0, asian=1.0)
    assert (given.asian, given.african) == (1.0, 0.0) and ita(given) == pytest.approx(-55.0, abs=0.05)


def test_skin_and_shape_vary_apart() -> None:
    plain, other = (Human.sampled(4, african=1.0, **more) for more in ({}, {"skin_ancestry": "japanese"}))
    assert np.array_equal(plain.positions_mm, other.positions_mm)
    assert lab(mean_colour(other.look))[0] > lab(mean_colour(plain.look))[0] + 8.0
    shape = Human.sampled(4, skin_ancestry="south asian")
    assert shape.caucasian > 0.3 and shape.hair_eumelanin > 4.0


def test_given_values_are_kept() -> None:
    person = Human.sampled(7, skin={"melanin": 0.123, "blood": 0.02})
    assert (person.look.melanin, person.look.blood) == (0.123, 0.02)
    assert replace_pigments(person) == replace_pigments(Human.sampled(7))


def replace_pigments(person: Human) -> dict[str, object]:
    return {name: one for name, one in asdict(person.look).items() if name not in ("melanin", "blood")}


def test_contradictions_and_unknown_names_are_refused() -> None:
    with pytest.raises(DermisError, match=r"ita: expected an ITA or the melanin"):
        Human.sampled(1, ita=10, skin={"melanin": 0.1})
    with pytest.raises(DermisError, match=r"skin_ancestry: expected one of caucasian"):
        Human(skin_ancestry="martian")
    with pytest.raises(DermisError, match=r"ita: expected a number from -65 to 70"):
        Human.sampled(1, ita=75)


def test_hair_and_eyes_follow_the_skin() -> None:
    assert pigment_ancestry({"caucasian": 1.0}) == (0.0, 0.0, 1.0)
    assert pigment_ancestry({"african": 0.5, "chinese": 0.5}) == (0.5, 0.5, 0.0)
    assert pigment_ancestry({"south asian": 1.0})[2] < 0.2


def test_one_colour_is_computed_in_two_ways() -> None:
    look = Human.sampled(2).look
    values = [np.log2(look.melanin), np.log2(look.blood), look.oxygen, np.log2(look.epidermis_mm)]
    table = skin_colour_table(look.eumelanin, look.oxygen, look.epidermis_mm)
    colour = table.lookup(np.array([look.melanin]), np.array([look.blood]))[0]
    np.testing.assert_allclose(model_lab(np.array([values]))[0], lab(colour), atol=0.15)
