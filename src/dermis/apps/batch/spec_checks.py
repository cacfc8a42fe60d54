"""Checks of a spec: its tables must be consistent, its names must exist, and its values must be valid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from dermis.apps.batch.clips.flow import FLOW_OUTPUTS
from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.lighting import LAMP_NAMES
from dermis.apps.batch.sensor.lens import Lens
from dermis.apps.batch.sensor.model import MIN_DEMOSAICED_SIDE, Sensor
from dermis.apps.batch.sensor.white_balance import lamp_appearance
from dermis.apps.batch.spec_tables import (
    LAMP_RIG,
    NO_ENVIRONMENT,
    RANDOM_EXPRESSION,
    CorrelationGroup,
    table_values,
)
from dermis.base.errors import DermisError, notify, refuse, shorten
from dermis.base.reading import is_file
from dermis.environment.panorama import UNIFORM_PANORAMA
from dermis.formats.samples import SAMPLES
from dermis.human.expressions import Weights
from dermis.human.hair.look import HairLook
from dermis.human.landmarks.points import read_landmark_table
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.human.makehuman import human_targets
from dermis.human.person import Human
from dermis.human.skin.look import SITES_FIELD, SkinLook
from dermis.human.wear.chances import SAMPLED
from dermis.human.wear.look import ITEM_TYPES
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.pose import MAX_WEIGHT
from dermis.scene.heads import HUMAN
from dermis.scene.lights import NO_LIGHTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

_UNSAMPLED_SKIN_FIELDS = "pigments", "layers", "profile_map", "other_profiles"  # fields of `Skin`
_SEED_FIELD = "seed"  # an integer that follows from the person
_LOOK_MODELS: Mapping[str, type] = {"skin": SkinLook, "eyes": EyeLook, "hair": HairLook}
_ANCESTRY_PARAMETERS = "person.african", "person.asian", "person.caucasian"
_ITA_PARAMETER, _MELANIN_PARAMETER = "person.ita", "person.skin.melanin"
_HEAD_PARAMETER = "person.head"
_SENSOR_RENDER_SETTINGS = {"tone": "none", "gamma": "right"}
"""Settings of the renderer's tone curve and encoding, which [sensor] replaces, with their neutral values."""
_MIN_VISIBLE_BLUE = 1e-3  # linear light that rounds to the level 3 of 255
_MAX_FILE_NAME_LENGTH = 100  # characters


def check_spec(
    distributions: Mapping[str, Distribution],
    expressions: Mapping[str, Weights],
    correlation_groups: Sequence[CorrelationGroup],
    folder: Path,
) -> None:
    """Raise DermisError for distributions whose samples cannot be rendered.

    The message names the key at fault, and the table of the TOML spec that contains the key.

    distributions : distribution of each parameter by its dotted name
    expressions : weights of morph targets by name of the expression
    correlation_groups : groups of correlated parameters
    folder : folder to which file names in the spec are relative
    """
    _check_looks(distributions)
    _check_person(distributions)
    _check_expression(distributions["expression.name"], expressions)
    _check_correlations(correlation_groups, distributions)
    _check_light(distributions)
    _check_heads_and_environments(distributions, folder)


def check_landmarks(set_names: Sequence[str], folder: Path) -> None:
    """Raise DermisError for names that are neither a preset landmark set nor a readable landmark table."""
    for name in set_names:
        if name in LANDMARK_SETS:
            continue
        if not name.endswith(".csv") or not is_file(folder / name):
            expected = (
                f"any of {', '.join(LANDMARK_SETS)}, or tables of name,vertex (.csv) in the spec's folder"
            )
            refuse("landmarks", expected, f"got {shorten(name, _MAX_FILE_NAME_LENGTH)!r}", "Correct it")
        read_landmark_table(str(folder / name))


def check_sensor(distributions: Mapping[str, Distribution], render: Settings) -> None:
    """Raise DermisError for values of the table [sensor] that are invalid, or contradict other tables.

    distributions : distribution of each parameter by its dotted name
    render : settings of the table [render]
    """
    _check_table("sensor", distributions, list(Sensor.model_fields), Sensor)
    if "none" in distributions["background.kind"].support:
        advice = 'Exclude "none", or remove [sensor]'
        refuse("background: kind", "a background, as photographs have no alpha", 'it can be "none"', advice)
    _check_linear_pictures(render, "[sensor]", "Use tone_curve of [sensor] instead")
    filtered = set(distributions["sensor.demosaicing"].support) != {"none"}
    if filtered and min(render.size) < MIN_DEMOSAICED_SIDE:
        expected = f"{MIN_DEMOSAICED_SIDE} pixels or more along each side for demosaicing"
        refuse("size", expected, f"got {list(render.size)}", "Correct it")


def check_lens(distributions: Mapping[str, Distribution], outputs: Sequence[str]) -> None:
    """Raise DermisError for invalid values of the table [lens], and for outputs that do not support it.

    distributions : distribution of each parameter by its dotted name
    outputs : outputs of the spec
    """
    _check_table("lens", distributions, list(Lens.model_fields), Lens)
    if {"motion", "motion_depth", *FLOW_OUTPUTS} & {*outputs}:
        expected = "outputs without motion and flow, which are computed for pinhole cameras"
        refuse("outputs", expected, "the spec has a table [lens]", "Remove these outputs, or [lens]")


def check_blur(distributions: Mapping[str, Distribution], render: Settings, *, has_clip: bool) -> None:
    """Raise DermisError for a table [blur] that has no effect or contradicts other tables.

    distributions : distribution of each parameter by its dotted name
    render : settings of the table [render]
    has_clip : whether people move
    """
    exposure = distributions["blur.shutter_ms"].support
    if not has_clip and exposure != (0.0,):
        advice = "Add [clip], or remove the key"
        refuse("blur: shutter_ms", "a table [clip], in which people move", "there is none", advice)
    if exposure == (0.0,) == distributions["blur.f_number"].support:
        actual = "both are 0"
        refuse("blur", "f_number or shutter_ms above 0", actual, "Set one of them, or remove [blur]")
    _check_linear_pictures(render, "[blur]", "Remove it")


def _check_linear_pictures(render: Settings, table_name: str, advice: str) -> None:
    """Raise DermisError for settings of the renderer's tone curve, where a table needs linear pictures."""
    for name, value in _SENSOR_RENDER_SETTINGS.items():
        if getattr(render, name) != value:
            actual = f"got {getattr(render, name)!r}"
            refuse(f"render: {name}", f"{value!r} with {table_name}", actual, advice)


def check_backgrounds(distributions: Mapping[str, Distribution], folder: Path, *, has_rig: bool) -> None:
    """Raise DermisError for pictures of backgrounds that do not exist, or that several cameras would share.

    distributions : distribution of each parameter by its dotted name
    folder : folder to which file names in the spec are relative
    has_rig : whether the spec has several cameras
    """
    pictures = distributions.get("background.picture")
    if pictures is None:
        return
    for name in map(str, pictures.support):
        if not is_file(folder / name):
            refuse("background: picture", "files in the spec's folder", f"there is no {name!r}", "Correct it")
    if has_rig:
        expected, actual = "one camera", "the cameras of [rig] would show the same picture"
        advice = 'Use kind = "environment", which each camera sees in its direction'
        refuse("background: picture", expected, actual, advice)


def note_lamps_without_blue(distributions: Mapping[str, Distribution]) -> None:
    """Notify the user of sampled lamps whose light has no blue in the pictures after the white balance.

    distributions : distribution of each parameter by its dotted name, with the parameters of [sensor]
    """
    fixed = "kelvin" in distributions["sensor.white_balance"].support
    if not fixed or LAMP_RIG not in distributions["light.kind"].support:
        return
    assumed = max(float(bound) for bound in distributions["sensor.white_kelvin"].support)
    lowest = {
        f"light.{lamp}": min(float(bound) for bound in distributions[f"light.{lamp}.kelvin"].support)
        for lamp in LAMP_NAMES
    }
    sensor = Sensor(white_kelvin=assumed)
    orange = [name for name, T in lowest.items() if lamp_appearance(sensor, T).min() < _MIN_VISIBLE_BLUE]
    if orange:
        T = min(lowest[name] for name in orange)
        notify(
            f"{', '.join(orange)}: lamps down to {T:g} K have no blue with a white balance of {assumed:g} K, "
            f'so pictures can be orange; write white_balance = "lights" in [sensor] to balance their light'
        )


def _check_person(distributions: Mapping[str, Distribution]) -> None:
    person_keys = [name for name in distributions if name.startswith("person.") and name != _HEAD_PARAMETER]
    if _HEAD_PARAMETER in distributions and person_keys:
        refuse(
            person_keys[0], "sampled people", f"{_HEAD_PARAMETER} names heads", "Remove one of the two keys"
        )
    if _ITA_PARAMETER in distributions and _MELANIN_PARAMETER in distributions:
        advice = "Remove one of the two keys"
        refuse("person: ita", "an ITA or the melanin of the skin", "the spec has both", advice)
    ancestries = [distributions[name] for name in _ANCESTRY_PARAMETERS if name in distributions]
    if ancestries and not any(min(one.support) > 0 for one in ancestries):  # type: ignore[operator]
        actual = "all of them can be 0 at once"
        advice = "Raise the lower limit of one"
        refuse("person", "a fraction of african, asian or caucasian above 0", actual, advice)


def _check_expression(expression_names: Distribution, expressions: Mapping[str, Weights]) -> None:
    known = [*expressions, RANDOM_EXPRESSION]
    for value in expression_names.support:
        if value not in known:
            advice = f"Add [expressions.{value}], or correct it"
            refuse("expression: name", f"one of {', '.join(known)}", f"got {value!r}", advice)


def _check_correlations(
    correlation_groups: Sequence[CorrelationGroup], distributions: Mapping[str, Distribution]
) -> None:
    seen: set[str] = set()
    for group in correlation_groups:
        people = [name.startswith("person.") for name in group.of]
        for name in group.of:
            if name not in distributions:
                expected = "names of parameters that the spec samples, such as camera.yaw_deg"
                refuse("correlated: of", expected, f"got {name!r}", "Correct it")
            if name in seen:
                refuse("correlated: of", "each name in one group", f"{name} is in two", "Merge the groups")
        if people != sorted(people, reverse=True):
            actual = f"{group.of[people.index(False)]} precedes one"
            refuse("correlated: of", "parameters of the person first", actual, "Change their order")
        seen |= set(group.of)


def _check_light(distributions: Mapping[str, Distribution]) -> None:
    lamps = (
        NO_LIGHTS not in distributions["light.kind"].support
        and 0.0 not in distributions["light.strength"].support
    )
    name, strength = distributions["environment.name"].support, distributions["environment.strength"].support
    if not lamps and (NO_ENVIRONMENT in name or 0.0 in strength):
        actual = "an image can have neither lamps nor an environment"
        refuse("light", "light in each image", actual, 'Exclude "none" and 0 from lights or environment')


def _check_heads_and_environments(distributions: Mapping[str, Distribution], folder: Path) -> None:
    """Raise DermisError for heads and environments that are neither part of the package nor in the folder.

    folder : folder to which file names in the spec are relative
    """
    heads = [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
    maps = [
        NO_ENVIRONMENT,
        UNIFORM_PANORAMA,
        *(name for name, sample in SAMPLES.items() if sample.kind == "environment"),
    ]
    for parameter, known in ((_HEAD_PARAMETER, heads), ("environment.name", maps)):
        for name in map(str, distributions[parameter].support if parameter in distributions else ()):
            is_person = parameter == _HEAD_PARAMETER and name.startswith(f"{HUMAN}:")
            if name not in known and not is_person and not is_file(folder / name):
                expected = f"a file in the spec's folder, or one of {', '.join(known)}"
                refuse(parameter.replace(".", ": "), expected, f"{name!r} is neither", "Check the name")


def _check_looks(distributions: Mapping[str, Distribution]) -> None:
    """Raise DermisError for unknown names or invalid values in the tables of looks, skin and morph targets.

    The tables of looks are person.skin, person.eyes and person.hair; the tables of morph targets are
    person.targets and pose.

    distributions : distribution of each parameter by its dotted name
    """
    for name in ITEM_TYPES:
        distribution = distributions.get(f"person.{name}")
        for value in () if distribution is None else distribution.support:
            if value == SAMPLED:
                continue
            fields_of_human: dict[str, Any] = {name: value}
            Human(**fields_of_human)
    for part, kind in _LOOK_MODELS.items():
        known = [one.name for one in fields(kind) if one.name not in (_SEED_FIELD, SITES_FIELD)]
        _check_table(f"person.{part}", distributions, known, kind)
    _check_table("person.targets", distributions, human_targets(), lambda **values: Human(targets=values))
    known = [name for name in Skin.model_fields if name not in _UNSAMPLED_SKIN_FIELDS]
    _check_table("skin", distributions, known, Skin)
    for name, distribution in table_values(distributions, "pose").items():
        if any(isinstance(bound, str) or abs(bound) > MAX_WEIGHT for bound in distribution.support):
            expected = f"numbers from {-MAX_WEIGHT:g} to {MAX_WEIGHT:g}"
            refuse(f"pose: {name}", expected, f"got {distribution.spec_value()}", "Correct it")


def _check_table(
    table_name: str,
    distributions: Mapping[str, Distribution],
    allowed_keys: Sequence[str],
    make_model: Callable[..., object],
) -> None:
    """Raise DermisError for unknown keys of a table of the spec, and for distributions with invalid samples.

    table_name : dotted name of the table
    distributions : distributions of all tables, by dotted name
    allowed_keys : allowed keys of the table
    make_model : class or function that accepts each key as a keyword argument and raises DermisError for an
        invalid value; called once for each value in the `support` of each distribution
    """
    for name, distribution in table_values(distributions, table_name).items():
        if name not in allowed_keys:
            listed = (
                ", ".join(allowed_keys) if len(allowed_keys) < 40 else "those of dermis head --list-targets"
            )
            refuse(f"{table_name}: {name}", f"one of {listed}", "this name is unknown", "Correct it")
        for bound in distribution.support:
            try:
                make_model(**{name: bound})
            except DermisError as error:
                raise DermisError(f"{table_name}: {error}") from None
