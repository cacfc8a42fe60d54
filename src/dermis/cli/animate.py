"""`dermis animate`: a movie of a head that moves, and the times of its frames."""

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

from dermis.base.console import note, print_report, progress, working_on
from dermis.base.errors import refuse
from dermis.base.quantities import number
from dermis.cli.options import Adapter, OutputPath, Flag, Json, Options, Integer
from dermis.cli.output_options import AnimationOutput
from dermis.cli.scene_options import DEFAULTS, SceneOptions, assemble_scene, note_subdivision

if TYPE_CHECKING:
    from dermis.frame.renderer import Renderer
    from dermis.mesh.clip import Clip
    from dermis.mesh.head import Head
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings


@dataclass(frozen=True)
class _AnimatedScene:
    """Scene moved by a clip, with frame k at k / rate.

    first : number of the first frame
    """

    scene: Scene
    settings: Settings
    clip: Clip
    rate: Fraction
    first: int

    def scenes(self, numbers: Iterable[int]) -> Iterator[Scene]:
        """Yield the scene of each frame; what the clip does not move keeps the scene's own pose."""
        from dermis.mesh.pose import laid_over

        for frame in numbers:
            pose = self.clip.pose_at(float(frame / self.rate))
            yield replace(self.scene, pose=laid_over(pose, self.scene.pose))


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
    crf: Integer = None,
    anew: Flag = False,
    names: Flag = False,
    scene: SceneOptions = DEFAULTS,
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Draw a head that moves, as a movie (H.264 in MP4) or as numbered pictures.

    Numbered pictures that are there already are kept if they are whole and show the same; an interrupted
    command goes on where it was when it is given again. The other options are those of `dermis render`.

    Examples:

        dermis animate face.glb -o talk.mp4

        dermis animate face.glb --motion take.csv --fps 24 --size 1280x720 -o talk.mp4

        dermis animate scene.toml --motion take.csv --from 2 --to 4.5 -o frames/%05d.exr

        dermis animate face.glb --names

    Parameters
    ----------
    head:
        A mesh (.glb .gltf .obj .ply), a sample, or a scene (.toml).
    motion:
        What moves it: a .glb or .gltf with clips, a .csv of Live Link Face, a .jsonl of MediaPipe, or a
        sequence as face_%05d.obj [the head's own file].
    output:
        Movie (.mp4), or pictures such as frames/%05d.png or .exr, whose folder is made.
    clip:
        The clip of a glTF file that has several.
    fps:
        Frames a second, as 30, 23.976 or 24000/1001 [the motion's own rate, else 30].
    motion_fps:
        Frames a second of the motion itself, where its file does not tell: of a sequence [--fps, else 30], of
        a timecode.
    begin:
        Seconds of the motion at which to begin [0].
    end:
        Seconds before which to end [the motion's end].
    crf:
        Quality of a movie, from 0 (without loss) to 51 [18].
    anew:
        Draw numbered pictures again that are there.
    names:
        List the names of morph targets, bones and clips of the head, and draw nothing.
    as_json:
        Print one JSON object with the number of frames and the time they took.
    """
    if names:
        return _list_names(head, scene, as_json)
    started = time.perf_counter()
    span, target = parse_time_span(begin, end, fps, motion_fps), AnimationOutput(output, crf, anew)
    target.check(scene.settings.get("size", (2, 2)))
    moving = motion_file(head, motion)
    with working_on("loading"):
        described, settings = assemble_scene(head, scene)
        target.check(settings.size)
        moved = load_clip(head, described.head, moving, clip, scene.head, span)
        numbers, rate = span.frames(moved)
    if moved.note:
        note(f"note: {moved.note}")
    note_subdivision(head, scene, described.head)
    take = _AnimatedScene(described, settings, moved, rate, numbers[0])
    missing = target.missing(numbers, settings.size, _frame_digest(take, scene, head, moving))
    began = time.perf_counter()
    used = _draw(take, missing, target, adapter) if missing else None
    now = time.perf_counter()
    report = {
        "file": str(output),
        "adapter": used,
        "size": list(settings.size),
        "subdivide": described.head.levels,
        "fps": float(rate),
        "frames": len(numbers),
        "drawn": len(missing),
        "seconds": round(now - started, 3),
        "frames_per_s": round(len(missing) / (now - began), 3),
    }
    print_report(as_json, report, lambda: [_summary_line(report), *filter(None, [described.head.attribution])])
    return 0


def _draw(take: _AnimatedScene, numbers: Sequence[int], target: AnimationOutput, adapter: str) -> str:
    """Draw and write frames; return the adapter's name."""
    from dermis.frame.renderer import Renderer

    renderer, size = Renderer(adapter), take.settings.size
    options: Options = {**take.settings.model_dump(), "linear": target.linear}
    options["exposure"] = _exposure(take, renderer)
    options["alpha"] = target.numbered and take.settings.background == "none"
    writing, bar = target.writing(size, take.rate), progress("drawing frames")
    with writing as write, bar as report:
        pictures = renderer.render_many(take.scenes(numbers), **options)
        for done, (number, picture) in enumerate(zip(numbers, pictures, strict=True), 1):
            write(number, picture)
            report(done, len(numbers))
    return str(renderer.device.adapter.name)


def _exposure(take: _AnimatedScene, renderer: Renderer) -> float:
    """Return the exposure of all frames: the given one, or that metered at the first frame of the motion."""
    if take.settings.exposure != "auto":
        return take.settings.exposure
    (scene,) = take.scenes([take.first])
    found = renderer.draw(scene, take.settings, timed=False).exposure
    note(f"note: --exposure {found:.3g}, metered at the first frame")
    return found


def _frame_digest(take: _AnimatedScene, given: SceneOptions, *files: str) -> str:
    """Return a digest that two frames of one number share if they look the same.

    files : head and motion as they were typed; files count with their size and time
    """
    scene = take.scene
    named = [*files, scene.head.name, *map(str, given.head.values()), take.clip.name]
    metered_at = take.first if take.settings.exposure == "auto" else None
    seen = scene.lights, scene.camera, scene.skin, scene.environment, take.settings, take.rate, metered_at
    typed = given.head, given.eye, given.pose, given.bone, given.look_at
    parts = [*map(_file_state, named), *map(repr, typed), repr(seen), str(scene.head.levels)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _file_state(name: str) -> str:
    """Return a name, with size and time of the file where it is one."""
    path = Path(name.partition("#")[0])
    if not path.exists():
        return name
    state = path.stat()
    return f"{path.resolve()} {name} {state.st_size} {state.st_mtime_ns}"


def _summary_line(report: Options) -> str:
    count, drawn = report["frames"], report["drawn"]
    kept = f" ({count - drawn} were there)" if drawn < count else ""
    place = f" on {report['adapter']}" if report["adapter"] else ""
    frames = f"{count} frame{'s' * (count != 1)}"
    return f"{report['file']}  {frames}{kept} at {report['fps']:g}/s  {report['seconds']:.1f} s{place}"


def _list_names(name: str, given: SceneOptions, as_json: bool) -> int:
    with working_on("loading"):
        found = animatable_names(name, assemble_scene(name, given)[0].head)
    print_report(
        as_json, found, lambda: (f"{kind}: {', '.join(each) or 'none'}" for kind, each in found.items())
    )
    return 0


_DEFAULT_RATE = 30.0


@dataclass(frozen=True)
class TimeSpan:
    """Times between which frames are drawn, and their rate; None where an option was left out.

    begin, end : seconds of the motion
    own_rate : of the motion itself, where it does not tell [1/s]
    """

    begin: Fraction | None
    end: Fraction | None
    rate: Fraction | None
    own_rate: float | None

    def frames(self, clip: Clip) -> tuple[range, Fraction]:
        """Numbers of the frames, of which number k lies at k / rate, and the rate [1/s].

        Raises DermisError when the motion ends before the frames begin.
        """
        from dermis.images.movie import exact_rate

        rate = self.rate or exact_rate(clip.rate or _DEFAULT_RATE)
        first = math.ceil((self.begin or 0) * rate)
        count = clip.frame_count(float(rate))
        beyond = count if self.end is None else min(count, math.ceil(self.end * rate))
        if first >= count:
            came = f"{clip.name} lasts {clip.duration_s:.3f} s"
            refuse("--from", "a time at which there is motion", came, "Choose an earlier one")
        if first >= beyond:
            came = f"at {float(rate):g} frames a second there is none"
            refuse("--to", "at least one frame before it", came, "Choose a later time")
        return range(first, beyond), rate


def parse_time_span(begin: float | None, end: float | None, fps: str | None, own_rate: float | None) -> TimeSpan:
    """Return the span that was typed."""
    from dermis.images.movie import exact_rate
    from dermis.mesh.clip import LONGEST_S, check_rate

    for option, seconds in (("--from", begin), ("--to", end)):
        if seconds is not None:
            number(option, seconds, 0.0, LONGEST_S, "s")
    if end is not None and end <= (begin or 0):
        refuse("--to", f"a time after --from ({begin or 0:g} s)", f"{end:g} s came", "Correct one of them")
    if own_rate is not None:
        check_rate("--motion-fps", own_rate)
    # as written: the float nearest to 0.1 lies after frame 3 of 30
    exact = [None if seconds is None else Fraction(str(seconds)) for seconds in (begin, end)]
    return TimeSpan(exact[0], exact[1], None if fps is None else exact_rate(fps, "--fps"), own_rate)


def motion_file(name: str, motion: str | None) -> str:
    """Return the motion's file as named, else the head's own file where that can hold clips."""
    from dermis.formats.parts import is_gltf

    if motion is not None:
        return motion
    own = str(_table(name).get("name", name))
    if not is_gltf(own):
        remedy = "Add --motion with a .glb, .csv or .jsonl, or a sequence of .obj"
        refuse("--motion", "a file", f"none came, and {own} has no clips of its own", remedy)
    return own


def load_clip(name: str, head: Head, motion: str, clip: str | None, given: Options, span: TimeSpan) -> Clip:
    """Return the motion of a file for a head.

    name : of the head as it was typed
    given : fields of its [head] that were typed, of which unit_mm and up hold for a sequence too
    """
    from dermis.formats.motion.sequence import is_sequence
    from dermis.scene.motion import load_motion

    rate = span.own_rate
    if rate is None and span.rate and is_sequence(Path(motion)):  # a file for each frame
        rate = float(span.rate)
    table = {key: value for key, value in {**_table(name), **given}.items() if key in ("unit_mm", "up")}
    return load_motion(motion, head, clip=clip, fps=rate, **table)


def animatable_names(name: str, head: Head) -> dict[str, tuple[str, ...]]:
    """Return names of the head's morph targets and bones, and of the clips in its file."""
    from dermis.formats.gltf.animations import clip_names
    from dermis.formats.parts import is_gltf

    own = Path(str(_table(name).get("name", name)))
    clips = clip_names(own) if is_gltf(own) else ()
    return {"targets": head.targets, "bones": head.bones, "clips": clips}


def _table(name: str) -> Options:
    """Return the [head] table of a scene's file; empty for other heads."""
    from dermis.scene.files import head_table

    return head_table(Path(name)) if Path(name).suffix.lower() == ".toml" else {}
