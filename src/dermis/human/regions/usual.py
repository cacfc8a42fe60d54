"""Gloss by region of the face, as far as heads have no map of it themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.base.disk import Array, Arrays, cached_arrays
from dermis.base.errors import DermisError
from dermis.base.progress import preparing
from dermis.human.regions.apply import SIZE, with_regions
from dermis.human.regions.labels import known_landmarks
from dermis.human.regions.table import DEFAULT, load_table
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

_FORM = 2  # increment when `with_regions` gives other maps for the same head


@preparing("finding the regions of the face")
def with_usual_regions(head: Head) -> Head:
    """The head with the package's table by region, where it knows the regions and no map says the roughness.

    Strengths are relative to each other: a skin's rho_s is their mean, as of every map. A map of the head's
    own stays: it knows the person, and the table is an artist's.
    """
    if head.maps.rough or known_landmarks(head) is None:
        return head
    table = load_table(DEFAULT)
    missing = ["roughness"] if head.maps.specular is not None else ["roughness", "specular"]
    sources: list[Array] = [head.mesh.positions, head.mesh.uv, head.mesh.triangles, table.values]

    def make() -> Arrays:
        maps = with_regions(replace(head, maps=Maps()), table)[0].maps
        return {name: np.asarray(getattr(maps, name), np.float32) for name in missing}

    try:
        found = cached_arrays(sources, f"regions {_FORM} {SIZE} {head.name}", missing, make)
    except DermisError:  # of a known name, but another head
        return head
    return replace(head, maps=replace(head.maps, **found))
