"""What hands move on the page: the camera and the lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.web.described import Named, described
from dermis.apps.export.targets.web.dials import Dial, changes, node_inputs
from dermis.apps.export.targets.web.maps import Pictured, picture_of, shorten, texels_of
from dermis.apps.export.targets.web.packing import Packer
from dermis.frame.capture import FORMS, renderer_for, sparser, taken
from dermis.frame.features.shading.view import pinhole
from dermis.frame.inputs import Inputs
from dermis.frame.renderer import Renderer
from dermis.gpu.capture import FrameCapture
from dermis.mesh.outline import Outline
from dermis.scene.lights import SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Json = dict[str, Any]


def hands_of(scene: Scene, inputs: Inputs) -> Json:
    """The camera, the lights that can be dragged, and the outline that shadow maps are fitted to."""
    settings: Settings = inputs.settings
    camera, seen = scene.camera, pinhole(scene.camera, scene.head, settings)
    outline: Outline = scene.head.mesh.outline
    return {
        "centre": [float(x) for x in scene.head.centre_mm],
        "camera": {
            "position": list(camera.position),
            "target": list(camera.target),
            "up": list(camera.up),
            "half": list(seen.window.half),
            "shift": list(seen.window.shift),
        },
        "samples": inputs.camera.places.tolist(),
        "outline": np.asarray(outline.places_mm, np.float32).round(3).ravel().tolist(),
        "slack": outline.slack_mm,
        "middle": list(outline.middle_mm),
        "shadow_size": settings.shadow_size,
        "lights": [_light(one) for one in scene.lights],
    }


def _light(light: Any) -> Json | None:
    """A light that stands somewhere and has one shadow map; None for others, which stay where they are."""
    if not isinstance(light, SpotLight) or not light.shadows:
        return None
    return {"position": list(light.position), "target": list(light.target), "softness": light.softness_mm}


TECHNIQUES = ("texture-space", "none")
SIZES = {"gpu": (512, 1024, 1600), "software": (512,)}
"""Sides of the square pictures of each form [pixel]."""
MOVING = {"software": (256, 1, 2)}
"""Of forms that draw less while hands move: side [pixel], samples, and how many coarse hairs become one."""


@dataclass
class Built:
    """What the page holds.

    forms : the description of each form's frames
    pictures : maps as WebP
    """

    forms: dict[str, Json] = field(default_factory=dict)
    packer: Packer = field(default_factory=Packer)
    maps: Pictured = field(default_factory=Pictured)
    pictures: list[bytes] = field(default_factory=list)
    poster: NDArray[np.uint8] | None = None

    def picture(self, data: bytes) -> int:
        """The number of a picture."""
        self.pictures.append(data)
        return len(self.pictures) - 1


@dataclass(frozen=True)
class Asked:
    """What is to be built.

    settings : of all frames, but for size and technique
    sizes : sides of the pictures of each form, see `SIZES`; forms that are left out are not built
    moving : what is drawn while hands move, see `MOVING`; forms that are left out draw all
    """

    scene: Scene
    dials: tuple[Dial, ...]
    settings: Settings
    sizes: dict[str, tuple[int, ...]]
    adapter: str = "auto"
    moving: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def frames(self, form: str) -> Iterator[tuple[Settings, int]]:
        """Of a form's frames the settings, and how many coarse hairs become one, 0 for those that rest."""
        for technique in TECHNIQUES:
            for side in self.sizes[form]:
                yield self.sized(side, technique), 0
            if form in self.moving:
                side, samples, fewer = self.moving[form]
                yield self.sized(side, technique).model_copy(update={"samples": samples}), fewer

    def sized(self, side: int, technique: str = TECHNIQUES[0]) -> Settings:
        """The settings of a frame; before light spreads it does not pass between surfaces either.

        Every layout has links of its own: those of a second one would be 0.6 MB of the page.
        """
        spreads = {"technique": technique, "interreflection": technique == TECHNIQUES[0]}
        return self.settings.model_copy(update={"size": (side, side), **spreads})


def built(asked: Asked, look: Callable[[Renderer, Scene, Settings], None] | None = None) -> Built:
    """The scene for the page.

    look : given each form's renderer, whose maps are then those that the page decodes
    """
    made = Built()
    for form in (one for one in FORMS if asked.sizes.get(one)):
        renderer = renderer_for(form, asked.adapter)
        made.forms[form] = _form(made, renderer, asked, form)
        settings = asked.sized(asked.sizes[form][0])
        if look is not None:
            look(renderer, asked.scene, settings)
        if made.poster is None:
            made.poster = renderer.draw(asked.scene, settings).srgb8()
    return made


def _form(made: Built, renderer: Renderer, asked: Asked, form: str) -> Json:
    tape, frames, turned = FrameCapture(renderer.device), list[Named](), list[Json]()
    base: Inputs | None = None
    for settings, fewer in asked.frames(form):
        inputs = renderer.prepare(asked.scene, settings)
        base, picture = base or inputs, inputs.resources.post.picture
        take = sparser(taken(tape, inputs), fewer)
        frames.append(Named(settings.technique, take, picture, settings.size, fewer))
        turned.append(_turned(made.packer, renderer, asked, settings, inputs, frames[-1]))
    mapped = made.maps.put(renderer, tape, [one.take for one in frames])
    steps = shorten(renderer, tape, [one.take for one in frames])
    found = described(tape, frames, mapped, steps, made.packer)
    for one, dials in zip(found["frames"], turned, strict=True):
        one["dials"] = dials
    found["maps"] = _pictured(made, mapped)
    assert base is not None
    found["hands"] = hands_of(asked.scene, base)
    found["colours"] = _colours(made, renderer, asked, mapped)
    return found


def _turned(
    packer: Packer, renderer: Renderer, asked: Asked, settings: Settings, base: Inputs, one: Named
) -> Json:
    """What each dial's nodes change in a frame."""
    found, beside = {}, FrameCapture(renderer.device)
    for dial in asked.dials:
        nodes = node_inputs(dial, lambda scene: renderer.prepare(scene, settings), base)
        found[dial.name] = [
            None if inputs is None else changes(one.take, sparser(taken(beside, inputs), one.fewer), packer)
            for inputs in nodes
        ]
    return found


def _pictured(made: Built, mapped: dict[int, Any]) -> Json:
    """Of each map the pictures and curves of its mips' layers."""
    found: Json = {}
    for number, (role, mips, _) in mapped.items():
        layers = 1 + max(layer for name, _, layer in made.maps.pictures if name == role)
        found[str(number)] = [[_placed(made, (role, mip, k)) for k in range(layers)] for mip in range(mips)]
    return found


def _placed(made: Built, key: tuple[str, int, int]) -> list[Any]:
    """A picture's number, the blob of its curves, and how many of its channels are colours."""
    one = made.maps.pictures[key]
    if key not in made.maps.placed:
        curves = made.packer.add(np.ascontiguousarray(one.curves).view(np.uint8).reshape(-1))
        made.maps.placed[key] = [made.picture(one.data), curves, 3 if key[0] == "colour_map" else 0]
    return made.maps.placed[key]


def _colours(made: Built, renderer: Renderer, asked: Asked, mapped: dict[int, Any]) -> Json:
    """Of dials that change the colour map: its number, and at each node its picture and curves."""
    number = next((k for k, (role, *_) in mapped.items() if role == "colour_map"), None)
    found: Json = {}
    if number is None:
        return found
    settings = asked.sized(min(map(min, asked.sizes.values())))
    for dial in (one for one in asked.dials if not one.moves):
        nodes = [
            _colour(made, renderer, scene, settings, dial.name, k) for k, scene in enumerate(dial.scenes)
        ]
        if any(nodes):
            found[dial.name] = nodes
    return {"map": number, "dials": found} if found else {}


def _colour(
    made: Built, renderer: Renderer, scene: Scene | None, settings: Settings, dial: str, node: int
) -> list[Any] | None:
    """The picture of a node's colour map, None where it is that at rest."""
    if scene is None:
        return None
    key = f"{dial} {node}", 0, 0
    if key not in made.maps.pictures:
        tape, texture = FrameCapture(renderer.device), renderer.prepare(scene, settings).lit["colour_map"]
        texels = texels_of(tape, tape.resource(texture), 0)[0]
        if made.maps.same("colour_map", texels):
            return None
        made.maps.pictures[key] = picture_of(texels, True)
    return [*_placed(made, key)[:2], 3]
