"""Gloss by region of the face for heads that have no map of it themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.disk import Array, Arrays, cached_arrays
from dermis.errors import DermisError
from dermis.human.regions.apply import SIZE, with_regions
from dermis.human.regions.labels import known_landmarks
from dermis.human.regions.table import DEFAULT, load_table
from dermis.mesh.head import Head
from dermis.preparing import preparing

_FORM = 1  # increment when `with_regions` gives other maps for the same head
_NAMES = ["roughness", "specular"]


@preparing("finding the regions of the face")
def with_usual_regions(head: Head) -> Head:
    """The head with the package's table by region, where it knows the regions and no map says the roughness.

    Strengths are relative to each other: a skin's rho_s is their mean, as of every map.
    """
    if head.maps.rough or known_landmarks(head) is None:
        return head
    table = load_table(DEFAULT)
    own = [] if head.maps.specular is None else [head.maps.specular]
    sources: list[Array] = [head.mesh.positions, head.mesh.uv, head.mesh.triangles, table.values, *own]

    def make() -> Arrays:
        maps = with_regions(head, table)[0].maps
        return {name: np.asarray(getattr(maps, name), np.float32) for name in _NAMES}

    try:
        found = cached_arrays(sources, f"regions {_FORM} {SIZE} {head.name}", _NAMES, make)
    except DermisError:  # of a known name, but another head
        return head
    return replace(head, maps=replace(head.maps, **found))
