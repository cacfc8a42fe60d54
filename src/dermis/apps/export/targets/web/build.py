"""Capture of the frames that the web page replays, in several sizes, for GPUs and software adapters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.target import flat_tuple
from dermis.apps.export.targets.web.frame_json import Json, NamedFrame, PictureMap, PictureMaps, frames_json
from dermis.apps.export.targets.web.maps import (
    MapLayerKey,
    MapPictures,
    encode_map_layer,
    quantise_hairs,
    read_texels,
)
from dermis.apps.export.targets.web.packing import ByteRunCollector
from dermis.apps.export.targets.web.sliders import Slider, slider_frame_changes, slider_frame_inputs
from dermis.frame.capture import ADAPTER_KINDS, capture_frame, capture_renderer, reduce_hair
from dermis.frame.features.shading.view import world_space_pinhole
from dermis.frame.inputs import FrameInputs
from dermis.frame.renderer import Renderer
from dermis.gpu.capture import FrameCapture
from dermis.scene.lights import Light, SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

OnFramesCaptured = Callable[[Renderer, Scene, Settings], None]
PAGE_TECHNIQUES = ("texture-space", "none")
PICTURE_SIDES = {"gpu": (512, 1024, 1600), "software": (512,)}
"""Sides of the square pictures for each kind of adapter [pixel]."""
INTERACTIVE_QUALITY = {"software": (256, 1, 2)}
"""Side [pixel], samples per pixel and number of hairs drawn as one during interaction, by kind of adapter."""


@dataclass
class PageContent:
    """Data that the web page embeds: frames, buffers, maps and the poster.

    frames_by_kind : JSON of the captured frames for each kind of adapter, "gpu" or "software"
    byte_runs : compressed data of buffers and textures
    maps : maps of the head, encoded as one WebP image for each layer of a mip level
    pictures : contents of the WebP files, in the order in which the page stores the files
    picture_entries : dictionary from the role, mip level and layer of a map to three integers: the index of
        the WebP file in `pictures`, the index in `byte_runs` of the curves that decode the channels, and the
        number of colour channels
    poster : (h, w, 3) sRGB picture that the page shows until it renders
    """

    frames_by_kind: dict[str, Json] = field(default_factory=dict)
    byte_runs: ByteRunCollector = field(default_factory=ByteRunCollector)
    maps: MapPictures = field(default_factory=MapPictures)
    pictures: list[bytes] = field(default_factory=list)
    picture_entries: dict[MapLayerKey, tuple[int, int, int]] = field(default_factory=dict)
    poster: NDArray[np.uint8] | None = None

    def add_picture(self, picture_key: MapLayerKey) -> tuple[int, int, int]:
        """Add the WebP file of one layer of a map, unless present; return its entry in `picture_entries`.

        picture_key : role, mip level and layer of the map
        """
        if picture_key not in self.picture_entries:
            picture = self.maps.pictures[picture_key]
            curves = self.byte_runs.add(np.ascontiguousarray(picture.curves).view(np.uint8).reshape(-1))
            self.picture_entries[picture_key] = (
                len(self.pictures),
                curves,
                3 if picture_key[0] == "colour_map" else 0,
            )
            self.pictures.append(picture.data)
        return self.picture_entries[picture_key]


@dataclass(frozen=True)
class PageRequest:
    """Scene, sliders and settings for which the frames of the page are captured.

    settings : settings of all frames, except the size and the technique, which differ between frames
    sizes : dictionary from kind of adapter to the sides of the square pictures [pixel], see `PICTURE_SIDES`;
        the page does not run on kinds of adapter that are not in it
    adapter : adapter on which the frames are captured
    interactive : dictionary from kind of adapter to the quality while the user drags a control, see
        `INTERACTIVE_QUALITY`; a kind that is absent keeps full quality
    """

    scene: Scene
    sliders: tuple[Slider, ...]
    settings: Settings
    sizes: dict[str, tuple[int, ...]]
    adapter: str = "auto"
    interactive: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def frame_settings(self, adapter_kind: str) -> Iterator[tuple[Settings, int]]:
        """Yield the settings of each frame, and how many hairs are merged into one.

        At full quality, no hairs are merged, and the number is 0.

        adapter_kind : kind of adapter, "gpu" or "software"
        """
        for technique in PAGE_TECHNIQUES:
            for side in self.sizes[adapter_kind]:
                yield self.settings_for(side, technique), 0
            if adapter_kind in self.interactive:
                side, samples, merged_hairs = self.interactive[adapter_kind]
                yield self.settings_for(side, technique).model_copy(update={"samples": samples}), merged_hairs

    def settings_for(self, picture_side: int, technique: str = PAGE_TECHNIQUES[0]) -> Settings:
        """Return the settings of a frame with a given picture side and technique.

        Interreflection is disabled for the technique without diffusion, as it would add 0.6 MB to the page.

        picture_side : side of the square picture [pixel]
        """
        diffusion = {"technique": technique, "interreflection": technique == PAGE_TECHNIQUES[0]}
        return self.settings.model_copy(update={"size": (picture_side, picture_side), **diffusion})


def build_page_content(
    page_request: PageRequest, on_frames_captured: OnFramesCaptured = lambda *_: None
) -> PageContent:
    """Capture the frames for every requested kind of adapter, and return the data that the page embeds.

    on_frames_captured : function called after the frames for a kind of adapter were captured, with the
        arguments renderer, scene and settings. The textures of the renderer then hold the maps as the page
        decodes them
    """
    content = PageContent()
    for adapter_kind in (one for one in ADAPTER_KINDS if page_request.sizes.get(one)):
        renderer = capture_renderer(adapter_kind, page_request.adapter)
        content.frames_by_kind[adapter_kind] = _capture_frames(content, renderer, page_request, adapter_kind)
        settings = page_request.settings_for(page_request.sizes[adapter_kind][0])
        on_frames_captured(renderer, page_request.scene, settings)
        if content.poster is None:
            content.poster = renderer.draw(page_request.scene, settings).srgb8()
    return content


def _capture_frames(
    page_content: PageContent, renderer: Renderer, page_request: PageRequest, adapter_kind: str
) -> Json:
    """Capture the frames for one kind of adapter, add their data to `page_content`, and return their JSON.

    adapter_kind : kind of adapter, "gpu" or "software"
    """
    capture, frames, slider_changes = FrameCapture(renderer.device), list[NamedFrame](), list[Json]()
    base: FrameInputs | None = None
    for settings, merged_hairs in page_request.frame_settings(adapter_kind):
        inputs = renderer.prepare(page_request.scene, settings)
        base, picture = base or inputs, inputs.resources.post.picture
        captured = reduce_hair(capture_frame(capture, inputs), merged_hairs)
        frames.append(NamedFrame(settings.technique, captured, picture, settings.size, merged_hairs))
        changes = _frame_changes(page_content.byte_runs, renderer, page_request, settings, inputs, frames[-1])
        slider_changes.append(changes)
    captured_frames = [frame.captured for frame in frames]
    picture_maps = page_content.maps.replace_textures(renderer, capture, captured_frames)
    steps = quantise_hairs(renderer, capture, captured_frames)
    kind_json = frames_json(capture, frames, picture_maps, steps, page_content.byte_runs)
    for frame_json, changes in zip(kind_json["frames"], slider_changes, strict=True):
        frame_json["dials"] = changes
    kind_json["maps"] = {str(index): _mip_entries(page_content, one) for index, one in picture_maps.items()}
    assert base is not None
    kind_json["hands"] = _interaction_json(page_request.scene, base)
    kind_json["colours"] = _colour_maps(page_content, renderer, page_request, picture_maps)
    return kind_json


def _frame_changes(
    byte_runs: ByteRunCollector,
    renderer: Renderer,
    page_request: PageRequest,
    settings: Settings,
    default_frame_inputs: FrameInputs,
    named_frame: NamedFrame,
) -> Json:
    """Return as JSON how the uniform and buffer data of a frame change when a slider is moved.

    For each slider, the JSON contains the changes at each value for which a frame is captured.

    byte_runs : collector to which the changes are added
    settings : render settings of the frame
    default_frame_inputs : inputs of the frame with all sliders at their default values
    named_frame : captured frame with all sliders at their default values
    """
    capture = FrameCapture(renderer.device)

    def slider_frame_json(frame_inputs: FrameInputs | None) -> Json | None:
        if frame_inputs is None:
            return None
        node = reduce_hair(capture_frame(capture, frame_inputs), named_frame.merged_hairs)
        return slider_frame_changes(named_frame.captured, node, byte_runs)

    return {
        slider.name: [
            *map(
                slider_frame_json,
                slider_frame_inputs(
                    slider, lambda one: renderer.prepare(one, settings), default_frame_inputs
                ),
            )
        ]
        for slider in page_request.sliders
    }


def _mip_entries(page_content: PageContent, picture_map: PictureMap) -> list[list[tuple[int, int, int]]]:
    """Return an entry of `PageContent.picture_entries` for each layer of each mip level of a map."""
    layers = 1 + max(layer for role, _, layer in page_content.maps.pictures if role == picture_map.role)
    return [
        [page_content.add_picture((picture_map.role, mip, k)) for k in range(layers)]
        for mip in range(picture_map.mips)
    ]


def _colour_maps(
    page_content: PageContent, renderer: Renderer, page_request: PageRequest, picture_maps: PictureMaps
) -> Json:
    """Return the JSON of the colour maps that replace the head's colour map when a slider is moved.

    The JSON contains the resource index of the head's colour map. For each slider that changes this map, it
    contains one entry of `PageContent.picture_entries` per captured value, or null if the map is unchanged at
    this value.
    """
    map_index = next((k for k, one in picture_maps.items() if one.role == "colour_map"), None)
    if map_index is None:
        return {}
    settings, entries = page_request.settings_for(min(map(min, page_request.sizes.values()))), {}
    for slider in (one for one in page_request.sliders if not one.changes_pose_only):
        scenes = enumerate(slider.scenes)
        nodes = [
            _colour_map_entry(page_content, renderer, one, settings, f"{slider.name} {k}")
            for k, one in scenes
        ]
        if any(nodes):
            entries[slider.name] = nodes
    return {"map": map_index, "dials": entries} if entries else {}


def _colour_map_entry(
    page_content: PageContent, renderer: Renderer, scene: Scene | None, settings: Settings, map_role: str
) -> tuple[int, int, int] | None:
    """Return the entry in `PageContent.picture_entries` of the colour map of a scene.

    The result is None if the colour map is the same as with all sliders at their default values.

    scene : scene at a captured value of a slider; None at the default value
    map_role : role under which the map is stored, such as "melanin 0"
    """
    if scene is None:
        return None
    if (map_role, 0, 0) not in page_content.maps.pictures:
        capture = FrameCapture(renderer.device)
        texture = renderer.prepare(scene, settings).bindings["colour_map"]
        texels = read_texels(capture, capture.index_of_resource(texture), 0)[0]
        if page_content.maps.matches_picture("colour_map", texels):
            return None
        page_content.maps.pictures[map_role, 0, 0] = encode_map_layer(texels, True)
    return *page_content.add_picture((map_role, 0, 0))[:2], 3


def _interaction_json(scene: Scene, frame_inputs: FrameInputs) -> Json:
    """Return the JSON that the page needs to move the camera and the lights.

    The JSON also contains the points of the head's outline, around which the page fits shadow maps.
    """
    camera, settings = scene.camera, frame_inputs.settings
    projection, outline = world_space_pinhole(camera, scene.head, settings), scene.head.mesh.outline
    return {
        "centre": [*flat_tuple(scene.head.centre_mm)],
        "camera": {
            "position": list(camera.position),
            "target": list(camera.target),
            "up": list(camera.up),
            "half": list(projection.image_rectangle.half),
            "shift": list(projection.image_rectangle.shift),
        },
        "samples": frame_inputs.camera_views.sample_positions.tolist(),
        "outline": np.asarray(outline.points_mm, np.float32).round(3).ravel().tolist(),
        "slack": outline.margin_mm,
        "middle": list(outline.centre_mm),
        "shadow_size": settings.shadow_size,
        "lights": [_movable_light_json(light) for light in scene.lights],
    }


def _movable_light_json(light: Light) -> Json | None:
    """Return the JSON of a spot light with shadows; None for other lights, which the user cannot drag."""
    if not isinstance(light, SpotLight) or not light.shadows:
        return None
    return {"position": list(light.position), "target": list(light.target), "softness": light.softness_mm}
