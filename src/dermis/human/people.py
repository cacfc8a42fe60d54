"""Heads of many people, fast: what a layout gives is made once, and what is a person's own for each."""

from __future__ import annotations

from dermis.human.model import Layout
from dermis.human.person import Human
from dermis.human.template import template
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps


class People:
    """Makes heads that share their topology, so that a renderer draws one after the other with one atlas.

    layout, subdivide : see `Human.head`
    """

    def __init__(self, subdivide: int = 1, layout: Layout = "own") -> None:
        self._subdivide, self._layout = subdivide, layout

    def head(self, person: Human, maps: Maps | None = None) -> Head:
        """The head of a person, the same as `Human.head` makes, whoever came before.

        maps : see `Human.head`

        Raises DermisError as `Human.head` does.
        """
        return person.head(maps, self._layout, self._subdivide)

    @property
    def template(self) -> Head:
        """The bare mean person whose atlas and tables all of them share."""
        return template(self._layout, self._subdivide).head
