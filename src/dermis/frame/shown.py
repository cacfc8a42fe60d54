"""What textures show, so that a frame computes only what has changed since the last one."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

import numpy as np

from dermis.frame.atlas_layout import Layout
from dermis.frame.inputs import Inputs


class Shown:
    """For each texture all that it was last made from."""

    def __init__(self) -> None:
        self._keys: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        self._keeps = False

    def begin(self, keeps: bool) -> None:
        """Begin a frame.

        keeps : False has it draw everything, without the time that keys take
        """
        self._keeps = keeps
        if not keeps:
            self.forget_all()

    def keep(self, texture: Any, key_of: Callable[[], Any], draw: Callable[[], object]) -> None:
        """Leave the texture as it is when it shows just that, else draw it."""
        if not self._keeps:
            draw()
        elif self._keys.get(texture) != (key := key_of()):
            draw()
            self._keys[texture] = key

    def forget(self, texture: Any) -> None:
        """Nobody knows what it shows."""
        self._keys.pop(texture, None)

    def forget_all(self) -> None:
        """Nobody knows what any of them shows."""
        self._keys.clear()


def entered_key(inputs: Inputs, layout: Layout) -> tuple[Any, ...]:
    """Everything that the light which enters is made from: no profile is among it.

    Numbers count by their bytes, textures and buffers by identity.
    """
    read = layout.lit | layout.atlas.resources
    return inputs.light_constants, inputs.shadow_key, inputs.scale, _identities(read)


def scattered_key(inputs: Inputs) -> tuple[Any, ...]:
    """Everything that the light which leaves is made from."""
    key: list[Any] = [inputs.settings.technique, inputs.edge, _identity(inputs.levels.stack)]
    key += [part.tobytes() for part in (inputs.blurred_mm2, inputs.level_weight, inputs.clear)]
    for layout in inputs.layouts:
        key += [entered_key(inputs, layout), _identity(layout.scattered)]
        key.append(_identity(layout.thin.weights) if layout.thin else None)
    return tuple(key)


def seen_key(inputs: Inputs) -> tuple[Any, ...]:
    """Everything that tells which triangle is seen where."""
    clips, places = inputs.camera
    return clips.tobytes(), places.tobytes(), _identities(inputs.head.resources)


def radiance_key(inputs: Inputs) -> tuple[Any, ...]:
    """Everything that the picture before exposure is made from."""
    below = scattered_key(inputs) if inputs.scatters else _identity(inputs.scattered)
    key = inputs.constants, inputs.shadow_key, inputs.view.tobytes(), _identities(inputs.lit)
    return (*key, _identity(inputs.seen.texture), seen_key(inputs), below)


def _identities(resources: dict[str, Any]) -> tuple[Any, ...]:
    return tuple((name, _identity(value)) for name, value in sorted(resources.items()))


def _identity(value: Any) -> Any:
    """A record's bytes, or a reference that keeps nothing alive and never equals one to another thing."""
    return value.tobytes() if isinstance(value, np.ndarray) else weakref.ref(value)
