"""The command `dermis animate`: movies and image sequences of a moving head."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import print_note, print_report, progress_bar, spinner
from dermis.base.errors import refuse
from dermis.base.quantities import checked_number
from dermis.cli.living_options import PulseOptions, parse_pulse, parse_states
from dermis.cli.options import (
    NO_OPTIONS,
    AdapterOption,
    FlagOption,
    IntegerOption,
    JsonOption,
    Options,
    OutputPath,
)
from dermis.cli.output_options import AnimationOutput
from dermis.cli.pulse_record import check_pulse_record, pulse_report, write_pulse_record
from dermis.cli.scene_options import (
    DEFAULT_SCENE_OPTIONS,
    SceneOptions,
    assemble_scene,
    note_subdivision,
    shrink_atlas_on_cpu,
)

if TYPE_CHECKING:
    from dermis.frame.hair_motion import HairMotion
    from dermis.frame.renderer import Renderer
    from dermis.mesh.clip import Clip
    from dermis.mesh.head import Head
    from dermis.scene.living import StateEvent
    from dermis.scene.model import Scene
    from dermis.scene.pulse import Pulse
    from dermis.scene.settings import Settings


@dataclass(frozen=True)
class _AnimatedScene:
    """Scene whose head is moved by a clip; frame k shows the clip at time k / rate.

    scene : scene without the motion
    settings : settings of all frames
    clip : motion of the head
    rate : frame rate of the animation [1/s]
    first : number of the first frame, at which automatic exposure is metered and hair is at rest
    hair_motion : whether to simulate the swing of long hair
    pulse : pulse of the skin; None for skin without a pulse
    states : events that change the skin over time; other states are those of `scene`
    """

    scene: Scene
    settings: Settings
    clip: Clip
    rate: Fraction
    first: int
    hair_motion: bool = True
    pulse: Pulse | None = None
    states: tuple[StateEvent, ...] = ()

    def scenes(self, frame_numbers: Iterable[int]) -> Iterator[Scene]:
        """Yield the scene at each frame; morph targets and bones not in the clip keep the pose of `scene`.

        frame_numbers : numbers of the frames to yield
        """
        from dermis.mesh.pose import merge_poses
        from dermis.scene.living import state_at

        for frame in frame_numbers:
            seconds = float(frame / self.rate)
            scene = replace(self.scene, pose=merge_poses(self.clip.pose_at(seconds), self.scene.pose))
            if self.states:
                scene = replace(scene, state=state_at(self.states, seconds, scene.state))
            yield self.pulse.scene_at(scene, seconds) if self.pulse else scene


def animate(
    head: str,
    /,
    *,
    motion: str | None = None,
    output: OutputPath = Path("dermis.mp4"),
    clip: str | None = None,
    fps: str | None = None,
    motion_fps: float | None = None,
    begin: Annotated[float | None, Parameter(name="--from")] = None,
    end: Annotated[float | None, Parameter(name="--to")] = None,
    crf: IntegerOption = None,
    overwrite: Annotated[
        bool, Parameter(name=("--overwrite", "--anew"), negative="", show_default=False)
    ] = False,
    names: FlagOption = False,
    hair_motion: bool = True,
    pulse: str | None = None,
    pulse_options: PulseOptions = NO_OPTIONS,
    pulse_record: Path | None = None,
    scene: SceneOptions = DEFAULT_SCENE_OPTIONS,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Render a moving head as a movie (H.264 in MP4) or as numbered images.

    An interrupted command can be continued by repeating it: existing numbered images are kept if they are
    complete and show the same scene. All other options are those of `dermis render`.

    Examples:

        dermis animate face.glb -o talk.mp4

        dermis animate face.glb --motion take.csv --fps 24 --size 1280x720 -o talk.mp4

        dermis animate scene.toml --motion take.csv --from 2 --to 4.5 -o frames/%05d.exr

        dermis animate face.glb --names

        dermis animate human:7 --pulse 72 --to 20 --crf 0 --pulse-record pulse.csv -o pulse.mp4

        dermis animate human --state blush=0.8@1-6 --to 10 -o blush.mp4

    Parameters
    ----------
    head:
        Mesh (.glb .gltf .vrm .usdz .obj .ply .stl), sample name or scene (.toml).
    motion:
        File with the motion: .glb or .gltf with clips, .csv of Live Link Face, .json of MediaPipe, or a
        sequence of meshes such as face_%05d.obj. [default: the file of the head; with --pulse or --state, a
        head at rest until --to, or for 10 s]
    output:
        Movie (.mp4), or numbered images (.png or .exr), such as frames/%05d.png; the folder of images is
        created if necessary.
    clip:
        Name of the clip, for glTF files with several clips.
    fps:
        Frame rate of the output, such as 30, 23.976 or 24000/1001 [1/s]. [default: rate of the motion, or 30]
    motion_fps:
        Frame rate of a mesh sequence [default: --fps, or 30], or of a motion file that has no times or only
        timecodes [1/s].
    begin:
        Start time within the motion [s]. [default: 0]
    end:
        End time within the motion; a frame at this time is not rendered [s]. [default: end of the motion]
    crf:
        Constant rate factor of the movie, 0 (best quality) to 51 (lowest quality). [default: 18]
    overwrite:
        Render all numbered images again, including those that exist.
    hair_motion:
        Simulate the swing of long hair, which is at rest in the first frame. Otherwise hair moves rigidly
        with the head, as it always does without --motion for motions by the pulse of at most 0.5 mm.
    pulse:
        Heartbeat of a person: a rate such as 72 [1/min], or a CSV file with the columns time [s] and value (a
        photoplethysmogram, in which higher values mean more blood). It changes the blood volume of the skin,
        and moves the head.
    pulse_record:
        CSV file to write with the true pulse at each frame: time [s], relative change of the blood volume
        without delay, and upward motion of the face [mm].
    names:
        List the morph targets, bones and clips of the head without rendering.
    as_json:
        Print one JSON object with the number of frames and the timings.
    """
    if names:
        return _print_animatable_names(head, scene, as_json)
    from dermis.gpu.adapters import select_adapters

    started = time.perf_counter()
    heartbeat = parse_pulse(pulse, pulse_options)
    events, scene = _split_states(scene)
    check_pulse_record(pulse_record, heartbeat)
    span, target = parse_time_span(begin, end, fps, motion_fps), AnimationOutput(output, crf, overwrite)
    target.check_writable(scene.settings.get("size", (2, 2)))
    is_still = motion is None and bool(heartbeat or events or scene.state) and not _has_own_motion(head)
    motion_path = "" if is_still else motion_file(head, motion)
    span = span.with_default_end(heartbeat) if is_still else span
    hair_motion = hair_motion and not (is_still and _is_almost_at_rest(heartbeat))
    with spinner("loading"):
        animated, settings = assemble_scene(head, scene)
        target.check_writable(settings.size)
        motion_clip = (
            _still_clip(span)
            if is_still
            else load_clip(head, animated.head, motion_path, clip, scene.head, span)
        )
        numbers, rate = span.frames(motion_clip)
    if motion_clip.note:
        print_note(f"note: {motion_clip.note}")
    note_subdivision(head, scene, animated.head)
    settings = shrink_atlas_on_cpu(animated, settings, select_adapters(adapter)[0][0].kind)
    animation = _AnimatedScene(
        animated, settings, motion_clip, rate, numbers[0], hair_motion, heartbeat, events
    )
    list(animation.scenes([numbers[0], numbers[-1]]))  # so that errors come before the frames are rendered
    missing = target.frames_to_render(
        numbers, settings.size, _frame_digest(animation, scene, head, motion_path)
    )
    draw_started = time.perf_counter()
    adapter_name = _render_frames(animation, missing, target, adapter) if missing else None
    now = time.perf_counter()
    if heartbeat and pulse_record:
        write_pulse_record(pulse_record, heartbeat, numbers, rate)
    report = {
        "file": str(output),
        "adapter": adapter_name,
        "size": list(settings.size),
        "subdivide": animated.head.levels,
        "fps": float(rate),
        "frames": len(numbers),
        "drawn": len(missing),
        "seconds": round(now - started, 3),
        "frames_per_s": round(len(missing) / (now - draw_started), 3),
        **({"pulse": pulse_report(heartbeat, numbers, rate)} if heartbeat else {}),
    }
    print_report(as_json, report, lambda: [_summary_line(report), *filter(None, [animated.head.attribution])])
    return 0


def _split_states(options: SceneOptions) -> tuple[tuple[StateEvent, ...], SceneOptions]:
    """Return the events of all states of --state that change over time, and options with the other states."""
    states = parse_states(options.state or ())
    changing = {event.name for event in states if not event.is_constant}
    constant = [f"{event.name}={event.weight!r}" for event in states if event.name not in changing]
    return tuple(event for event in states if event.name in changing), replace(options, state=constant)


def _is_almost_at_rest(pulse: Pulse | None) -> bool:
    """Return whether a head that only a pulse moves is so still that the swing of its hair cannot be seen."""
    return pulse is None or pulse.head_motion_mm <= _STIFF_HAIR_MOTION_MM


def _has_own_motion(head_or_scene: str) -> bool:
    """Return whether the head comes from a file of a format that can contain clips."""
    from dermis.formats.parts import is_gltf

    return is_gltf(str(_head_table(head_or_scene).get("name", head_or_scene)))


def _still_clip(time_span: TimeSpan) -> Clip:
    """Return a clip of a head that does not move."""
    from dermis.mesh.clip import Clip
    from dermis.mesh.pose import Pose

    return Clip("still", float(time_span.end or 0), None, (), (), (), lambda _: Pose())


def _render_frames(
    animated_scene: _AnimatedScene,
    frame_numbers: Sequence[int],
    animation_output: AnimationOutput,
    adapter: str,
) -> str:
    """Render and write the frames with the given numbers, and return the name of the adapter."""
    from dermis.frame.renderer import Renderer

    renderer, size = Renderer(adapter), animated_scene.settings.size
    options: Options = {**animated_scene.settings.model_dump(), "linear": animation_output.is_linear}
    options["exposure"] = _common_exposure(animated_scene, renderer)
    options["alpha"] = animation_output.is_numbered and animated_scene.settings.background == "none"
    writing, bar = animation_output.open_writer(size, animated_scene.rate), progress_bar("rendering frames")
    with writing as write, bar as report:
        motion = _hair_motion(animated_scene)
        scenes = _rendered_scenes(animated_scene, frame_numbers, motion)
        pictures = renderer.render_many(scenes, hair_motion=motion, **options)
        for done, (number, picture) in enumerate(zip(frame_numbers, pictures, strict=True), 1):
            write(number, picture)
            report(done, len(frame_numbers))
    return str(renderer.device.adapter.name)


def _hair_motion(animated_scene: _AnimatedScene) -> HairMotion | None:
    """Return the motion of hair, at rest in the first frame; None if no hair is to swing.

    Print a note if the frame rate is too high for the simulation.
    """
    from dermis.frame.hair_motion import MAX_FRAMES_PER_S, HairMotion

    if not animated_scene.hair_motion or animated_scene.scene.head.hair is None:
        return None
    if animated_scene.rate > MAX_FRAMES_PER_S:
        print_note(f"note: hair does not swing at more than {MAX_FRAMES_PER_S:g} frames a second")
        return None
    return HairMotion(float(animated_scene.rate))


def _rendered_scenes(
    animated_scene: _AnimatedScene, frame_numbers: Sequence[int], motion: HairMotion | None
) -> Iterator[Scene]:
    """Yield the scenes to render, and advance the motion of hair over the frames that are not rendered."""
    if motion is None:
        yield from animated_scene.scenes(frame_numbers)
        return
    rendered, every = set(frame_numbers), range(animated_scene.first, frame_numbers[-1] + 1)
    for number, scene in zip(every, animated_scene.scenes(every), strict=True):
        if number in rendered:
            yield scene
        else:
            motion.advance(scene)


def _common_exposure(animated_scene: _AnimatedScene, renderer: Renderer) -> float:
    """Return the exposure of all frames: --exposure, or by default the one metered on the first frame."""
    if not isinstance(animated_scene.settings.exposure, str):
        return animated_scene.settings.exposure
    (scene,) = animated_scene.scenes([animated_scene.first])
    exposure = renderer.draw(scene, animated_scene.settings, timed=False).exposure
    print_note(f"note: --exposure {exposure:.3g}, metered at the first frame")
    return exposure


def _frame_digest(animated_scene: _AnimatedScene, options: SceneOptions, *files: str) -> str:
    """Return a hash of everything that determines the frames; images from runs with an equal hash are reused.

    files : head and motion as named on the command line; of each file, size and modification time are hashed
    """
    scene = animated_scene.scene
    waveform = [animated_scene.pulse.waveform] if animated_scene.pulse else []
    names = [*files, *waveform, scene.head.name, *map(str, options.head.values()), animated_scene.clip.name]
    metered_at = animated_scene.first if isinstance(animated_scene.settings.exposure, str) else None
    scene_values = scene.lights, scene.camera, scene.skin, scene.environment
    frame_values = *scene_values, animated_scene.settings, animated_scene.rate, metered_at
    option_values = options.head, options.eye, options.pose, options.bone, options.look_at
    parts = [
        *map(_file_fingerprint, names),
        *map(repr, option_values),
        f"hair motion {animated_scene.hair_motion}",
        f"pulse {animated_scene.pulse} states {options.state} {animated_scene.states}",
        repr(frame_values),
        str(scene.head.levels),
    ]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _file_fingerprint(file_name: str) -> str:
    """Return the path, size and modification time of a file as text.

    If there is no file with this name, the name itself is returned.
    """
    path = Path(file_name.partition("#")[0])
    if not path.exists():
        return file_name
    state = path.stat()
    return f"{path.resolve()} {file_name} {state.st_size} {state.st_mtime_ns}"


def _summary_line(report: Options) -> str:
    count, drawn = report["frames"], report["drawn"]
    reused = f" ({count - drawn} reused)" if drawn < count else ""
    device = f" on {report['adapter']}" if report["adapter"] else ""
    frames = f"{count} frame{'s' * (count != 1)}"
    return f"{report['file']}  {frames}{reused} at {report['fps']:g}/s  {report['seconds']:.1f} s{device}"


def _print_animatable_names(head_or_scene: str, options: SceneOptions, as_json: bool) -> int:
    with spinner("loading"):
        names = animatable_names(head_or_scene, assemble_scene(head_or_scene, options)[0].head)
    lines = (f"{kind}: {', '.join(each) or 'none'}" for kind, each in names.items())
    print_report(as_json, names, lambda: lines)
    return 0


_DEFAULT_FRAME_RATE = 30.0
_STILL_SECONDS = 10
_STIFF_HAIR_MOTION_MM = 0.5  # largest motion of the head by the pulse at which hair does not swing


@dataclass(frozen=True)
class TimeSpan:
    """Time span and frame rate from the options of `dermis animate`; fields of omitted options are None.

    begin, end : first and last time within the motion [s]
    rate : frame rate of the rendered animation, from --fps [1/s]
    motion_rate : frame rate of mesh sequences, and of motion files that have no times or only timecodes, from
        --motion-fps [1/s]
    """

    begin: Fraction | None
    end: Fraction | None
    rate: Fraction | None
    motion_rate: float | None

    def with_default_end(self, pulse: Pulse | None) -> TimeSpan:
        """Return a time span that ends, if no end is given, 10 s after its begin or with a recorded pulse."""
        if self.end is not None:
            return self
        end = (self.begin or Fraction(0)) + _STILL_SECONDS
        duration_s = pulse.signal().duration_s if pulse else math.inf
        return replace(self, end=end if duration_s >= end else Fraction(duration_s))

    def frames(self, clip: Clip) -> tuple[range, Fraction]:
        """Return the frame numbers and the frame rate [1/s] for a clip; frame k is at time k / rate.

        Raises DermisError if the motion ends before the time span begins.
        """
        from dermis.images.movie import parse_frame_rate

        rate = self.rate or parse_frame_rate(clip.rate or _DEFAULT_FRAME_RATE)
        first = math.ceil((self.begin or 0) * rate)
        count = clip.frame_count(float(rate))
        stop = count if self.end is None else min(count, math.ceil(self.end * rate))
        if first >= count:
            actual = f"{clip.name} lasts {clip.duration_s:.3f} s"
            refuse("--from", "a time before the end of the motion", actual, "Choose an earlier time")
        if first >= stop:
            actual = f"there is none at {float(rate):g} frames per second"
            refuse("--to", "at least one frame before it", actual, "Choose a later time")
        return range(first, stop), rate


def parse_time_span(
    begin: float | None, end: float | None, fps: str | None, motion_rate: float | None
) -> TimeSpan:
    """Return the time span and frame rates of the options --from, --to, --fps and --motion-fps.

    Raises DermisError for invalid values.
    """
    from dermis.images.movie import parse_frame_rate
    from dermis.mesh.clip import MAX_DURATION_S, check_frame_rate

    for option, seconds in (("--from", begin), ("--to", end)):
        if seconds is not None:
            checked_number(option, seconds, 0.0, MAX_DURATION_S, "s")
    if end is not None and end <= (begin or 0):
        refuse("--to", f"a time after --from ({begin or 0:g} s)", f"got {end:g} s", "Correct one of them")
    if motion_rate is not None:
        check_frame_rate("--motion-fps", motion_rate)
    # exact decimal values: the float nearest to 0.1 is after frame 3 at 30 frames per second
    start, stop = (None if seconds is None else Fraction(str(seconds)) for seconds in (begin, end))
    return TimeSpan(start, stop, None if fps is None else parse_frame_rate(fps, "--fps"), motion_rate)


def motion_file(head_or_scene: str, motion: str | None) -> str:
    """Return the name of the motion file: the value of --motion, or else the head's file, which must be glTF.

    head_or_scene : head or scene file as named on the command line

    Raises DermisError if --motion is missing and the head's file is not glTF.
    """
    from dermis.formats.parts import is_gltf

    if motion is not None:
        return motion
    own_file = str(_head_table(head_or_scene).get("name", head_or_scene))
    if not is_gltf(own_file):
        advice = "Add --motion with a .glb, .csv or .json file, or a sequence of .obj files"
        refuse("--motion", "a file", f"it is missing, and {own_file} cannot contain clips", advice)
    return own_file


def load_clip(
    head_or_scene: str, head: Head, motion: str, clip: str | None, head_options: Options, time_span: TimeSpan
) -> Clip:
    """Load the clip that animates a head from a motion file.

    head_or_scene : head or scene file as named on the command line
    motion : motion file
    clip : name of a clip in the motion file; None for the only clip
    head_options : options of the head; `unit_mm`, `up` and `front` also apply to mesh sequences
    time_span : time span; only the frame rates are used
    """
    from dermis.formats.motion.sequence import is_sequence
    from dermis.scene.motion import load_motion

    rate = time_span.motion_rate
    if rate is None and time_span.rate and is_sequence(Path(motion)):  # one file per frame
        rate = float(time_span.rate)
    fields = {**_head_table(head_or_scene), **head_options}
    units = {key: fields[key] for key in ("unit_mm", "up", "front") if key in fields}
    return load_motion(motion, head, clip=clip, fps=rate, **units)


def animatable_names(head_or_scene: str, head: Head) -> dict[str, tuple[str, ...]]:
    """Return the names of the morph targets, the bones, and the clips in the head's file, by kind."""
    from dermis.formats.gltf.animations import clip_names
    from dermis.formats.parts import is_gltf

    own_file = Path(str(_head_table(head_or_scene).get("name", head_or_scene)))
    clips = clip_names(own_file) if is_gltf(own_file) else ()
    return {"targets": head.targets, "bones": head.bones, "clips": clips}


def _head_table(head_or_scene: str) -> Options:
    """Return the [head] table of a scene file, or an empty table if the argument is not a scene file."""
    from dermis.scene.files import head_table

    return head_table(Path(head_or_scene)) if Path(head_or_scene).suffix.lower() == ".toml" else {}
