"""Regions of the face, chosen for a head that is there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from dermis.errors import refuse
from dermis.human.regions.apply import with_regions
from dermis.mesh.head import Head
from dermis.scene.heads import load_head
from dermis.scene.skin import Skin
from dermis.viewer.state import ViewerState

NO_REGIONS = "none"


def regional(state: ViewerState, name: str, known: Iterable[ViewerState] = ()) -> ViewerState:
    """The state with a table of regions, or with none.

    known : states whose heads are taken where they are the wanted ones, so that nothing is made twice

    Raises DermisError for heads whose regions are not known and for heads made in memory.
    """
    if not state.head:
        refuse(
            "regions", "a head from a file or a sample", "it was made in memory", "Write it to a file first"
        )
    bare = {key: value for key, value in state.head.items() if key != "regions"}
    wanted = bare if name == NO_REGIONS else bare | {"regions": name}
    for other in known:
        if dict(other.head) == wanted:
            return state.with_head(other.scene.head, wanted, other.scene.skin.rho_s)
    head = state.scene.head if "regions" not in state.head else _loaded(bare)
    if name == NO_REGIONS:
        return state.with_head(head, wanted, Skin().rho_s)
    head, rho_s = with_regions(head, name)
    return state.with_head(head, wanted, rho_s)


def _loaded(table: Mapping[str, Any]) -> Head:
    options = {key: value for key, value in table.items() if key != "name"}
    return load_head(table["name"], **options)
