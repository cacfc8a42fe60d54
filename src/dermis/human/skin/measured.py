"""Pigments of human skin by ancestry, sex, age, site of the body and skin tone, from measurements of people.

The table `measured.json` is written by `python -m dermis.apps.validation.people table`, which fits this
package's model of skin to the spectra of the International Skin Spectra Archive [Lu2025].
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from statistics import NormalDist
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.arrays import Doubles
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_number
from dermis.base.tables import float_columns, read_rows
from dermis.human.skin.colours import skin_colour_table
from dermis.images.colour import lab, linear_of_lab
from dermis.images.skin_tone import ita_degrees
from dermis.optics.pigments.parameters import DEFAULT_SKIN

GROUP_OF_CODE: Final[Mapping[str, str]] = MappingProxyType(
    {
        "CA": "caucasian",
        "CN": "chinese",
        "JP": "japanese",
        "TH": "southeast asian",
        "SA": "south asian",
        "AF": "african",
        "IQ": "iraqi",
        "AB": "arabian",
    }
)
"""Group of people for each code of the archive; "southeast asian" is Thai, "south asian" is Pakistani."""
SITES: Final = (
    "back of hand", "cheek", "cheekbone", "chin", "ear lobe", "forehead",
    "inner arm", "neck", "nose tip", "outer arm", "palm", "ring finger",
)  # fmt: skip
"""Sites of the body in the archive, in the order of the archive's site codes, which start at 1."""
FACE_SITES: Final = ("cheekbone", "forehead", "chin", "nose_tip", "ear_lobe", "neck")
"""Sites of the head beside the cheek, as fields of `SiteDifferences`."""
GROUPS_OF_ANCESTRY: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"asian": ("chinese", "japanese", "southeast asian"), "middle eastern": ("iraqi", "arabian")}
)
"""Names of broader ancestries, each with the groups that it averages with equal weights."""
SKIN_ANCESTRIES: Final = (*GROUP_OF_CODE.values(), *GROUPS_OF_ANCESTRY)
"""Names of skin ancestries."""
ITA_RANGE: Final = (-65.0, 70.0)
"""Range of the individual typology angle (ITA) that can be requested for a person [degrees]."""
_EUROPEAN_FRACTION_OF_GROUP: Mapping[str, float] = MappingProxyType(
    {"caucasian": 1.0, "iraqi": 0.3, "arabian": 0.3, "south asian": 0.1}
)
"""European fraction of a group, which allows fair hair and light eyes; artist's values except the first."""
_MAX_SITE_DOUBLINGS = 6.0
# deviation of the cheek from its median, to which differences between sites adapt [doublings]
_MAX_CHEEK_DEVIATION_DOUBLINGS = 0.7
_MELANIN_RANGE, _BLOOD_RANGE = (5e-4, 0.7), (3e-4, 0.08)
_EPIDERMIS_RANGE_MM = (0.02, 0.2)
# half width of the interval over which the density of an ITA is averaged [degrees]
_ITA_WINDOW_HALF_WIDTH_DEGREES = 1.0
_MAX_NORMAL_SCORE = 2.9  # largest absolute normal score of an ITA
# Numbers of melanin fractions, of bisections between two of them, and of changes of the other pigments:
_MELANIN_NODE_COUNT, _BISECTION_COUNT, _MAX_ITA_STEPS = 257, 40, 15
GroupWeights = Mapping[str, float]
"""Weights of groups of people, with a sum of 1."""


class MeasuredPigments(NamedTuple):
    """Pigments of the cheek of a person.

    melanin : volume fraction of melanosomes in the epidermis [-]
    blood : volume fraction of blood in the dermis [-]
    oxygen : oxygen saturation [-]
    epidermis_mm : thickness of the epidermis [mm]
    """

    melanin: float
    blood: float
    oxygen: float
    epidermis_mm: float


@dataclass(frozen=True)
class SiteDifferences:
    """Differences between the pigments at sites of the head and the pigments at the cheek.

    Parameters
    ----------
    cheekbone, forehead, chin, nose_tip, ear_lobe, neck : tuple of float
        Three differences, site minus cheek, of log2 of melanin, log2 of blood, and oxygen saturation [-].

    Examples
    --------
    >>> from dermis.human.skin.measured import SiteDifferences
    >>> SiteDifferences(neck=(0.3, -1.0, 0.0)).neck[1]
    -1.0
    """

    cheekbone: tuple[float, float, float] = (0.0, 0.0, 0.0)
    forehead: tuple[float, float, float] = (0.0, 0.0, 0.0)
    chin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    nose_tip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ear_lobe: tuple[float, float, float] = (0.0, 0.0, 0.0)
    neck: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise DermisError for values that are not three numbers in range."""
        for one in fields(self):
            values = getattr(self, one.name)
            if not isinstance(values, Sequence) or isinstance(values, str) or len(values) != 3:
                expected = "differences of melanin and blood [doublings] and of oxygen"
                refuse(f"sites.{one.name}", expected, f"got {format_value(values)}", "Write three numbers")
            limits = (_MAX_SITE_DOUBLINGS, _MAX_SITE_DOUBLINGS, 1.0)
            checked = tuple(
                float(checked_number(f"sites.{one.name}", value, -limit, limit))
                for value, limit in zip(values, limits, strict=True)
            )
            object.__setattr__(self, one.name, checked)

    def as_array(self) -> Doubles:
        """Return the differences between each site and the cheek, (6, 3), in the order of `FACE_SITES`."""
        return np.array([getattr(self, name) for name in FACE_SITES], np.float64)


class _Group(NamedTuple):
    """Distribution of the pigments in one group of people.

    quantiles : (4, k) quantiles of the four variables of the cheek that `MeasuredTable` lists
    ita : (k,) quantiles of the individual typology angle (ITA) [degrees]
    correlation : (5, 5) correlation of the normal scores of these four variables and of the ITA
    sites : (12, 3) differences between each site and the cheek in log2 of melanin, log2 of blood, and oxygen
        [-]
    """

    quantiles: Doubles
    ita: Doubles
    correlation: Doubles
    sites: Doubles


class MeasuredTable(NamedTuple):
    """Distributions of skin pigments in groups of people, from measurements of their skin.

    The four variables describe the cheek: log2 of melanin, log2 of blood, oxygen, and log2 of the thickness
    of the epidermis in mm. Their distributions in each group are stored as quantiles.

    probabilities : (k,) cumulative probabilities, 0 to 1, of the k quantiles of each variable
    groups : mapping from group name to distribution
    sex : (4,) change of each variable from female to male
    age : (4,) change of each variable from young to old, to be multiplied by `age_term`
    mean_age_term : mean of `age_term` over the ages that `Human.sampled` samples
    site_slope : (12, 2) slope of the difference between each site and the cheek as a function of the cheek's
        own value, for log2 of melanin and for log2 of blood [-]
    site_spread : (12, 2) standard deviations of the differences between each site and the cheek among people,
        for log2 of melanin and for log2 of blood [-]
    """

    probabilities: Doubles
    groups: Mapping[str, _Group]
    sex: Doubles
    age: Doubles
    mean_age_term: float
    site_slope: Doubles
    site_spread: Doubles

    def group_mean(self, field_name: str, weight_of_group: GroupWeights) -> Doubles:
        """Return a field of `_Group`, averaged over a mixture of groups.

        field_name : name of the field
        weight_of_group : weight of each group in the mixture
        """
        parts = [
            weight * np.asarray(getattr(self.groups[one], field_name))
            for one, weight in weight_of_group.items()
        ]
        return np.asarray(np.sum(parts, axis=0))

    def cheek_variables(
        self, weight_of_group: GroupWeights, sex: ArrayLike, age: ArrayLike, normal_scores: Doubles
    ) -> Doubles:
        """Return the variables (n, 4) that describe the cheeks of n people, in the order of `MeasuredTable`.

        weight_of_group : weight of each group in the mixture
        sex, age : (n,) sex and age of each person, or one number for all
        normal_scores : (n, 4) standard normal scores of the variables of each person, correlated as measured
        """
        nodes = standard_normal_quantiles(self.probabilities)
        quantiles = self.group_mean("quantiles", weight_of_group)
        values = np.column_stack([np.interp(normal_scores[:, k], nodes, quantiles[k]) for k in range(4)])
        sexes, terms = np.asarray(sex, np.float64) - 0.5, age_term(age) - self.mean_age_term
        return np.asarray(values + sexes[..., None] * self.sex + terms[..., None] * self.age)

    def site_differences(
        self, weight_of_group: GroupWeights, cheek_variables: Doubles, normal_samples: Doubles
    ) -> Doubles:
        """Return the differences (n, 12, 3) between all sites and the cheek.

        The differences are in log2 of melanin, log2 of blood, and oxygen [-].

        weight_of_group : weight of each group in the mixture
        cheek_variables : (n, 4) result of the method `cheek_variables`
        normal_samples : (n, 12, 2) independent samples of the standard normal distribution, for melanin and
            blood at each site; zeros for typical people
        """
        middle = self.group_mean("quantiles", weight_of_group)[:2, len(self.probabilities) // 2]
        deviation = np.clip(
            cheek_variables[:, None, :2] - middle,
            -_MAX_CHEEK_DEVIATION_DOUBLINGS,
            _MAX_CHEEK_DEVIATION_DOUBLINGS,
        )
        found = np.broadcast_to(
            self.group_mean("sites", weight_of_group), (len(cheek_variables), len(SITES), 3)
        ).copy()
        found[:, :, :2] += self.site_slope * deviation + self.site_spread * normal_samples
        return found


@cache
def measured_table() -> MeasuredTable:
    """Return the distributions of skin pigments in groups of people, read from `measured.json`."""
    text = resources.files("dermis.human").joinpath("data", "measured.json").read_text("utf-8")
    return parse_measured_table(json.loads(text))


def parse_measured_table(json_object: Mapping[str, Any]) -> MeasuredTable:
    """Return the distributions of skin pigments in groups of people from the content of `measured.json`.

    json_object : content of measured.json
    """
    groups = {
        name: _Group(*(np.array(one[field], np.float64) for field in _Group._fields))
        for name, one in json_object["groups"].items()
    }
    arrays = {
        name: np.array(json_object[name], np.float64)
        for name in ("probabilities", "sex", "age", "site_slope", "site_spread")
    }
    return MeasuredTable(groups=groups, mean_age_term=float(json_object["mean_age_term"]), **arrays)


def age_term(age: ArrayLike) -> Doubles:
    """Return the progress of ageing in skin colour: 0 up to 38 years, rising to 1 at 65 years and above.

    In the measurements, the cheek keeps its colour up to about 40 years, and is 4 to 5 L* darker after 60.
    """
    t = np.clip((np.asarray(age, np.float64) - 38.0) / 27.0, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def group_weights(
    african: float, asian: float, caucasian: float, skin_ancestry: str = ""
) -> dict[str, float]:
    """Return the weight of each group of measured people, for ancestry fractions or for a skin ancestry.

    african, asian, caucasian : ancestry fractions, which add up to 1
    skin_ancestry : name of the ancestry of the skin, which replaces the fractions; "" for none
    """
    if skin_ancestry:
        return _split_ancestry_weight(skin_ancestry, 1.0)
    parts = {"african": african, "asian": asian, "caucasian": caucasian}
    weights: dict[str, float] = {}
    for name, fraction in parts.items():
        weights |= {one: part for one, part in _split_ancestry_weight(name, fraction).items() if part > 0.0}
    return weights


def _split_ancestry_weight(ancestry_name: str, weight: float) -> dict[str, float]:
    members = GROUPS_OF_ANCESTRY.get(ancestry_name, (ancestry_name,))
    return {one: weight / len(members) for one in members}


def pigment_ancestry(weight_of_group: GroupWeights) -> tuple[float, float, float]:
    """Return the fractions of African, Asian and European ancestry that determine hair and eye pigments.

    weight_of_group : weight of each group of measured people; the weights add up to 1
    """
    african = weight_of_group.get("african", 0.0)
    european = sum(
        weight * _EUROPEAN_FRACTION_OF_GROUP.get(name, 0.0) for name, weight in weight_of_group.items()
    )
    return african, 1.0 - african - european, european


def group_probabilities(ita: float) -> dict[str, float]:
    """Return the probabilities that a person with a given skin tone belongs to each group of people.

    The result is a dictionary by group name. The groups are assumed to be equally common.

    ita : skin tone as individual typology angle (ITA) [degrees]
    """
    table = measured_table()
    density = {}
    for name, group in table.groups.items():
        low, high = _ita_scores(
            np.array([ita - _ITA_WINDOW_HALF_WIDTH_DEGREES, ita + _ITA_WINDOW_HALF_WIDTH_DEGREES]), group.ita
        )
        density[name] = float(np.exp(-0.125 * (low + high) ** 2) * (high - low))  # normal density times width
    total = sum(density.values())
    return {name: value / total for name, value in density.items()}


def typical_pigments(
    weight_of_group: GroupWeights, sex: float, age: float, ita: float | None = None
) -> tuple[MeasuredPigments, SiteDifferences]:
    """Return the median pigments of the cheek, and the median differences of other sites from the cheek.

    weight_of_group : weight of each group of measured people
    sex, age : sex, from 0 (female) to 1 (male), and age [years]
    ita : individual typology angle (ITA) that the cheek must have [degrees]; None for any
    """
    return _pigments_and_sites(weight_of_group, sex, age, ita, np.zeros(4), None)


def sample_pigments(
    rng: np.random.Generator, weight_of_group: GroupWeights, sex: float, age: float, ita: float | None = None
) -> tuple[MeasuredPigments, SiteDifferences]:
    """Return random pigments of a person's cheek, and random differences of other sites from the cheek.

    The pigments are correlated as in measured people.

    weight_of_group : weight of each group of measured people
    sex, age : sex, from 0 (female) to 1 (male), and age [years]
    ita : individual typology angle (ITA) that the cheek must have [degrees]; None for any
    """
    return _pigments_and_sites(
        weight_of_group, sex, age, ita, rng.standard_normal(4), rng.standard_normal((len(SITES), 2))
    )


def _pigments_and_sites(
    weight_of_group: GroupWeights,
    sex: float,
    age: float,
    ita: float | None,
    normal_samples: Doubles,
    site_normal_samples: Doubles | None,
) -> tuple[MeasuredPigments, SiteDifferences]:
    """Return the pigments of a person's cheek, and the differences of other sites from the cheek.

    weight_of_group : weight of each group of measured people
    sex, age : sex, from 0 (female) to 1 (male), and age [years]
    ita : individual typology angle (ITA) that the cheek must have [degrees]; None for any
    normal_samples : (4,) independent samples of the standard normal distribution, zeros for a typical person
    site_normal_samples : (12, 2) independent samples of the same distribution, for melanin and blood at each
        site; None for a typical person
    """
    table = measured_table()
    correlation = table.group_mean("correlation", weight_of_group)
    covariance, mean = correlation[:4, :4], np.zeros(4)
    if ita is not None:
        slope = correlation[:4, 4]
        mean, covariance = slope * _ita_score(ita, weight_of_group), covariance - np.outer(slope, slope)
    scores = mean + symmetric_square_root(covariance) @ normal_samples
    variables = table.cheek_variables(weight_of_group, sex, age, scores[None])
    pigments = _clipped_pigments(variables[0])
    if ita is not None:
        pigments = with_ita(pigments, ita)
        variables[0, 0] = np.log2(pigments.melanin)
    typical = site_normal_samples is None
    samples_or_zeros = (
        np.zeros((1, len(SITES), 2)) if site_normal_samples is None else site_normal_samples[None]
    )
    middle = (
        variables
        if not typical or ita is not None
        else np.tile(_median_cheek_variables(weight_of_group), (1, 1))
    )
    sites = table.site_differences(weight_of_group, middle, samples_or_zeros)[0]
    oxygen = variables[0, 2] + sites[:, 2]  # may exceed 1, where skin is redder than the model allows
    sites[:, 2] = np.clip(oxygen, 0.0, 1.0) - pigments.oxygen
    names = [name.replace(" ", "_") for name in SITES]
    rows = {name: tuple(np.round(sites[names.index(name)], 4).tolist()) for name in FACE_SITES}
    return pigments, SiteDifferences(**rows)


def _median_cheek_variables(weight_of_group: GroupWeights) -> Doubles:
    table = measured_table()
    return table.group_mean("quantiles", weight_of_group)[:, len(table.probabilities) // 2]


def _clipped_pigments(pigment_values: Doubles) -> MeasuredPigments:
    melanin, blood, epidermis = np.exp2(pigment_values[[0, 1, 3]])
    return MeasuredPigments(
        float(np.clip(melanin, *_MELANIN_RANGE)),
        float(np.clip(blood, *_BLOOD_RANGE)),
        float(np.clip(pigment_values[2], 0.0, 1.0)),
        float(np.clip(epidermis, *_EPIDERMIS_RANGE_MM)),
    )


def with_ita(
    pigments: MeasuredPigments, ita: float, eumelanin: float = DEFAULT_SKIN.eumelanin
) -> MeasuredPigments:
    """Return pigments whose melanin fraction is changed so that the skin has the ITA `ita`.

    If no melanin fraction gives this ITA, other parameters change too: very light skin gets less blood with
    more oxygen, and very dark skin gets a thicker epidermis.

    pigments : pigments of the skin before the change
    ita : individual typology angle (ITA) that the skin must have [degrees]
    eumelanin : fraction of eumelanin in the melanosomes, 0 to 1 [-]
    """
    for _ in range(_MAX_ITA_STEPS):
        table = skin_colour_table(eumelanin, pigments.oxygen, pigments.epidermis_mm)
        melanin = np.geomspace(*_MELANIN_RANGE, _MELANIN_NODE_COUNT)
        found = ita_degrees(lab(table.lookup(melanin, np.full(_MELANIN_NODE_COUNT, pigments.blood))))
        if found[0] < ita:
            oxygen = pigments.oxygen + 0.2 * (1.0 - pigments.oxygen)
            pigments = pigments._replace(blood=max(0.8 * pigments.blood, _BLOOD_RANGE[0]), oxygen=oxygen)
        elif found[-1] > ita:
            pigments = pigments._replace(
                epidermis_mm=min(1.3 * pigments.epidermis_mm, _EPIDERMIS_RANGE_MM[1])
            )
        else:
            break
    below = np.flatnonzero(found <= ita)
    index = int(below[0]) if len(below) else _MELANIN_NODE_COUNT - 1
    low, high = np.log(melanin[[max(index - 1, 0), index]])
    for _ in range(_BISECTION_COUNT):  # ITA falls with melanin
        middle = 0.5 * (low + high)
        colour = table.lookup(np.exp([middle]), np.array([pigments.blood]))[0]
        low, high = (middle, high) if float(ita_degrees(lab(colour))) > ita else (low, middle)
    return pigments._replace(melanin=float(np.exp(0.5 * (low + high))))


def _ita_score(ita: float, weight_of_group: GroupWeights) -> float:
    """Return the standard normal score of a skin tone among the people of a mixture of groups.

    The score is limited to the range from -2.9 to 2.9.

    ita : skin tone as individual typology angle (ITA) [degrees]
    weight_of_group : weight of each group in the mixture
    """
    quantiles = measured_table().group_mean("ita", weight_of_group)
    return float(np.clip(_ita_scores(np.array([ita]), quantiles)[0], -_MAX_NORMAL_SCORE, _MAX_NORMAL_SCORE))


def _ita_scores(ita: Doubles, quantiles: Doubles) -> Doubles:
    """Return the standard normal scores (n,) of skin tones by interpolation of quantiles.

    Beyond the first and last quantile, the scores are extrapolated linearly.

    ita : (n,) individual typology angles (ITA) [degrees]
    quantiles : (k,) quantiles of the ITA at `MeasuredTable.probabilities` [degrees]
    """
    nodes = standard_normal_quantiles(measured_table().probabilities)
    slope = (nodes[-1] - nodes[0]) / (quantiles[-1] - quantiles[0])
    beyond = ita - np.clip(ita, quantiles[0], quantiles[-1])
    return np.asarray(np.interp(ita, quantiles, nodes) + slope * beyond)


def standard_normal_quantiles(probabilities: Doubles) -> Doubles:
    """Return quantiles (k,) of the standard normal distribution for probabilities (k,) between 0 and 1."""
    quantile = NormalDist().inv_cdf  # avoids the import of scipy.special, which takes half a second
    return np.array([quantile(float(one)) for one in probabilities])


def symmetric_square_root(covariance: Doubles) -> Doubles:
    """Return the symmetric square root of a covariance matrix; negative eigenvalues are replaced by 0."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


class MeasuredMedians(NamedTuple):
    """Median colour and pigments of one group of measured people at one site of the body.

    group : name of the group of people, one of the values of `GROUP_OF_CODE`
    site : name of the site of the body, one of `SITES`
    sex : "F" or "M", or "" for both
    age_group : "1" (under 20), "2" (20 to 29) ... "6" (over 60), or "" for all ages
    people : number of measured people. If too few were measured, the number is 0, and the medians are
        estimates from the measurements of all groups
    cielab : (3,) CIELAB colour under D65, without surface reflection
    pigments : pigments that the package's model infers from the measurements
    """

    group: str
    site: str
    sex: str
    age_group: str
    people: int
    cielab: tuple[float, float, float]
    pigments: MeasuredPigments


@cache
def measured_medians() -> tuple[MeasuredMedians, ...]:
    """Return the medians of measured skin for each group of people and each site of the body.

    At each site, a group has one entry for all its people, and further entries for people of one sex or of
    one age group.

    Source: [Lu2025].
    """
    rows = read_rows("dermis.human", "data/measured_cells")
    colours = float_columns(rows, "L a b").tolist()
    pigments = float_columns(rows, "melanin blood oxygen thickness_mm").tolist()
    return tuple(
        MeasuredMedians(
            row["group"], row["site"], row["sex"], row["age"], int(row["people"]),
            (colour[0], colour[1], colour[2]), MeasuredPigments(*values),
        )
        for row, colour, values in zip(rows, colours, pigments, strict=True)
    )  # fmt: skip


class MeasuredTone(NamedTuple):
    """Measured skin colour at a site of the body, such as the palm.

    colour : (3,) diffuse reflectance, linear Rec. 709 [-]
    note : text for the user, which states the origin of the colour and the pigments of such skin
    """

    colour: Doubles
    note: str


def measured_tone(tone_name: str) -> MeasuredTone:
    """Return the median colour of a site of the body, for one group of people or as the mean of all groups.

    tone_name : one of `SITES`, alone or after one of `SKIN_ANCESTRIES`, such as "palm" or "south asian palm"

    Raises DermisError for other names.
    """
    words = " ".join(tone_name.lower().replace("_", " ").split())
    site = next((one for one in SITES if words == one or words.endswith(f" {one}")), "")
    group = words[: len(words) - len(site)].strip()
    if not site or (group and group not in SKIN_ANCESTRIES):
        expected = f"one of {', '.join(SITES)}, alone or after one of {', '.join(SKIN_ANCESTRIES)}"
        refuse("skin_site", expected, f"got {format_value(tone_name)}", "Correct it")
    members = GROUPS_OF_ANCESTRY.get(group, (group,)) if group else tuple(GROUP_OF_CODE.values())
    medians = [
        one
        for one in measured_medians()
        if one.group in members and one.site == site and not one.sex + one.age_group
    ]
    measured = [one for one in medians if one.people] or medians
    colour = linear_of_lab(np.mean([one.cielab for one in measured], axis=0))
    people = sum(one.people for one in measured)
    source = f"the median of {people:,} measured people" if people else "an estimate from other groups"
    if len(measured) > 1:
        source = f"the mean of {len(measured)} groups' medians, {people:,} measured people"
    melanin, blood = (np.exp(np.mean(np.log([one.pigments[k] for one in measured]))) for k in (0, 1))
    pigments = f"--melanin {melanin:.2g} --blood {blood:.2g} makes the profile that of such skin"
    return MeasuredTone(colour, f"its skin is drawn as {words}, {source}; {pigments}")


@cache
def typical_site_differences() -> SiteDifferences:
    """Return the median differences in pigments between sites of the head and the cheek.

    All groups of measured people have equal weights.
    """
    count = len(GROUP_OF_CODE)
    return typical_pigments(dict.fromkeys(GROUP_OF_CODE.values(), 1.0 / count), 0.5, 30.0)[1]
