"""Checks of a spec across its tables, and of names and values that other models define."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.spec_tables import MIXTURE, NONE, Correlated, table_of
from dermis.base.errors import DermisError, refuse, shortened
from dermis.base.reading import is_file
from dermis.environment.panorama import UNIFORM
from dermis.formats.samples import SAMPLES
from dermis.human.expressions import Weights
from dermis.human.hair.look import HairLook
from dermis.human.landmarks.points import table_points
from dermis.human.landmarks.sets import SETS
from dermis.human.person import Human
from dermis.human.published import human_targets
from dermis.human.skin.look import SkinLook
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.pose import MOST_WEIGHT
from dermis.scene.heads import HUMAN
from dermis.scene.lights import NO_LIGHTS
from dermis.scene.skin import Skin

_NO_DIALS = "pigments", "layers", "profile_map", "other_profiles"
_SEED = "seed"  # a whole number, which follows from the person
_LOOKS: Mapping[str, type] = {"skin": SkinLook, "eyes": EyeLook, "hair": HairLook}
_ANCESTRY = "person.african", "person.asian", "person.caucasian"
HEAD_NAME = "person.head"
_LONGEST = 100  # letters of a name


def check_spec(
    sampled: Mapping[str, Distribution],
    expressions: Mapping[str, Weights],
    groups: Sequence[Correlated],
    folder: Path,
) -> None:
    """Refuse distributions that cannot be rendered, by table and key.

    sampled : distributions by the names of their parameters
    folder : of the files that they name
    """
    _check_dials(sampled)
    _check_person(sampled)
    _check_expression(sampled["expression.name"], expressions)
    _check_correlated(groups, sampled)
    _check_light(sampled)
    _check_named(sampled, folder)


def check_landmarks(names: Sequence[str], folder: Path) -> None:
    """Refuse names that are neither a set of landmarks nor a table that can be read."""
    for name in names:
        if name in SETS:
            continue
        if not name.endswith(".csv") or not is_file(folder / name):
            expected = f"some of {', '.join(SETS)}, or tables of name,vertex (.csv) in the spec's folder"
            refuse("landmarks", expected, f"{shortened(name, _LONGEST)!r} came", "Correct it")
        table_points(str(folder / name))


def _check_person(sampled: Mapping[str, Distribution]) -> None:
    given = [name for name in sampled if name.startswith("person.") and name != HEAD_NAME]
    if HEAD_NAME in sampled and given:
        remedy = "Leave one out"
        refuse(given[0], "people that are drawn", f"{HEAD_NAME} names heads", remedy)
    shares = [sampled[name] for name in _ANCESTRY if name in sampled]
    if shares and not any(min(share.support) > 0 for share in shares):  # type: ignore[operator]
        came = "all of them can be 0 at once"
        refuse("person", "a share of african, asian or caucasian above 0", came, "Raise the low end of one")


def _check_expression(name: Distribution, expressions: Mapping[str, Weights]) -> None:
    known = [*expressions, MIXTURE]
    for end in name.support:
        if end not in known:
            remedy = f"Add [expressions.{end}], or correct it"
            refuse("expression: name", f"one of {', '.join(known)}", f"{end!r} came", remedy)


def _check_correlated(groups: Sequence[Correlated], sampled: Mapping[str, Distribution]) -> None:
    seen: set[str] = set()
    for group in groups:
        people = [name.startswith("person.") for name in group.of]
        for name in group.of:
            if name not in sampled:
                expected = "names of parameters that the spec draws, such as camera.yaw_deg"
                refuse("correlated: of", expected, f"{name!r} is none", "Correct it")
            if name in seen:
                refuse("correlated: of", "each name in one group", f"{name} is in two", "Make one of both")
        if people != sorted(people, reverse=True):
            came = f"{group.of[people.index(False)]} comes before one"
            refuse("correlated: of", "parameters of the person first", came, "Change their order")
        seen |= set(group.of)


def _check_light(sampled: Mapping[str, Distribution]) -> None:
    lamps = NO_LIGHTS not in sampled["light.kind"].support and 0.0 not in sampled["light.strength"].support
    around = NONE not in sampled["environment.name"].support and 0.0 not in sampled["environment.strength"].support
    if not lamps and not around:
        came = "there can be neither lamps nor an environment"
        refuse("light", "some light in each image", came, "Take none or 0 out of one of both")


def _check_named(sampled: Mapping[str, Distribution], folder: Path) -> None:
    """Refuse heads and environments that are neither the package's nor files."""
    heads = [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
    around = [NONE, UNIFORM, *(name for name, sample in SAMPLES.items() if sample.kind == "environment")]
    for parameter, known in ((HEAD_NAME, heads), ("environment.name", around)):
        for name in map(str, sampled[parameter].support if parameter in sampled else ()):
            person = parameter == HEAD_NAME and name.startswith(f"{HUMAN}:")
            if name not in known and not person and not is_file(folder / name):
                expected = f"a file in the spec's folder, or one of {', '.join(known)}"
                refuse(parameter.replace(".", ": "), expected, f"{name!r} is neither", "Check the name")


def _check_dials(sampled: Mapping[str, Distribution]) -> None:
    """Refuse names and values that people, skins and poses do not have."""
    for part, kind in _LOOKS.items():
        known = [one.name for one in fields(kind) if one.name != _SEED]
        _check_table(f"person.{part}", sampled, known, kind)
    _check_table("person.targets", sampled, human_targets(), lambda **values: Human(targets=values))
    known = [name for name in Skin.model_fields if name not in _NO_DIALS]
    _check_table("skin", sampled, known, Skin)
    for name, one in table_of(sampled, "pose").items():
        if any(isinstance(end, str) or abs(end) > MOST_WEIGHT for end in one.support):
            expected = f"numbers from {-MOST_WEIGHT:g} to {MOST_WEIGHT:g}"
            refuse(f"pose: {name}", expected, f"{one.spec_value()} came", "Correct it")


def _check_table(
    table: str,
    sampled: Mapping[str, Distribution],
    known: Sequence[str],
    make: Callable[..., object],
) -> None:
    """Refuse unknown names of a table, and values that `make` refuses: the ends of each distribution."""
    for name, one in table_of(sampled, table).items():
        if name not in known:
            listed = ", ".join(known) if len(known) < 40 else "those of dermis head --list-targets"
            refuse(f"{table}: {name}", f"one of {listed}", "this name is unknown", "Correct it")
        for end in one.support:
            try:
                make(**{name: end})
            except DermisError as error:
                raise DermisError(f"{table}: {error}") from None
