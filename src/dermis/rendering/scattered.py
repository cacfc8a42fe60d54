"""What the textures of scattered light show, so that a camera that moves does not light the atlas again."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from dermis.rendering.inputs import Inputs


class Scattered:
    """For each texture of light that leaves below the surface: all that `scatter` made it from."""

    def __init__(self) -> None:
        self._shown: weakref.WeakKeyDictionary[Any, tuple[Any, ...]] = weakref.WeakKeyDictionary()

    def holds(self, inputs: Inputs) -> bool:
        """Whether the texture already shows just that."""
        return self._shown.get(inputs.scattered) == scatter_key(inputs)

    def note(self, inputs: Inputs) -> None:
        """It was drawn."""
        for layout in inputs.layouts:  # what is blended shows light by itself too
            self._shown.pop(layout.scattered, None)
        self._shown[inputs.scattered] = scatter_key(inputs)

    def forget_all(self) -> None:
        """Nobody knows what the textures show."""
        self._shown.clear()


def scatter_key(inputs: Inputs) -> tuple[Any, ...]:
    """Everything that `scatter` reads: numbers by their bytes, textures and buffers by identity."""
    key: list[Any] = [inputs.settings.technique, inputs.edge, inputs.light_switches, inputs.shadow_key]
    key += [part.tobytes() for part in (inputs.blurred_mm2, inputs.level_weight, inputs.clear)]
    key += [_identity(inputs.levels.stack), inputs.scale]
    for layout in inputs.layouts:
        read = layout.lit | layout.atlas.resources
        key += [(name, _identity(value)) for name, value in sorted(read.items())]
        key.append(_identity(layout.scattered))
        key.append(_identity(layout.thin.links) if layout.thin else None)
    return tuple(key)


def _identity(value: Any) -> Any:
    """A record's bytes, or a reference that keeps nothing alive and never equals one to another thing."""
    return value.tobytes() if isinstance(value, np.ndarray) else weakref.ref(value)
