"""Licences of the assets (heads, people, environments) that a data set or one of its images uses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from dermis.apps.batch.clips.table import GENERATED_MOTION
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.formats.samples import SAMPLES
from dermis.human.model import MAKEHUMAN_CREDIT

_ASSET_PARAMETERS = "person.head", "environment.name", "background.picture", "clip.motion"
_HUMAN, _HUMAN_PREFIX = "human", "human:"
_NAMES_WITHOUT_FILES = {"none", "uniform", _HUMAN, GENERATED_MOTION}
_OWNER_LICENCE = "set by its owner: state it here"


class Asset(NamedTuple):
    """Asset with its author and licence.

    name : parameter and value, such as "environment.name lebombo"
    """

    name: str
    author: str
    licence: str


def asset_licences(spec: Spec) -> Iterator[Asset]:
    """Yield every asset that the spec can use."""
    yield _human_asset()
    for parameter in _ASSET_PARAMETERS:
        distribution = spec.distributions.get(parameter)
        for name in () if distribution is None else map(str, distribution.support):
            yield from _file_asset(parameter, name)
    yield Asset("light, skin and pictures", "computed by dermis (Apache-2.0)", "none is claimed")


def image_licence(parameters: Parameters) -> str:
    """Return the authors and licences of the assets in one image, such as "MakeHuman community: CC0"."""
    head = str(parameters.get("person.head") or _HUMAN)
    is_human = head == _HUMAN or head.startswith(_HUMAN_PREFIX)
    assets = [_human_asset()] if is_human else list(_file_asset("person.head", head))
    for name in _ASSET_PARAMETERS[1:]:
        assets += _file_asset(name, str(parameters.get(name) or "none"))
    return "; ".join(dict.fromkeys(f"{one.author}: {one.licence}" for one in assets))


def _human_asset() -> Asset:
    author, _, licence = MAKEHUMAN_CREDIT.rpartition(", ")
    return Asset("people: the parametric human", author, licence)


def _file_asset(parameter: str, name: str) -> Iterator[Asset]:
    if name in SAMPLES:
        yield Asset(f"{parameter} {name}", SAMPLES[name].attribution, SAMPLES[name].licence)
    elif name not in _NAMES_WITHOUT_FILES and not name.startswith(_HUMAN_PREFIX):
        yield Asset(f"{parameter} {name}", "a file of the spec", _OWNER_LICENCE)
