"""Whose work is in a data set, and under which licence."""

from __future__ import annotations

from collections.abc import Iterator

from dermis.apps.batch.spec import Spec
from dermis.human.model import THANKS
from dermis.mesh.samples import SAMPLES

_OURS = {"none", "uniform", "human"}


def licences(spec: Spec) -> Iterator[tuple[str, str, str]]:
    """Part, author and licence of all that the spec can draw.

    Files that it names are their owner's.
    """
    author, _, licence = THANKS.rpartition(", ")
    yield "people: the parametric human", author, licence
    for parameter in ("person.head", "environment.name"):
        found = spec.distributions.get(parameter)
        for name in () if found is None else map(str, found.ends):
            if name in SAMPLES:
                yield f"{parameter} {name}", SAMPLES[name].attribution, SAMPLES[name].licence
            elif name not in _OURS and not name.startswith("human:"):
                yield f"{parameter} {name}", "a file of the spec", "its owner's: state it here"
    yield "light, skin and pictures", "computed by dermis (Apache-2.0)", "none is claimed"
