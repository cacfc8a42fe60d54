"""Captured frames of a scene for the web page, for two kinds of adapter and several picture sizes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.target import floats
from dermis.apps.export.targets.web.frame_json import Json, NamedFrame, PictureMap, PictureMaps, frames_json
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

OnRenderer = Callable[[Renderer, Scene, Settings], None]
TECHNIQUES = ("texture-space", "none")
PICTURE_SIDES = {"gpu": (512, 1024, 1600), "software": (512,)}
"""Sides of the square pictures for each kind of adapter [pixel]."""
INTERACTIVE_QUALITY = {"software": (256, 1, 2)}
"""Side [pixel], samples per pixel and merged hairs during interaction, by kind of adapter."""


@dataclass
class PageContent:
    """Content of the web page.

    forms : description of the frames for each kind of adapter, see `dermis.frame.capture.ADAPTER_KINDS`
    packer : bytes of buffers and textures
    maps : maps encoded as pictures
    pictures : WebP files, in the order of their numbers
    picture_entries : by role, mip level and layer: number of the picture, number of the byte run of its value
        curves, and number of its colour channels
    poster : picture shown until the page renders
    """

    forms: dict[str, Json] = field(default_factory=dict)
    packer: Packer = field(default_factory=Packer)
    maps: MapPictures = field(default_factory=MapPictures)
    pictures: list[bytes] = field(default_factory=list)
    picture_entries: dict[PictureKey, tuple[int, int, int]] = field(default_factory=dict)
    poster: NDArray[np.uint8] | None = None

    def add_picture(self, key: PictureKey) -> tuple[int, int, int]:
        """Add a picture and its curves unless present; return its entry of `picture_entries`."""
        if key not in self.picture_entries:
            picture = self.maps.pictures[key]
            curves = self.packer.add(np.ascontiguousarray(picture.curves).view(np.uint8).reshape(-1))
            self.picture_entries[key] = len(self.pictures), curves, 3 if key[0] == "colour_map" else 0
            self.pictures.append(picture.data)
        return self.picture_entries[key]


@dataclass(frozen=True)
class PageRequest:
    """Scene and settings from which the content of a page is built.

    settings : settings of all frames; size and technique are replaced
    sizes : sides of the pictures of each kind of adapter, see `PICTURE_SIDES`; without sizes, it is not
        supported
    interactive : quality during interaction by kind of adapter, see `INTERACTIVE_QUALITY`; full if absent
    """

    scene: Scene
    sliders: tuple[Slider, ...]
    settings: Settings
    sizes: dict[str, tuple[int, ...]]
    adapter: str = "auto"
    interactive: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def frames(self, form: str) -> Iterator[tuple[Settings, int]]:
        """Yield the settings of each frame, and how many hairs are merged into one (0 at full quality)."""
        for technique in TECHNIQUES:
            for side in self.sizes[form]:
                yield self.settings_for(side, technique), 0
            if form in self.interactive:
                side, samples, merged_hairs = self.interactive[form]
                yield self.settings_for(side, technique).model_copy(update={"samples": samples}), merged_hairs

    def settings_for(self, side: int, technique: str = TECHNIQUES[0]) -> Settings:
        """Return the settings of a frame; without diffusion it has no interreflection either.

        Links between surfaces for a second layout would add 0.6 MB to the page.
        """
        diffusion = {"technique": technique, "interreflection": technique == TECHNIQUES[0]}
        return self.settings.model_copy(update={"size": (side, side), **diffusion})


def build_content(request: PageRequest, on_renderer: OnRenderer = lambda *_: None) -> PageContent:
    """Return the content of the page.

    on_renderer : called with each kind's renderer, whose maps are by then those that the page decodes
    """
    content = PageContent()
    for form in (one for one in ADAPTER_KINDS if request.sizes.get(one)):
        renderer = capture_renderer(form, request.adapter)
        content.forms[form] = _build_form(content, renderer, request, form)
        settings = request.settings_for(request.sizes[form][0])
        on_renderer(renderer, request.scene, settings)
        if content.poster is None:
            content.poster = renderer.draw(request.scene, settings).srgb8()
    return content


def _build_form(content: PageContent, renderer: Renderer, request: PageRequest, form: str) -> Json:
    """Return the description of the frames for one kind of adapter."""
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
    form_json = frames_json(capture, frames, picture_maps, steps, content.packer)
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
    """Return the changes of a frame at the nodes of each slider."""
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
    """Return the picture entries of each mip level and layer of a map."""
    layers = 1 + max(layer for role, _, layer in content.maps.pictures if role == map_.role)
    return [[content.add_picture((map_.role, mip, k)) for k in range(layers)] for mip in range(map_.mips)]


def _colour_maps(content: PageContent, renderer: Renderer, request: PageRequest, maps: PictureMaps) -> Json:
    """Return the index of the colour map, and the pictures that replace it at sampled slider positions."""
    number = next((k for k, one in maps.items() if one.role == "colour_map"), None)
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
    """Return the picture entry of the colour map at a slider's node; None if it is unchanged."""
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
    """Return the camera, the lights that can be dragged, and the outline that shadow maps must enclose."""
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
        "samples": inputs.camera_views.sample_positions.tolist(),
        "outline": np.asarray(outline.points_mm, np.float32).round(3).ravel().tolist(),
        "slack": outline.margin_mm,
        "middle": list(outline.centre_mm),
        "shadow_size": settings.shadow_size,
        "lights": [_movable_light(light) for light in scene.lights],
    }


def _movable_light(light: Light) -> Json | None:
    """Return the description of a spot light with shadows; None for other lights, which cannot be dragged."""
    if not isinstance(light, SpotLight) or not light.shadows:
        return None
    return {"position": list(light.position), "target": list(light.target), "softness": light.softness_mm}
