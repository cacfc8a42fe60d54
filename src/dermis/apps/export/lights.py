"""Lights of a scene by the kinds that another program has."""

from __future__ import annotations

from collections.abc import Container, Iterable

from dermis.base.errors import notify
from dermis.scene.lights import Light


def known_lights(lights: Iterable[Light], known: Container[str], program: str) -> list[Light]:
    """Return the lights, one of an unknown kind as the nearest known kind that it derives from, with a note.

    known : kinds that the program has, points and parallel light among them
    """
    return [_known(light, known, f"light {k}: {program}") for k, light in enumerate(lights, start=1)]


def _known(light: Light, known: Container[str], culprit: str) -> Light:
    if light.kind in known:
        return light
    bases = (one for one in type(light).__mro__ if issubclass(one, Light))
    base = next(one for one in bases if one.model_fields["kind"].default in known)
    found = base(**{name: getattr(light, name) for name in base.model_fields if name != "kind"})
    notify(f"{culprit} has no {light.kind} light and takes it for a {found.kind} light")
    return found
