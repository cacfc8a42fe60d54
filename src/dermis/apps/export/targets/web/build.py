"""Content of the page: frames of a scene in two forms, at several sizes, before and after light spreads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.target import floats
from dermis.apps.export.targets.web.frame_json import (
    Json,
    NamedFrame,
    PictureMap,
    PictureMaps,
    describe_frames,
)
from dermis.apps.export.targets.web.maps import (
    MapPictures,
    PictureKey,
    encode_picture,
    quantise_hairs,
    read_texels,
)
from dermis.apps.export.targets.web.packing import Packer
from dermis.apps.export.targets.web.sliders import Slider, node_changes, node_inputs
from dermis.frame.capture import ADAPTER_KINDS, capture_frame, capture_renderer, reduce_hair
from dermis.frame.features.shading.view import pinhole
from dermis.frame.inputs import FrameInputs
from dermis.frame.renderer import Renderer
from dermis.gpu.capture import FrameCapture
from dermis.scene.lights import Light, SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

TECHNIQUES = ("texture-space", "none")
PICTURE_SIDES = {"gpu": (512, 1024, 1600), "software": (512,)}
"""Sides of the square pictures for each kind of adapter [pixel]."""
INTERACTIVE_QUALITY = {"software": (256, 1, 2)}
"""Reduced quality during interaction: side [pixel], samples per pixel, and hairs merged into one."""


@dataclass
class PageContent:
    """Content of the page.

    forms : the description of each form's frames
    pictures : maps as WebP
    placed : number of a picture, number of the run of its curves, how many of its channels are colours;
        by role, mip and layer
    """

    forms: dict[str, Json] = field(default_factory=dict)
    packer: Packer = field(default_factory=Packer)
    maps: MapPictures = field(default_factory=MapPictures)
    pictures: list[bytes] = field(default_factory=list)
    picture_entries: dict[PictureKey, tuple[int, int, int]] = field(default_factory=dict)
    poster: NDArray[np.uint8] | None = None

    def add_picture(self, key: PictureKey) -> tuple[int, int, int]:
        """Add a picture and its curves once; return its entry of `picture_entries`."""
        if key not in self.picture_entries:
            picture = self.maps.pictures[key]
            curves = self.packer.add(np.ascontiguousarray(picture.curves).view(np.uint8).reshape(-1))
            self.picture_entries[key] = len(self.pictures), curves, 3 if key[0] == "colour_map" else 0
            self.pictures.append(picture.data)
        return self.picture_entries[key]


@dataclass(frozen=True)
class PageRequest:
    """Request for the content of a page.

    settings : of all frames, but for size and technique
    sizes : sides of the pictures of each form, see `PICTURE_SIDES`; forms that are left out are not built
    moving : what is drawn while hands move, see `INTERACTIVE_QUALITY`; forms that are left out draw all
    """

    scene: Scene
    sliders: tuple[Slider, ...]
    settings: Settings
    sizes: dict[str, tuple[int, ...]]
    adapter: str = "auto"
    interactive: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def frames(self, form: str) -> Iterator[tuple[Settings, int]]:
        """Yield a form's frames: settings, and how many coarse hairs become one, 0 for frames at rest."""
        for technique in TECHNIQUES:
            for side in self.sizes[form]:
                yield self.settings_for(side, technique), 0
            if form in self.interactive:
                side, samples, merged_hairs = self.interactive[form]
                yield self.settings_for(side, technique).model_copy(update={"samples": samples}), merged_hairs

    def settings_for(self, side: int, technique: str = TECHNIQUES[0]) -> Settings:
        """Return the settings of a frame; before light spreads it does not pass between surfaces either.

        Every layout has links of its own: those of a second one would be 0.6 MB of the page.
        """
        diffusion = {"technique": technique, "interreflection": technique == TECHNIQUES[0]}
        return self.settings.model_copy(update={"size": (side, side), **diffusion})


def build_content(
    request: PageRequest, on_renderer: Callable[[Renderer, Scene, Settings], None] | None = None
) -> PageContent:
    """Return the scene for the page.

    look : called with each form's renderer, whose maps are then those that the page decodes
    """
    content = PageContent()
    for form in (one for one in ADAPTER_KINDS if request.sizes.get(one)):
        renderer = capture_renderer(form, request.adapter)
        content.forms[form] = _build_form(content, renderer, request, form)
        settings = request.settings_for(request.sizes[form][0])
        if on_renderer is not None:
            on_renderer(renderer, request.scene, settings)
        if content.poster is None:
            content.poster = renderer.draw(request.scene, settings).srgb8()
    return content


def _build_form(content: PageContent, renderer: Renderer, request: PageRequest, form: str) -> Json:
    capture, frames, slider_changes = FrameCapture(renderer.device), list[NamedFrame](), list[Json]()
    base: FrameInputs | None = None
    for settings, merged_hairs in request.frames(form):
        inputs = renderer.prepare(request.scene, settings)
        base, picture = base or inputs, inputs.resources.post.picture
        captured = reduce_hair(capture_frame(capture, inputs), merged_hairs)
        frames.append(NamedFrame(settings.technique, captured, picture, settings.size, merged_hairs))
        changes = _frame_changes(content.packer, renderer, request, settings, inputs, frames[-1])
        slider_changes.append(changes)
    captured_frames = [frame.captured for frame in frames]
    picture_maps = content.maps.replace_textures(renderer, capture, captured_frames)
    steps = quantise_hairs(renderer, capture, captured_frames)
    form_json = describe_frames(capture, frames, picture_maps, steps, content.packer)
    for frame_json, changes in zip(form_json["frames"], slider_changes, strict=True):
        frame_json["dials"] = changes
    form_json["maps"] = {str(number): _mip_entries(content, one) for number, one in picture_maps.items()}
    assert base is not None
    form_json["hands"] = _interaction(request.scene, base)
    form_json["colours"] = _colour_maps(content, renderer, request, picture_maps)
    return form_json


def _frame_changes(
    packer: Packer,
    renderer: Renderer,
    request: PageRequest,
    settings: Settings,
    base: FrameInputs,
    frame: NamedFrame,
) -> Json:
    """Return the changes of a frame at each dial's nodes."""
    capture = FrameCapture(renderer.device)

    def changes(inputs: FrameInputs | None) -> Json | None:
        if inputs is None:
            return None
        node = reduce_hair(capture_frame(capture, inputs), frame.merged_hairs)
        return node_changes(frame.captured, node, packer)

    return {
        slider.name: [*map(changes, node_inputs(slider, lambda one: renderer.prepare(one, settings), base))]
        for slider in request.sliders
    }


def _mip_entries(content: PageContent, map_: PictureMap) -> list[list[tuple[int, int, int]]]:
    """Return the pictures and curves of the layers of a map's mips."""
    layers = 1 + max(layer for role, _, layer in content.maps.pictures if role == map_.role)
    return [[content.add_picture((map_.role, mip, k)) for k in range(layers)] for mip in range(map_.mips)]


def _colour_maps(
    content: PageContent, renderer: Renderer, request: PageRequest, picture_maps: PictureMaps
) -> Json:
    """Return the number of the colour map, and its picture and curves at nodes of dials that change it."""
    number = next((k for k, one in picture_maps.items() if one.role == "colour_map"), None)
    if number is None:
        return {}
    settings, entries = request.settings_for(min(map(min, request.sizes.values()))), {}
    for slider in (one for one in request.sliders if not one.changes_pose_only):
        scenes = enumerate(slider.scenes)
        nodes = [_colour_entry(content, renderer, one, settings, f"{slider.name} {k}") for k, one in scenes]
        if any(nodes):
            entries[slider.name] = nodes
    return {"map": number, "dials": entries} if entries else {}


def _colour_entry(
    content: PageContent, renderer: Renderer, scene: Scene | None, settings: Settings, name: str
) -> tuple[int, int, int] | None:
    """Return the picture of a node's colour map, None where it is the same as at rest."""
    if scene is None:
        return None
    if (name, 0, 0) not in content.maps.pictures:
        capture = FrameCapture(renderer.device)
        texture = renderer.prepare(scene, settings).bindings["colour_map"]
        texels = read_texels(capture, capture.resource(texture), 0)[0]
        if content.maps.matches_picture("colour_map", texels):
            return None
        content.maps.pictures[name, 0, 0] = encode_picture(texels, True)
    return *content.add_picture((name, 0, 0))[:2], 3


def _interaction(scene: Scene, inputs: FrameInputs) -> Json:
    """Return the camera, the lights that can be dragged, and the outline that shadow maps are fitted to."""
    camera, settings = scene.camera, inputs.settings
    projection, outline = pinhole(camera, scene.head, settings), scene.head.mesh.outline
    return {
        "centre": [*floats(scene.head.centre_mm)],
        "camera": {
            "position": list(camera.position),
            "target": list(camera.target),
            "up": list(camera.up),
            "half": list(projection.window.half),
            "shift": list(projection.window.shift),
        },
        "samples": inputs.camera_views.places.tolist(),
        "outline": np.asarray(outline.points_mm, np.float32).round(3).ravel().tolist(),
        "slack": outline.margin_mm,
        "middle": list(outline.centre_mm),
        "shadow_size": settings.shadow_size,
        "lights": [_movable_light(light) for light in scene.lights],
    }


def _movable_light(light: Light) -> Json | None:
    """Return a light that has a position and one shadow map; None for others, which cannot be moved."""
    if not isinstance(light, SpotLight) or not light.shadows:
        return None
    return {"position": list(light.position), "target": list(light.target), "softness": light.softness_mm}
