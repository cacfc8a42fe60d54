"""What of a spec does not go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dermis.apps.batch.dials import check_looks, check_skin, check_weights
from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.tables import MIXTURE, NONE
from dermis.base.errors import about, refuse, shortened
from dermis.base.reading import is_file
from dermis.environment.panorama import UNIFORM
from dermis.frame.outputs import asked_outputs
from dermis.human.landmarks.points import table_points
from dermis.human.landmarks.sets import SETS
from dermis.mesh.samples import SAMPLES
from dermis.scene.heads import HUMAN
from dermis.scene.lights import NO_LIGHTS

_ANCESTRY = "person.african", "person.asian", "person.caucasian"
_HEAD = "person.head"
_LONGEST = 100  # letters of a name


def check_spec(spec: Any, drawn: Mapping[str, Distribution], expressions: Mapping[str, Any]) -> None:
    """Refuse a spec that cannot be drawn, by table and key."""
    with about("outputs"):
        asked_outputs(spec.outputs)
    _check_landmarks(spec.landmarks, spec.folder)
    check_looks(spec.person)
    check_skin(spec.skin)
    check_weights(spec.pose)
    _check_person(drawn)
    _check_expression(spec.expression.name, expressions)
    _check_correlated(spec.correlated, drawn)
    _check_light(drawn)
    _check_named(drawn, spec.folder)


def _check_landmarks(names: Sequence[str], folder: Path) -> None:
    """Refuse what is neither a set nor a table that can be read."""
    for name in names:
        if name in SETS:
            continue
        if not name.endswith(".csv") or not is_file(folder / name):
            expected = f"some of {', '.join(SETS)}, or tables of name,vertex (.csv) in the spec's folder"
            refuse("landmarks", expected, f"{shortened(name, _LONGEST)!r} came", "Correct it")
        table_points(str(folder / name))


def _check_person(drawn: Mapping[str, Distribution]) -> None:
    given = [name for name in drawn if name.startswith("person.") and name != _HEAD]
    if _HEAD in drawn and given:
        remedy = "Leave one out"
        refuse(given[0], "people that are drawn", f"{_HEAD} names heads", remedy)
    shares = [drawn[name] for name in _ANCESTRY if name in drawn]
    if shares and not any(min(share.ends) > 0 for share in shares):  # type: ignore[operator]
        came = "all of them can be 0 at once"
        refuse("person", "a share of african, asian or caucasian above 0", came, "Raise the low end of one")


def _check_expression(name: Distribution, expressions: Mapping[str, Any]) -> None:
    known = [*expressions, MIXTURE]
    for end in name.ends:
        if end not in known:
            remedy = f"Add [expressions.{end}], or correct it"
            refuse("expression: name", f"one of {', '.join(known)}", f"{end!r} came", remedy)


def _check_correlated(groups: Any, drawn: Mapping[str, Distribution]) -> None:
    seen: set[str] = set()
    for group in groups:
        people = [name.startswith("person.") for name in group.of]
        for name in group.of:
            if name not in drawn:
                expected = "names of parameters that the spec draws, such as camera.yaw_deg"
                refuse("correlated: of", expected, f"{name!r} is none", "Correct it")
            if name in seen:
                refuse("correlated: of", "each name in one group", f"{name} is in two", "Make one of both")
        if people != sorted(people, reverse=True):
            came = f"{group.of[people.index(False)]} comes before one"
            refuse("correlated: of", "parameters of the person first", came, "Change their order")
        seen |= set(group.of)


def _check_light(drawn: Mapping[str, Distribution]) -> None:
    lamps = NO_LIGHTS not in drawn["light.kind"].ends and 0.0 not in drawn["light.strength"].ends
    around = NONE not in drawn["environment.name"].ends and 0.0 not in drawn["environment.strength"].ends
    if not lamps and not around:
        came = "there can be neither lamps nor an environment"
        refuse("light", "some light in each image", came, "Take none or 0 out of one of both")


def _check_named(drawn: Mapping[str, Distribution], folder: Path) -> None:
    """Refuse heads and environments that are neither the package's nor files."""
    heads = [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
    around = [NONE, UNIFORM, *(name for name, sample in SAMPLES.items() if sample.kind == "environment")]
    for parameter, known in ((_HEAD, heads), ("environment.name", around)):
        for name in map(str, drawn[parameter].ends if parameter in drawn else ()):
            person = parameter == _HEAD and name.startswith(f"{HUMAN}:")
            if name not in known and not person and not is_file(folder / name):
                expected = f"a file in the spec's folder, or one of {', '.join(known)}"
                refuse(parameter.replace(".", ": "), expected, f"{name!r} is neither", "Check the name")
