"""Sections of the panel for lights, motion, head, view, settings, files and timing."""

from __future__ import annotations

import colorsys
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from imgui_bundle import imgui, implot
from numpy.typing import NDArray

from dermis.apps.viewer import posing
from dermis.apps.viewer.controls import PRESET_NAMES
from dermis.apps.viewer.panel.fields import (
    LIGHT_KIND_NAMES,
    LIGHT_STYLES,
    SURFACE_STYLES,
    TECHNIQUE_STYLES,
    FieldStyle,
    apply_edited_value,
    begin_plot,
    choose_name,
    clamp_to_range,
    draw_button,
    draw_combo,
    draw_fields,
    draw_rows,
    draw_slider,
    draw_tooltip,
    record_position,
    run_action,
)
from dermis.apps.viewer.panel.living import draw_skin_states, has_living_skin
from dermis.apps.viewer.panel.skin import draw_profile, draw_surface
from dermis.apps.viewer.session import Session, built_in_heads
from dermis.apps.viewer.state import ATLAS_VIEW_NAME, ViewerState, validated_copy
from dermis.apps.viewer.views import ATLAS_LAYERS, VIEW_NAMES
from dermis.formats.samples import SAMPLES
from dermis.scene.environment import Environment
from dermis.scene.frozen_model import SliderRange, field_choices, fields_under
from dermis.scene.heads import BARE, DRESSED, HUMAN
from dermis.scene.lights import LIGHTS, Light, SpotLight, light_presets
from dermis.scene.talk_comparisons import COMPARISONS_HEADING

_CUSTOM_CHOICE = "custom"
_NO_ENVIRONMENT = "none"
_EXPOSURE_STOP_RANGE = SliderRange(-6.0, 4.0)
_NEW_LIGHT_POSITION_MM = (-500.0, 400.0, 800.0)  # position of a new light, at the upper left of the portrait
_MIN_CONE_DIFFERENCE_DEGREES = 0.5  # least difference of the cones of a spotlight
_ENVIRONMENT_STYLES = {"exposure": FieldStyle("brightness")}
_TARGET_WEIGHT_RANGE, _BONE_ANGLE_RANGE = SliderRange(0.0, 1.0), SliderRange(-60.0, 60.0)
_MAX_STAGE_LABEL_LENGTH = 16  # characters that fit into a narrow panel
Floats = NDArray[np.float64]
_WHOLE_FRAME_LABEL = "total"
_STAGE_HUE_STEP = 0.618034  # golden ratio of the hue circle, so that colours of neighbouring stages differ
_PERSON_SEED_COUNT = 10_000
_ON_ENTER_FLAG = int(imgui.InputTextFlags_.enter_returns_true)
_PRESET_BUTTONS_PER_ROW = 3
_MAP_SIDES = (256, 512, 1024, 2048, 4096)
_SETTING_STYLES = {
    **TECHNIQUE_STYLES,
    "atlas": FieldStyle(options=_MAP_SIDES),
    "shadow_size": FieldStyle("shadow map", options=_MAP_SIDES),
    "samples": FieldStyle(options=(1, 2, 4, 8, 16)),
    "exposure": FieldStyle(custom_value=lambda session: session.view_renderer.exposure),
    "background": FieldStyle(custom_value=lambda session: (0.2, 0.2, 0.2)),
}
_PICTURE_SETTINGS = ("exposure", "tone", "bloom", "background", "background_blur")
_SETTINGS_SET_ELSEWHERE = ("size", "parts")  # determined by the window and by the view


def draw_lights(session: Session) -> None:
    """Draw the controls of the light preset, the selected light and the environment."""
    draw_combo(
        session,
        "rig",
        session.state.light_preset or _CUSTOM_CHOICE,
        light_presets(),
        session.state.with_light_preset,
    )
    _draw_light_selector(session)
    draw_combo(
        session, "add", "a light", LIGHTS, lambda kind: _with_new_light(session, kind), LIGHT_KIND_NAMES
    )
    lights, index = session.state.scene.lights, session.controls.light
    if index < len(lights):
        _draw_light(session, index, lights[index])
    _draw_environment(session)


def _with_new_light(session: Session, light_kind: str) -> ViewerState:
    """Return the state with a new light of the given kind, and select that light."""
    values: dict[str, Any] = {
        "position": _NEW_LIGHT_POSITION_MM,
        "direction": tuple(-x for x in _NEW_LIGHT_POSITION_MM),
    }
    fields = LIGHTS[light_kind].model_fields
    required = {name: values[name] for name in values.keys() & fields.keys() if fields[name].is_required()}
    lights = session.state.scene.lights
    state = session.state.with_lights([*lights, LIGHTS[light_kind](**required)])
    session.controls.light = len(lights)
    return state


def _draw_light_selector(session: Session) -> None:
    """Draw a radio button for each light, and another radio button for the environment."""
    lights, controls = session.state.scene.lights, session.controls
    for index, light in enumerate(lights):
        if imgui.radio_button(f"{index + 1}##{light.kind}", controls.light == index):
            controls.light = index
        imgui.same_line()
    if imgui.radio_button("environment##selected", controls.light >= len(lights)):
        controls.light = len(lights)


def _draw_light(session: Session, light_index: int, light: Light) -> None:
    """Draw controls for all fields of a light except the position, which the user changes with Shift-drag."""
    strength = max(*light.irradiance, 1e-6)

    def state_with_fields(**fields: object) -> ViewerState:
        return session.state.with_light(light_index, **fields)

    def state_with_exposure_stops(exposure_stops: float) -> ViewerState:
        factor = 2.0**exposure_stops * math.pi / strength
        return state_with_fields(irradiance=tuple(factor * c for c in light.irradiance))

    imgui.text_disabled(f"{LIGHT_KIND_NAMES.get(light.kind, light.kind)}, Shift and drag to move")
    draw_slider(
        session,
        "strength",
        math.log2(strength / math.pi),
        state_with_exposure_stops,
        _EXPOSURE_STOP_RANGE,
        "%.2f stops",
    )
    draw_fields(session, light, state_with_fields, LIGHT_STYLES | _cone_styles(light))
    if draw_button(session, "copy"):  # raises DermisError if there are too many lights
        lights = session.state.scene.lights
        run_action(session, lambda: session.change(session.state.with_lights([*lights, light])))
        session.controls.light = len(lights)
    imgui.same_line()
    if draw_button(session, "remove"):
        lights = session.state.scene.lights
        session.change(session.state.with_lights([*lights[:light_index], *lights[light_index + 1 :]]))
        session.controls.light = max(0, light_index - 1)


def _cone_styles(light: Light) -> dict[str, FieldStyle]:
    """Return slider ranges that keep the outer cone of a spotlight wider than its inner cone."""
    if not isinstance(light, SpotLight):
        return {}
    inner = SliderRange(0.5, light.outer_degrees - _MIN_CONE_DIFFERENCE_DEGREES)
    outer = SliderRange(light.inner_degrees + _MIN_CONE_DIFFERENCE_DEGREES, 88.0)
    return {
        "inner_degrees": FieldStyle("inner cone", inner),
        "outer_degrees": FieldStyle("outer cone", outer),
    }


def _draw_environment(session: Session) -> None:
    environment, with_environment = session.state.scene.environment, session.state.with_environment
    samples = [name for name, sample in SAMPLES.items() if sample.kind == "environment"]

    def state_with_environment(environment_name: str) -> ViewerState:
        return with_environment(
            None if environment_name == _NO_ENVIRONMENT else Environment(name=environment_name)
        )

    def state_with_fields(**fields: object) -> ViewerState:
        assert environment is not None
        return with_environment(validated_copy(environment, **fields))

    names = (_NO_ENVIRONMENT, "uniform", *samples)
    draw_combo(
        session,
        "environment",
        environment.name if environment else _NO_ENVIRONMENT,
        names,
        state_with_environment,
    )
    if environment:
        draw_fields(session, environment, state_with_fields, _ENVIRONMENT_STYLES)


def has_pose_controls(session: Session) -> bool:
    """Return whether the head has morph targets or bones, each of which gets a slider."""
    head = session.state.scene.head
    return bool(head.targets or head.bones)


def has_motion_controls(session: Session) -> bool:
    """Return whether a motion is loaded, or the head has morph targets or bones."""
    return has_pose_controls(session) or session.player.has_motion


def draw_expressions(session: Session) -> None:
    """Draw sliders for the morph targets and bones whose names match the search."""
    head = session.state.scene.head
    flags = int(imgui.InputTextFlags_.escape_clears_all)
    _, session.search = imgui.input_text_with_hint("##search", "search", session.search, flags)
    record_position(session, "search")
    imgui.same_line()
    if draw_button(session, "rest"):
        session.player.stop()
        session.change(session.state.with_pose(posing.reset_pose(session.state.scene)))
    targets = posing.filter_names(head.targets, session.search)
    bones = posing.filter_names(head.bones, session.search)
    animated = _animated_names(session)
    if targets:
        draw_rows("targets", len(targets), lambda row: _draw_target_weight(session, targets[row], animated))
    if not (targets or bones):
        imgui.text_disabled("no name matches")
    if bones:
        is_open = imgui.tree_node_ex("bones", 0, f"bones, {len(bones)}")
        record_position(session, "bones")
        if is_open:
            imgui.text_disabled("nod, turn, tilt [degrees]")
            draw_rows("turns", len(bones), lambda row: _draw_bone_angles(session, bones[row], animated))
            imgui.tree_pop()


def draw_motion_controls(session: Session) -> None:
    """Draw the controls of the motion: its file, play and pause, and the time slider."""
    player, clip = session.player, session.player.clip
    _, session.motion_file = imgui.input_text("file", session.motion_file)
    if draw_button(session, "open"):
        run_action(session, lambda: session.open_motion(session.motion_file))
    if clip is not None:
        imgui.same_line()
        if draw_button(session, f"{'pause' if player.is_playing else 'play'}##motion"):
            player.toggle()
        imgui.same_line()
        _, player.loops = imgui.checkbox("loop", player.loops)
        record_position(session, "loop")
        time_range = SliderRange(0.0, max(clip.duration_s, 1e-3))
        number_format = f"%.2f of {clip.duration_s:.2f} s"
        draw_slider(session, "time", player.seconds, player.state_at, time_range, number_format)
    if player.note:
        imgui.text_wrapped(player.note)


def _animated_names(session: Session) -> frozenset[str]:
    """Return the names of morph targets and bones that the playing motion sets; their sliders are locked."""
    clip = session.player.clip if session.player.is_playing else None
    return frozenset() if clip is None else frozenset((*clip.targets, *clip.bones))


def _draw_target_weight(session: Session, target_name: str, animated_names: frozenset[str]) -> None:
    def state_with_value(weight: float) -> ViewerState:
        return session.state.with_pose(posing.with_target_weight(session.state.scene, target_name, weight))

    weight = posing.target_weight(session.player.displayed_state.scene, target_name)
    imgui.begin_disabled(target_name in animated_names)
    draw_slider(session, f"{target_name}##target", weight, state_with_value, _TARGET_WEIGHT_RANGE, "%.2f")
    imgui.end_disabled()
    if len(target_name) > _MAX_STAGE_LABEL_LENGTH:
        draw_tooltip(target_name)


def _draw_bone_angles(session: Session, bone_name: str, animated_names: frozenset[str]) -> None:
    """Draw a slider for each of the three angles of a bone; a drag changes only one of the angles.

    animated_names : names of the morph targets and bones that the playing motion sets
    """
    angles = posing.bone_angles(session.player.displayed_state.scene, bone_name)

    def state_with_value(new_angles: list[float]) -> ViewerState:
        axis = max(range(3), key=lambda k: abs(new_angles[k] - angles[k]))
        degrees = [*angles]
        degrees[axis] = clamp_to_range(new_angles[axis], _BONE_ANGLE_RANGE)
        x, y, z = degrees
        return session.state.with_pose(posing.with_bone_angles(session.state.scene, bone_name, (x, y, z)))

    imgui.begin_disabled(bone_name in animated_names)
    result = imgui.slider_float3(
        f"{bone_name}##bone", [*angles], _BONE_ANGLE_RANGE.low, _BONE_ANGLE_RANGE.high, "%.0f"
    )
    imgui.end_disabled()
    apply_edited_value(session, f"{bone_name}##bone", result, state_with_value)
    if len(bone_name) > _MAX_STAGE_LABEL_LENGTH:
        draw_tooltip(bone_name)


def draw_head_chooser(session: Session) -> None:
    """Draw the controls that choose a head: a list, the seed of a random person, and a file to open."""
    _draw_head_list(session)
    seed = _person_seed(session)
    is_entered, new_seed = imgui.input_int("person###seed", seed, flags=_ON_ENTER_FLAG)
    record_position(session, "seed")
    draw_tooltip("Seed of a random person; press Enter to show the person.")
    if is_entered:
        session.heads.open(_person_name(session, max(0, new_seed)))
    imgui.same_line()
    if draw_button(session, "dice"):
        session.heads.open(_person_name(session, random.randrange(_PERSON_SEED_COUNT)))
    draw_tooltip("Another random person.")
    if session.request_file is None:
        hint = "path of a file"
        is_path_entered, session.head_file = imgui.input_text_with_hint(
            "###path", hint, session.head_file, _ON_ENTER_FLAG
        )
        record_position(session, "path")
        draw_tooltip("A mesh (.glb .gltf .vrm .usdz .obj .ply .stl), a person (.json) or a scene (.toml).")
        imgui.same_line()
        if draw_button(session, "open###open file") or is_path_entered:
            session.heads.open(session.head_file)
    elif draw_button(session, "upload a file"):
        session.request_file()


def _draw_head_list(session: Session) -> None:
    """Draw the list of built-in heads and recent files."""
    current = str(session.state.head.get("name", session.state.scene.head.name))
    names = dict.fromkeys((*built_in_heads(), *session.heads.recent, current))
    display_names = {name: session.heads.display_name(name) for name in names}
    chosen = choose_name(session, "head", current, names, display_names)
    if chosen is not None:
        session.heads.open(chosen)


def _person_seed(session: Session) -> int:
    """Return the seed of the displayed random person; 0 if the head is not a random person."""
    seed = str(session.state.head.get("name", "")).removeprefix(f"{HUMAN}:").partition("?")[0]
    return int(seed) if seed.isdecimal() else 0


def _person_name(session: Session, seed: int) -> str:
    """Return the name of a random person who is dressed by chance, or bare like the displayed person."""
    is_bare = str(session.state.head.get("name", "")).endswith(f"?{BARE}")
    return f"{HUMAN}:{seed}?{BARE if is_bare else DRESSED}"


class Section(NamedTuple):
    """Collapsible section of the panel.

    title : displayed title
    draw : function that draws the controls of the section
    is_open : whether the section is open when the viewer starts
    applies : function that returns whether the section is shown for a session
    """

    title: str
    draw: Callable[[Session], None]
    is_open: bool = False
    applies: Callable[[Session], bool] = lambda session: True


def draw_view(session: Session) -> None:
    """Draw the list of views, such as the picture or the blurred irradiance, and the camera presets."""
    state = session.state
    draw_combo(session, "show", state.view, VIEW_NAMES, state.with_view)
    if state.view == ATLAS_VIEW_NAME:

        def state_with_atlas_layer(layer_name: str) -> ViewerState:
            return state.with_atlas_view(replace(state.atlas_view, layer=layer_name))

        draw_combo(session, "layer", state.atlas_view.layer, ATLAS_LAYERS, state_with_atlas_layer)
        imgui.text_disabled("wheel: zoom; double click: show all")
    for index, name in enumerate(PRESET_NAMES):
        if index % _PRESET_BUTTONS_PER_ROW:
            imgui.same_line()
        if draw_button(session, f"{name}##camera"):
            session.controls.set_camera_preset(name)


def draw_comparison(session: Session) -> None:
    """Draw the buttons that freeze the state for a before/after comparison, swap its sides, and end it."""
    split, state = session.split, session.state
    if draw_button(session, "freeze"):
        split.freeze(session.displayed_state)
    if split.frozen_state is None:
        return
    imgui.same_line()
    if draw_button(session, "swap"):
        displayed = session.displayed_state
        session.player.stop()
        session.change(split.frozen_state.with_camera(state.scene.camera))
        split.freeze(displayed)
    imgui.same_line()
    if draw_button(session, "release"):
        split.release()


def draw_technique_settings(session: Session) -> None:
    """Draw controls for the settings that no other section shows, drop-down lists first.

    A new field of `Settings` appears in this section unless another section shows it.
    """
    settings = session.state.settings
    kind, excluded = type(settings), {*_PICTURE_SETTINGS, *_SETTINGS_SET_ELSEWHERE}
    names = sorted(
        (name for name in fields_under("", kind) if name not in excluded),
        key=lambda name: not field_choices(kind, name),
    )
    draw_fields(session, settings, session.state.with_settings, _SETTING_STYLES, names)


def draw_picture_settings(session: Session) -> None:
    """Draw controls for the conversion of radiance to the picture: exposure, tone curve, bloom, ..."""
    draw_fields(
        session, session.state.settings, session.state.with_settings, _SETTING_STYLES, _PICTURE_SETTINGS
    )


def draw_historical_comparisons(session: Session) -> None:
    """Draw the controls that switch on older methods and rendering faults, for comparison.

    Source: [dEonLuebke2007].
    """
    state, skin, settings = session.state, session.state.scene.skin, session.state.settings
    draw_fields(session, skin, state.with_skin, SURFACE_STYLES, fields_under(COMPARISONS_HEADING, type(skin)))
    names = fields_under(COMPARISONS_HEADING, type(settings))
    if settings.seams != "clear-colour":
        names.remove("seam_colour")
    draw_fields(session, settings, state.with_settings, _SETTING_STYLES, names)


def draw_file_controls(session: Session) -> None:
    """Draw the controls that save and load the scene, and that write screenshots."""
    _, session.scene_file = imgui.input_text("scene", session.scene_file)
    if draw_button(session, "save"):
        run_action(session, lambda: session.save(Path(session.scene_file)))
    imgui.same_line()
    if draw_button(session, "load"):
        run_action(session, lambda: session.load(Path(session.scene_file)))
    _, session.picture_file = imgui.input_text("picture", session.picture_file)
    size = session.picture_size if any(session.picture_size) else session.view_size
    is_changed, sides = imgui.input_int2("size", list(size))
    record_position(session, "size")
    if is_changed:
        session.picture_size = max(1, sides[0]), max(1, sides[1])
    if draw_button(session, "screenshot"):
        run_action(session, lambda: session.screenshot(Path(session.picture_file), size))
    if any(session.picture_size):
        imgui.same_line()
        if draw_button(session, "size of the view"):
            session.picture_size = 0, 0


def plot_stage_times(session: Session) -> None:
    """Plot the device time of each rendering stage in the last frames, and list the last frame's times."""
    series = stage_times_by_name(list(session.view_renderer.stage_times))
    if not series:
        imgui.text_disabled("this adapter reports no times")
        return
    total = np.sum(list(series.values()), axis=0)
    colours = [colorsys.hls_to_rgb((_STAGE_HUE_STEP * k) % 1.0, 0.6, 0.5) for k in range(len(series))]
    _plot_stacked_areas(series, colours, total)
    for (name, values), colour in zip(series.items(), colours, strict=True):
        imgui.text_colored(imgui.ImVec4(*colour, 1.0), f"{values[-1]:8.2f} ms")
        imgui.same_line()
        imgui.text(f"{name}, mean {values.mean():.2f}")
    imgui.text(f"{total[-1]:8.2f} ms in total, mean of {len(total)} frames {total.mean():.2f}")


def stage_times_by_name(frame_times_ms: Sequence[dict[str, float]]) -> dict[str, Floats]:
    """Return the times (n,) of each stage in n frames, by stage name [ms].

    The time is 0 in frames without the stage.

    frame_times_ms : times of the stages of each frame, by stage name [ms]
    """
    names = dict.fromkeys(name for frame in frame_times_ms for name in frame if name != _WHOLE_FRAME_LABEL)
    return {name: np.array([frame.get(name, 0.0) for frame in frame_times_ms], np.float64) for name in names}


def _plot_stacked_areas(
    stage_times_ms: dict[str, Floats],
    stage_colours: Sequence[tuple[float, float, float]],
    total_frame_times_ms: Floats,
) -> None:
    """Plot the times of stages over the frames as stacked areas, with the last frame at the right edge.

    stage_times_ms : (n,) times of each stage, by stage name [ms]
    stage_colours : colour of each stage
    total_frame_times_ms : (n,) total times of the frames [ms]
    """
    last = max(1.0, len(total_frame_times_ms) - 1.0)
    if not begin_plot("stages", ("frames", "ms"), (0.0, last), max(float(total_frame_times_ms.max()), 1e-3)):
        return
    x, below = np.arange(len(total_frame_times_ms), dtype=np.float64), np.zeros(len(total_frame_times_ms))
    for (name, values), colour in zip(stage_times_ms.items(), stage_colours, strict=True):
        spec = implot.Spec()
        spec.fill_color = imgui.ImVec4(*colour, 1.0)
        implot.plot_shaded(name, x, below, below + values, spec)
        below = below + values
    implot.end_plot()


SECTIONS = (
    Section("Head", draw_head_chooser, is_open=True),
    Section("View", draw_view, is_open=True),
    Section("Before and after", draw_comparison),
    Section("Expressions", draw_expressions, is_open=True, applies=has_pose_controls),
    Section("Motion", draw_motion_controls, is_open=True, applies=has_motion_controls),
    Section("Profile", draw_profile, is_open=True),
    Section("Surface", draw_surface, is_open=True),
    Section("Skin state", draw_skin_states, applies=has_living_skin),
    Section("Light", draw_lights),
    Section("Technique", draw_technique_settings),
    Section("Picture", draw_picture_settings),
    Section("Timing", plot_stage_times),
    Section("Scene", draw_file_controls, is_open=True),
    Section(COMPARISONS_HEADING, draw_historical_comparisons),
)
