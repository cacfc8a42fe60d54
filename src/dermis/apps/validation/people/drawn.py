"""Skin colours of people sampled at random, compared with those of the people in a spectral archive.

People are sampled by `Human.sampled`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.stats import energy_distance

from dermis.apps.validation.accuracy.measured.page import PEOPLE_FILE, write_measured_page
from dermis.apps.validation.pages import print_tables, write_results
from dermis.apps.validation.people.inversion import model_lab
from dermis.apps.validation.spectral_archive import Archive, read_archive
from dermis.base.arrays import Doubles
from dermis.base.progress import logged_step
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.human.skin.measured import FACE_SITES, GROUP_OF_CODE, SITES
from dermis.images.skin_tone import ita_degrees

HEAD_SITES: Final = ("cheek", *(name.replace("_", " ") for name in FACE_SITES))
"""Sites of the archive that are painted on a head."""
_SEED_COUNT = 2000
_PERMUTATION_COUNT = 200
_MIN_COMPARED_PEOPLE, _MEDIAN_TOLERANCE_LAB = (
    50,
    1.0,
)  # people with whom medians should agree, and largest difference [CIELAB]
_COLOUR_QUANTITIES = "L*", "a*", "b*", "ITA"
_MIN_OLD_AGE_YEARS = 55.0  # least age of the older people [years]


class RandomPeople(NamedTuple):
    """Skin colours of n people of one group who are sampled at random, at each of `HEAD_SITES`.

    cielab : (n, 7, 3) colours under D65
    age : (n,) ages [years]
    sex : (n,) sexes, 0 for female and 1 for male
    """

    cielab: Doubles
    age: Doubles
    sex: Doubles


def site_skin_variables(look: SkinLook) -> Doubles:
    """Return the skin variables (7, 4) of a person, one row for each of `HEAD_SITES`.

    The columns are melanin, blood, oxygenation and thickness of the epidermis, in the units of
    `model_spectra`.

    look : pigments and texture of the person's skin
    """
    differences = np.vstack([np.zeros(3), look.sites.as_array()])
    cheek = np.log2([look.melanin, look.blood])
    oxygen = np.clip(look.oxygen + differences[:, 2], 0.0, 1.0)
    thickness = np.full(len(differences), np.log2(look.epidermis_mm))
    return np.column_stack([cheek + differences[:, :2], oxygen, thickness])


@logged_step("drawing people")
def sample_people(group: str, seeds: Sequence[int]) -> RandomPeople:
    """Sample random people of an ancestry group, and compute their skin colours with the spectral model."""
    drawn = [Human.sampled(seed, skin_ancestry=group) for seed in seeds]
    variables = np.concatenate([site_skin_variables(one.look) for one in drawn])
    colours = model_lab(variables).reshape(len(drawn), len(HEAD_SITES), 3)
    return RandomPeople(colours, np.array([one.age for one in drawn]), np.array([one.sex for one in drawn]))


def sample_people_by_group(seed_count: int = _SEED_COUNT) -> dict[str, RandomPeople]:
    """Return random people by ancestry group, sampled with the same seeds for all groups."""
    return {group: sample_people(group, range(seed_count)) for group in GROUP_OF_CODE.values()}


def print_random_people_tables(seeds: int = _SEED_COUNT) -> None:
    """Print a comparison of people sampled at random with the people in the archive.

    Parameters
    ----------
    seeds
        Number of people that are sampled for each ancestry group of the archive.
    """
    print_tables(_people_tables(seeds))


def write_random_people_tables(seeds: int = _SEED_COUNT) -> None:
    """Compare people sampled at random with the people in the archive, and write docs/measured.md.

    Parameters
    ----------
    seeds
        Number of people that are sampled for each ancestry group of the archive.
    """
    write_results(PEOPLE_FILE, _people_tables(seeds))
    write_measured_page()


def _people_tables(seed_count: int) -> dict[str, str]:
    archive, drawn = read_archive(), sample_people_by_group(seed_count)
    return {
        "people_cheek": cheek_table(archive, drawn),
        "people_sites": sites_table(archive, drawn),
        "people_sex_age": sex_age_table(archive, drawn),
        "people_empty": unmeasured_sites_text(archive),
        "people_seeds": f"{seed_count:,}",
    }


def cheek_table(archive: Archive, random_people: Mapping[str, RandomPeople]) -> str:
    """Return a Markdown table that compares the cheek colours of measured and of randomly sampled people.

    For each group, the table has medians, ranges, and energy distances between the two distributions.
    """
    lines = [
        "| group | quantity | archive: median | 5 to 95 % | drawn: median | 5 to 95 % | distance | expected "
        "| 95 % |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for code, group in GROUP_OF_CODE.items():
        measured = _measured_colours(archive, code, "cheek")
        both = [_with_ita(one) for one in (measured.cielab, random_people[group].cielab[:, 0])]
        for k, name in enumerate(_COLOUR_QUANTITIES):
            a, b = both[0][:, k], both[1][:, k]
            distance, expected, limit = two_sample_distance(a, b)
            cells = [
                f"{np.median(a):.1f}", _range_text(a), f"{np.median(b):.1f}", _range_text(b),
                f"{distance:.2f}", f"{expected:.2f}", f"{limit:.2f}",
            ]  # fmt: skip
            lines.append(f"| {group if k == 0 else ''} | {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def two_sample_distance(first_sample: Doubles, second_sample: Doubles) -> tuple[float, float, float]:
    """Return the energy distance of two samples, and its mean and 95 % quantile for the null hypothesis.

    The null hypothesis is that both samples are from one population. The mean and the quantile of the
    distance are estimated by random permutations of the samples.

    first_sample, second_sample : samples, one value or one row of values for each person
    """
    rng, both = np.random.default_rng(0), np.concatenate([first_sample, second_sample])
    permuted = []
    for _ in range(_PERMUTATION_COUNT):
        shuffled = rng.permutation(both)
        permuted.append(energy_distance(shuffled[: len(first_sample)], shuffled[len(first_sample) :]))
    return (
        float(energy_distance(first_sample, second_sample)),
        float(np.mean(permuted)),
        float(np.quantile(permuted, 0.95)),
    )


def site_differences(
    archive: Archive, random_people: Mapping[str, RandomPeople]
) -> Iterator[tuple[str, str, int, Doubles, Doubles]]:
    """Yield median colours of measured people, and differences of sampled people, by group and site.

    Each tuple has the group, the site, the number of measured people, their median CIELAB colour (3,), and
    the difference (3,): the median colour of randomly sampled people minus that of measured people.
    """
    for code, group in GROUP_OF_CODE.items():
        for k, site in enumerate(HEAD_SITES):
            measured = _measured_colours(archive, code, site)
            if len(measured.person):
                median = np.median(measured.cielab, axis=0)
                difference = np.median(random_people[group].cielab[:, k], axis=0) - median
                yield group, site, len(np.unique(measured.person)), median, difference


def sites_table(archive: Archive, random_people: Mapping[str, RandomPeople]) -> str:
    """Return a Markdown table of median colours of measured people, by group and site.

    It also has the differences of randomly sampled people: their median colours minus the measured ones.
    """
    lines = [
        "| group | site | people | archive: L*, a*, b* | drawn minus archive | |",
        "|---|---|---|---|---|---|",
    ]
    for group, site, count, median, difference in site_differences(archive, random_people):
        outside = count >= _MIN_COMPARED_PEOPLE and np.abs(difference).max() > _MEDIAN_TOLERANCE_LAB
        texts = (
            ", ".join(f"{one:{form}}" for one in values)
            for values, form in ((median, ".1f"), (difference, "+.1f"))
        )
        lines.append(
            f"| {group} | {site} | {count} | {' | '.join(texts)} | {'beyond 1' if outside else ''} |"
        )
    return "\n".join(lines)


def sex_age_table(archive: Archive, random_people: Mapping[str, RandomPeople]) -> str:
    """Return a Markdown table of how the colour of the cheek differs between sexes and between ages.

    Differences are given for measured people and for randomly sampled people, averaged over the groups.
    """
    lines = ["| difference | archive: L*, a*, b* | drawn |", "|---|---|---|"]
    for name in ("men minus women", "from 55 years minus below 45"):
        both = []
        for is_drawn in (False, True):
            differences, counts = [], []
            for code, group in GROUP_OF_CODE.items():
                measured, random_group = _measured_colours(archive, code, "cheek"), random_people[group]
                colours = random_group.cielab[:, 0] if is_drawn else measured.cielab
                sex, age = (random_group.sex, random_group.age) if is_drawn else (measured.sex, measured.age)
                first, second = (
                    (sex > 0.5, sex < 0.5) if "men" in name else (age >= _MIN_OLD_AGE_YEARS, age < 45.0)
                )
                if min(first.sum(), second.sum()) >= 5:
                    differences.append(np.median(colours[first], axis=0) - np.median(colours[second], axis=0))
                    counts.append(1.0 / (1.0 / first.sum() + 1.0 / second.sum()))
            both.append(", ".join(f"{one:+.1f}" for one in np.average(differences, axis=0, weights=counts)))
        lines.append(f"| {name} | {' | '.join(both)} |")
    return "\n".join(lines)


def unmeasured_sites_text(archive: Archive) -> str:
    """Return text that lists the sites without measurements for each group.

    For these sites, the package derives values from the other groups.
    """
    parts = []
    for code, group in GROUP_OF_CODE.items():
        empty = [
            site for j, site in enumerate(SITES) if not ((archive.group == code) & (archive.site == j)).any()
        ]
        if empty:
            parts.append(f"{group}: {', '.join(empty)}")
    return "; ".join(parts)


def _measured_colours(archive: Archive, group_code: str, site: str) -> Archive:
    return archive.select_rows((archive.group == group_code) & (archive.site == SITES.index(site)))


def _with_ita(cielab: Doubles) -> Doubles:
    return np.column_stack([cielab, ita_degrees(cielab)])


def _range_text(numbers: Doubles) -> str:
    low, high = np.percentile(numbers, (5.0, 95.0))
    return f"{low:.1f} to {high:.1f}"
