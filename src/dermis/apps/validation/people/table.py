"""Statistics of measured skin in the package's data files, computed from the spectral archive."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from io import StringIO
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import rankdata

from dermis.apps.validation.pages import CHECKOUT, require_in_checkout
from dermis.apps.validation.people.inversion import invert_spectra, model_lab
from dermis.apps.validation.spectral_archive import AGE_MIDDLES, Archive, read_archive
from dermis.base.arrays import Doubles
from dermis.base.atomic_write import atomic_file
from dermis.base.console import print_lines
from dermis.human.skin.measured import (
    FACE_SITES,
    GROUP_OF_CODE,
    SITES,
    MeasuredTable,
    age_term,
    parse_measured_table,
    symmetric_square_root,
)
from dermis.images.skin_tone import ita_degrees

HUMAN_DATA_FOLDER = CHECKOUT / "src" / "dermis" / "human" / "data"
TABLE_FILE, CELLS_FILE = "measured.json", "measured_cells.csv"
_QUANTILE_PROBABILITIES = (0.005, 0.025, 0.1, 0.25, 0.5, 0.75, 0.9, 0.975, 0.995)
_CHEEK_SITE_INDEX = SITES.index("cheek")
_POOLED_CORRELATION_WEIGHT = 30.0  # number of people of a group that weigh as much as the pooled correlation
_MIN_CELL_PEOPLE = (
    20  # least number of people of a cell (group and site) that is not filled from the pooled model
)
_POOLED_DIFFERENCE_WEIGHT = (
    10.0  # number of people of a small cell that weigh as much as the pooled difference
)
_POPULATION_SIZE = 2000
_CORRECTION_SD: Final = np.array([0.5, 0.5, 0.15, 0.15])
"""Typical size of the corrections of the four skin variables.

The corrections make the median colours of sampled people agree with the archive.
"""
_MEDIAN_COLOUR_SD = 0.05
_ARCHIVE_SOURCE = (
    "Lu et al. 2025, International Skin Spectra Archive, CC BY 4.0, doi 10.6084/m9.figshare.28228571.v4"
)
_LOG2_THICKNESS_CHANGES = (-0.6, -0.4, -0.2, 0.0, 0.2)
"""Changes of the thickness of the epidermis that are tried [doublings]."""
_MAX_CORRECTION_STEP = 1.0  # of a correction, in `_CORRECTION_SD`
_CALIBRATION_STEP_COUNT = 6
_WINSOR_PERCENT = 5.0
_PERSON_SPREAD_FRACTION = 0.5
"""Fraction of the measured spread of differences between sites that is due to people; pressure and placing of
the probe cause the rest. With the whole spread, foreheads, necks and hands of random people would vary too
much."""
_CELLS_CSV_HEADER = """\
# quantity: medians of measured skin by group, site, sex and age group: CIELAB under D65 without specular
#   reflection, melanin, blood, oxygen and thickness by the package's own model; covariances of CIELAB and of
#   log2 melanin, log2 blood, oxygen, log2 thickness as upper triangles by row; people 0: empty cell, filled
#   from the pooled model
# unit: - for fractions, mm for thickness
# source: python -m dermis.apps.validation.people table, from Lu et al., International Skin Spectra Archive
#   (2025), doi 10.6084/m9.figshare.28228571.v4
# licence: CC BY 4.0
"""


def write_measured_table() -> None:
    """Compute statistics of measured skin from the spectral archive, and write them to data files."""
    archive = read_archive()
    skin_variables = invert_spectra(archive.spectra)
    document = build_measured_table(archive, skin_variables)
    folder = require_in_checkout(HUMAN_DATA_FOLDER)
    with atomic_file(folder / TABLE_FILE) as file:
        file.write_text(json.dumps(document, separators=(",", ":")) + "\n", "utf-8")
    text = cells_csv(archive, skin_variables, parse_measured_table(document))
    with atomic_file(folder / CELLS_FILE) as file:
        file.write_text(text, "utf-8")
    sizes = ((folder / name).stat().st_size for name in (TABLE_FILE, CELLS_FILE))
    print_lines(f"{TABLE_FILE} and {CELLS_FILE}: {' and '.join(f'{size:,}' for size in sizes)} bytes")


def build_measured_table(archive: Archive, skin_variables: Doubles) -> dict[str, Any]:
    """Compute statistics of measured skin; return them as the JSON object that describes a `MeasuredTable`.

    skin_variables : (n, 4) skin variables of the measurements, from `invert_spectra`
    """
    cheek, y = person_median_measurements(archive, skin_variables, _CHEEK_SITE_INDEX)
    sex, age = _sex_age_effects(cheek, y)
    ages, sexes = _random_ages_and_sexes()
    table_document: dict[str, Any] = {
        "source": _ARCHIVE_SOURCE,
        "probabilities": list(_QUANTILE_PROBABILITIES),
        "sex": _rounded_lists(sex),
        "age": _rounded_lists(age),
        "mean_age_term": round(float(age_term(ages).mean()), 4),
    }
    adjusted = y - _centred_sex_age_effects(cheek, sex, age)
    scores = {
        code: _normal_scores(adjusted[rows], cheek.select_rows(rows)) for code, rows in _group_masks(cheek)
    }
    pooled = np.corrcoef(np.concatenate(list(scores.values())).T)
    shifts, slope, spread = _site_differences(archive, skin_variables)
    table_document |= {
        "site_slope": _rounded_lists(slope),
        "site_spread": _rounded_lists(spread),
        "groups": {},
    }
    for code, rows in _group_masks(cheek):
        n, own = int(rows.sum()), np.corrcoef(scores[code].T)
        mixed = (n * own + _POOLED_CORRELATION_WEIGHT * pooled) / (n + _POOLED_CORRELATION_WEIGHT)
        ita = ita_degrees(cheek.select_rows(rows).cielab)
        table_document["groups"][GROUP_OF_CODE[code]] = {
            "quantiles": _rounded_lists(np.quantile(adjusted[rows], _QUANTILE_PROBABILITIES, axis=0).T),
            "ita": _rounded_lists(np.quantile(ita, _QUANTILE_PROBABILITIES), 2),
            "correlation": _rounded_lists(mixed, 3),
            "sites": _rounded_lists(shifts[list(GROUP_OF_CODE).index(code)]),
        }
    _calibrate_median_colours(table_document, archive, ages, sexes)
    return table_document


def person_median_measurements(
    archive: Archive, skin_variables: Doubles, site_index: int
) -> tuple[Archive, Doubles]:
    """Return one measurement for each of n people at a site, and its skin variables (n, 4).

    The measurement of a person is the one whose lightness is the median of the person's measurements at the
    site.

    skin_variables : skin variables of all measurements, from `invert_spectra`
    """
    rows = np.flatnonzero(archive.site == site_index)
    order = rows[np.lexsort((archive.cielab[rows, 0], archive.person[rows]))]
    people, first, counts = np.unique(archive.person[order], return_index=True, return_counts=True)
    middle = order[first + counts // 2]
    assert len(middle) == len(people)
    return Archive(*(column[middle] for column in archive)), skin_variables[middle]


def _group_masks(archive: Archive) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    for code in GROUP_OF_CODE:
        yield code, archive.group == code


def _sex_age_effects(cheek: Archive, skin_variables: Doubles) -> tuple[Doubles, Doubles]:
    """Return two arrays (4,): the effects of sex and of `age_term` on the skin variables of `model_spectra`.

    The effects are fitted by least squares, with an intercept for each ancestry group. `age_term` rises from
    0 for young adults to 1 for old people.

    cheek : n measurements at the cheek
    skin_variables : (n, 4) skin variables of these measurements
    """
    known = np.isfinite(cheek.sex) & np.isfinite(cheek.age)
    levels = (cheek.group[known, None] == np.array(list(GROUP_OF_CODE))).astype(np.float64)
    terms = np.column_stack([levels, cheek.sex[known], age_term(cheek.age[known])])
    low, high = np.percentile(skin_variables, (1.0, 99.0), axis=0)
    found = np.linalg.lstsq(terms, np.clip(skin_variables[known], low, high), rcond=None)[0]
    return found[-2], found[-1]


def _centred_sex_age_effects(cheek: Archive, sex_effect: Doubles, age_effect: Doubles) -> Doubles:
    """Return how much sex and age change the four skin variables of n people, (n, 4).

    Each change is relative to a person whose sex (0 for female, 1 for male) and `age_term` are the means of
    the same ancestry group. `age_term` rises from 0 for young adults to 1 for old people.

    cheek : measurements of n people at the cheek
    sex_effect, age_effect : (4,) effects of sex and of `age_term` on the variables
    """
    result = np.zeros((len(cheek.group), 4))
    for values, effect in ((cheek.sex, sex_effect), (age_term(cheek.age), age_effect)):
        for _, rows in _group_masks(cheek):
            known = rows & np.isfinite(values)
            if known.any():
                result[known] += (values[known] - values[known].mean())[:, None] * effect
    return result


def _normal_scores(skin_variables: Doubles, archive_rows: Archive) -> Doubles:
    """Return the normal scores (n, 5) of four skin variables and of the individual typology angle.

    A normal score is the quantile of the normal distribution that has the same rank as a measurement.

    skin_variables : (n, 4) skin variables of the measurements
    archive_rows : n measurements
    """
    columns = np.column_stack([skin_variables, ita_degrees(archive_rows.cielab)])
    return np.asarray(ndtri((rankdata(columns, axis=0) - 0.5) / len(columns)))


def _site_differences(archive: Archive, skin_variables: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return how the skin at 12 sites differs from the cheek of the same person, as three arrays.

    The medians (g, 12, 3) are the median differences between site and cheek in g groups. In small groups,
    they are blended with the mean over larger groups. A person's difference also depends on how far the
    person's cheek deviates from the median of the group; the slopes (12, 2) are the change of the difference
    per unit of this deviation. The spreads (12, 2) are the standard deviations of what remains of the
    differences, reduced by a constant factor.

    The last axis has log2 of melanin, log2 of blood and, for medians only, oxygenation.
    """
    shifts, counts = np.zeros((len(GROUP_OF_CODE), len(SITES), 3)), np.zeros((len(GROUP_OF_CODE), len(SITES)))
    slope, spread = np.zeros((len(SITES), 2)), np.zeros((len(SITES), 2))
    cheek, y = person_median_measurements(archive, skin_variables, _CHEEK_SITE_INDEX)
    for site in (k for k in range(len(SITES)) if k != _CHEEK_SITE_INDEX):
        other, z = person_median_measurements(archive, skin_variables, site)
        _, here, there = np.intersect1d(cheek.person, other.person, return_indices=True)
        difference, deviation = z[there, :3] - y[here, :3], y[here].copy()
        group = np.array([list(GROUP_OF_CODE).index(code) for code in cheek.group[here]])
        for k in range(len(GROUP_OF_CODE)):
            rows = group == k
            counts[k, site] = rows.sum()
            if counts[k, site] > 0:
                shifts[k, site] = np.median(difference[rows], axis=0)
                deviation[rows] -= np.median(deviation[rows], axis=0)
                difference[rows] -= shifts[k, site]
        used = counts[group, site] >= _MIN_CELL_PEOPLE
        x, d = (_winsorise(one[used, :2]) for one in (deviation, difference))
        slope[site] = (x * d).sum(axis=0) / (x * x).sum(axis=0)
        spread[site] = _PERSON_SPREAD_FRACTION * np.std(d - slope[site] * x, axis=0)
        filled = counts[:, site] >= _MIN_CELL_PEOPLE
        pooled = np.average(shifts[filled, site], axis=0, weights=counts[filled, site])
        weight = (counts[:, site] / (counts[:, site] + _POOLED_DIFFERENCE_WEIGHT))[~filled, None]
        shifts[~filled, site] = weight * shifts[~filled, site] + (1.0 - weight) * pooled
    return shifts, slope, spread


def _winsorise(samples: Doubles) -> Doubles:
    low, high = np.percentile(samples, (_WINSOR_PERCENT, 100.0 - _WINSOR_PERCENT), axis=0)
    return np.clip(samples, low, high)


def _random_ages_and_sexes() -> tuple[Doubles, Doubles]:
    """Return ages and sexes (n,) of adults, distributed as in `Human.sampled`."""
    rng = np.random.default_rng(0)
    return 25.0 + 65.0 * rng.beta(1.2, 2.2, _POPULATION_SIZE), rng.integers(0, 2, _POPULATION_SIZE).astype(
        np.float64
    )


def _calibrate_median_colours(
    table_document: dict[str, Any], archive: Archive, ages: Doubles, sexes: Doubles
) -> None:
    """Adjust statistics of skin so that people sampled from them have the archive's median colours.

    The quantiles and the differences between sites in `table_document` are changed in place. Spectra do not
    determine the thickness of the epidermis. Several values are therefore tried for each group, and the value
    that best reproduces the colours of the head is kept.
    """
    rng = np.random.default_rng(1)
    population = _Population(
        ages,
        sexes,
        rng.standard_normal((_POPULATION_SIZE, 4)),
        rng.standard_normal((_POPULATION_SIZE, len(SITES), 2)),
    )
    for code, rows in _group_masks(archive):
        name, own = GROUP_OF_CODE[code], archive.select_rows(rows)
        trials = []
        for thickness in _LOG2_THICKNESS_CHANGES:
            group = dict(table_document["groups"][name])
            quantiles = np.array(group["quantiles"]) + np.array([0.0, 0.0, 0.0, thickness])[:, None]
            trial = {**table_document, "groups": {name: group | {"quantiles": quantiles.tolist()}}}
            trials.append((_calibrate_group(trial, name, own, population), thickness, trial["groups"][name]))
        table_document["groups"][name] = min(trials, key=lambda one: one[0])[2]


class _Population(NamedTuple):
    """Random people for calibrating median colours: ages and sexes (n,), and normal random numbers.

    normals : (n, 4) standard normal random numbers for the skin variables of the cheek
    site_normals : (n, 12, 2) standard normal random numbers for the differences of sites from the cheek
    """

    ages: Doubles
    sexes: Doubles
    normals: Doubles
    site_normals: Doubles


def _calibrate_group(
    table_document: dict[str, Any], group_name: str, group_archive: Archive, random_people: _Population
) -> float:
    """Adjust the statistics of one group in place, as in `_calibrate_median_colours`.

    Returns the sum of squared errors of the median colours at sites of the head.
    """
    group = table_document["groups"][group_name]
    target, loss = np.median(group_archive.cielab[group_archive.site == _CHEEK_SITE_INDEX], axis=0), 0.0
    shift, error = _colour_matching_shift(
        _drawn_cheek_variables(table_document, group_name, random_people)[1], target, 3
    )
    loss += float(error @ error)
    group["quantiles"] = _rounded_lists(np.array(group["quantiles"]) + shift[:, None])
    found, y = _drawn_cheek_variables(table_document, group_name, random_people)
    differences = found.site_differences({group_name: 1.0}, y, random_people.site_normals)
    sites = np.array(group["sites"])
    for site in range(len(SITES)):
        measured = group_archive.site == site
        if site != _CHEEK_SITE_INDEX and len(np.unique(group_archive.person[measured])) >= _MIN_CELL_PEOPLE:
            z = y.copy()
            z[:, :3] += differences[:, site]
            shift, error = _colour_matching_shift(z, np.median(group_archive.cielab[measured], axis=0), 3)
            sites[site] += shift[:3]
            loss += float(error @ error) * (SITES[site].replace(" ", "_") in FACE_SITES)
    group["sites"] = _rounded_lists(sites)
    return loss


def _drawn_cheek_variables(
    table_document: dict[str, Any], group: str, random_people: _Population
) -> tuple[MeasuredTable, Doubles]:
    """Return the table that a JSON object describes, and skin variables (n, 4) of people sampled from it.

    The variables are those of the cheeks of n people of one group.

    table_document : statistics of measured skin, as returned by `build_measured_table`
    random_people : ages and sexes of the n people, and the random numbers from which their skin is sampled
    """
    found, weights = parse_measured_table(table_document), {group: 1.0}
    scores = random_people.normals @ symmetric_square_root(found.group_mean("correlation", weights)[:4, :4])
    return found, found.cheek_variables(weights, random_people.sexes, random_people.ages, scores)


def _colour_matching_shift(
    skin_variables: Doubles, target_colour: Doubles, shifted_variable_count: int
) -> tuple[Doubles, Doubles]:
    """Return a shift (4,) of skin variables after which the median colour is near a target.

    Also returns the remaining error (3,) of the median colour.

    skin_variables : (n, 4) variables of people
    target_colour : (3,) median colour to reach [CIELAB]
    shifted_variable_count : number of variables that may be shifted, counted from the first
    """
    shift, used = np.zeros(4), np.arange(4) < shifted_variable_count

    def median_colour(variable_shift: Doubles) -> Doubles:
        return np.asarray(np.median(model_lab(skin_variables + variable_shift), axis=0))

    for _ in range(_CALIBRATION_STEP_COUNT):
        error = target_colour - median_colour(shift)
        steps = 0.1 * np.diag(_CORRECTION_SD)
        J = np.column_stack(
            [
                (median_colour(shift + one) - median_colour(shift - one)) / (0.2 * sd)
                for one, sd in zip(steps, _CORRECTION_SD, strict=True)
            ]
        )
        J[:, ~used] = 0.0
        scaled = J * _CORRECTION_SD / _MEDIAN_COLOUR_SD
        normal = scaled.T @ scaled + np.eye(4)  # the prior of the shift is 0
        step = np.linalg.solve(normal, scaled.T @ error / _MEDIAN_COLOUR_SD - shift / _CORRECTION_SD)
        shift += _CORRECTION_SD * np.clip(step, -_MAX_CORRECTION_STEP, _MAX_CORRECTION_STEP)
    return shift, target_colour - median_colour(shift)


def cells_csv(archive: Archive, skin_variables: Doubles, measured_table: MeasuredTable) -> str:
    """Return a CSV table of measured skin, with one row for each group and site.

    It has medians and covariances of CIELAB colours and of skin variables. Further rows are for the people of
    one sex or one age group.

    skin_variables : (n, 4) skin variables of the measurements, from `invert_spectra`
    measured_table : statistics from which rows without measurements are filled
    """
    out = StringIO()
    out.write(_CELLS_CSV_HEADER)
    writer = csv.writer(out, lineterminator="\n")
    names = "group site sex age people measurements L a b melanin blood oxygen thickness_mm"
    names += " lab_covariance covariance"
    writer.writerow(names.split())
    for code, rows in _group_masks(archive):
        for site, name in enumerate(SITES):
            here = rows & (archive.site == site)
            if not here.any():
                writer.writerow(
                    [
                        GROUP_OF_CODE[code],
                        name,
                        "",
                        "",
                        0,
                        0,
                        *_pooled_cell_texts(measured_table, GROUP_OF_CODE[code], site),
                        "",
                        "",
                    ]
                )
                continue
            writer.writerow(
                _cell_row(archive, skin_variables, here, (GROUP_OF_CODE[code], name, "", ""), True)
            )
            for sex, value in (("F", 0.0), ("M", 1.0)):
                if (own := here & (archive.sex == value)).sum() >= _MIN_CELL_PEOPLE:
                    writer.writerow(
                        _cell_row(archive, skin_variables, own, (GROUP_OF_CODE[code], name, sex, ""))
                    )
            for number, middle in AGE_MIDDLES.items():
                if (own := here & (archive.age == middle)).sum() >= _MIN_CELL_PEOPLE:
                    writer.writerow(
                        _cell_row(archive, skin_variables, own, (GROUP_OF_CODE[code], name, "", number))
                    )
    return out.getvalue()


def _cell_row(
    archive: Archive,
    skin_variables: Doubles,
    row_mask: NDArray[np.bool_],
    cell_labels: tuple[object, ...],
    has_covariance: bool = False,
) -> list[object]:
    colours, y = archive.cielab[row_mask], skin_variables[row_mask]
    people = len(np.unique(archive.person[row_mask]))
    melanin, blood, oxygen, thickness = np.median(y, axis=0)
    values = [f"{one:.2f}" for one in np.median(colours, axis=0)]
    values += [
        f"{np.exp2(melanin):.4f}",
        f"{np.exp2(blood):.5f}",
        f"{oxygen:.3f}",
        f"{np.exp2(thickness):.4f}",
    ]
    covariances = (
        [_lower_triangle_text(colours, 2), _lower_triangle_text(y, 4)]
        if has_covariance and people > 2
        else ["", ""]
    )
    return [*cell_labels, people, int(row_mask.sum()), *values, *covariances]


def _pooled_cell_texts(measured_table: MeasuredTable, group: str, site_index: int) -> list[str]:
    """Return CSV cells with the predicted median colour and skin variables of a site without measurements.

    group : group of people
    site_index : index of the site in `SITES`
    """
    y = measured_table.cheek_variables({group: 1.0}, 0.5, 30.0, np.zeros((1, 4)))
    y[:, :3] += measured_table.site_differences({group: 1.0}, y, np.zeros((1, len(SITES), 2)))[:, site_index]
    colour, (melanin, blood, oxygen, thickness) = model_lab(y)[0], y[0]
    pigments = [
        f"{np.exp2(melanin):.4f}",
        f"{np.exp2(blood):.5f}",
        f"{oxygen:.3f}",
        f"{np.exp2(thickness):.4f}",
    ]
    return [f"{one:.2f}" for one in colour] + pigments


def _lower_triangle_text(samples: Doubles, digits: int) -> str:
    covariance = np.cov(samples.T)
    return " ".join(f"{one:.{digits}f}" for one in covariance[np.triu_indices(len(covariance))])


def _rounded_lists(numbers: Doubles, digits: int = 4) -> Any:
    return (np.round(np.asarray(numbers, np.float64), digits) + 0.0).tolist()
