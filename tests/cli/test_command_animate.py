"""`dermis animate` with a small head: frame times, reuse of frames, and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from moving_head import CAPTURE, write_moving_head

import dermis
from dermis.images.io import read_image
from dermis.mesh.pose import merge_poses

Run = Callable[..., Any]
SMALL = ("--size", "32x32", "--atlas", "64", "--samples", "1", "--shadow-size", "64")
KEYS = ["file", "adapter", "size", "subdivide", "fps", "frames", "drawn", "seconds", "frames_per_s"]


@pytest.fixture
def animate(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opened: None) -> Run:
    """Return a function that runs `dermis animate` in a folder with face.glb, two.glb and take.csv."""
    monkeypatch.chdir(tmp_path)
    write_moving_head(Path("face.glb"))
    write_moving_head(Path("two.glb"), clips=2)
    Path("take.csv").write_text(CAPTURE, encoding="utf-8")
    return lambda head, *words: run("animate", head, *words, *(SMALL if "--size" not in words else SMALL[2:]))


def _frames(path: str) -> tuple[list[np.ndarray], list[Fraction]]:
    with av.open(path) as file:
        frames = list(file.decode(file.streams.video[0]))
    return [frame.to_ndarray(format="rgb24") for frame in frames], [f.pts * f.time_base for f in frames]


def _report(ended: Any) -> Any:
    assert ended.code == 0, ended.stderr
    return json.loads(ended.stdout)


def test_a_movie_of_the_heads_own_clip(animate: Run, device: Any) -> None:
    report = _report(animate("face.glb", "-o", "a.mp4", "--fps", "20", "--crf", "10", "--json"))
    assert list(report) == KEYS and report["adapter"] == device.adapter.name
    assert (report["file"], report["size"], report["fps"]) == ("a.mp4", [32, 32], 20.0)
    assert report["frames"] == report["drawn"] == 7 and report["frames_per_s"] > 0
    images, times = _frames("a.mp4")
    assert times == [Fraction(k, 20) for k in range(7)]
    apart = [np.abs(image.astype(int) - images[0]).mean() for image in images]
    assert apart[2] > 1 and apart[2] > apart[1] > apart[4] + 0.2 and apart[6] > apart[5]
    assert sorted(path.name for path in Path().iterdir()) == ["a.mp4", "face.glb", "take.csv", "two.glb"]


def test_each_frame_is_the_picture_of_its_pose(animate: Run, run: Run) -> None:
    ended = animate("face.glb", "-o", "new/frames/%03d.exr", "--fps", "20")
    assert ended.code == 0 and ended.stderr == ""
    assert ended.stdout.startswith("new/frames/%03d.exr  7 frames at 20/s  ")
    for number, weight in ((0, 0.0), (1, 0.5), (2, 1.0), (6, 1.0)):
        assert run("render", "face.glb", "--pose", f"jawOpen={weight}", "-o", "a.exr", *SMALL).code == 0
        np.testing.assert_allclose(read_image(f"new/frames/{number:03}.exr"), read_image("a.exr"), atol=1e-5)


def test_from_and_to_are_times_within_the_motion(animate: Run) -> None:
    words = ("--fps", "10", "-o", "f/%02d.png")
    assert _report(animate("face.glb", *words, "--from", "0.1", "--to", "0.3", "--json"))["frames"] == 2
    assert sorted(path.name for path in Path("f").glob("*.png")) == ["01.png", "02.png"]
    assert _report(animate("face.glb", *words, "--from", "0.25", "--json"))["frames"] == 1
    assert sorted(path.name for path in Path("f").glob("*.png")) == ["01.png", "02.png", "03.png"]


def test_complete_frames_are_not_rendered_again(animate: Run) -> None:
    words = ("face.glb", "-o", "f/%d.png", "--fps", "10", "--json")
    assert _report(animate(*words))["drawn"] == 4
    whole = {path.name: path.read_bytes() for path in Path("f").glob("*.png")}
    Path("f/1.png").write_bytes(whole["1.png"][:-3])
    Path("f/3.png").unlink()
    again = _report(animate(*words))
    assert (again["frames"], again["drawn"]) == (4, 2)
    assert {path.name: path.read_bytes() for path in Path("f").glob("*.png")} == whole
    nothing = _report(animate(*words))
    assert (nothing["drawn"], nothing["adapter"]) == (0, None)
    assert _report(animate(*words, "--overwrite"))["drawn"] == 4
    assert _report(animate(*words, "--exposure", "2"))["drawn"] == 4
    ended = animate(*words[:-1], "--exposure", "2")
    assert ended.stdout.startswith("f/%d.png  4 frames (4 reused) at 10/s")


def test_an_interruption_leaves_whole_frames_and_no_movie(
    animate: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    laid, left = merge_poses, [0]

    def interrupted(*words: Any) -> Any:
        left[0] -= 1
        if not left[0]:
            raise KeyboardInterrupt
        return laid(*words)

    monkeypatch.setattr("dermis.mesh.pose.merge_poses", interrupted)
    left[0] = 3
    ended = animate("face.glb", "-o", "a.mp4")
    assert (ended.code, ended.stdout, ended.stderr) == (130, "", "")
    assert not list(Path().glob("*.mp4")) and not list(Path().glob(".dermis*"))
    left[0] = 7
    assert animate("face.glb", "-o", "f/%d.png", "--fps", "100").code == 130
    for path in Path("f").glob("*.png"):
        assert read_image(path).shape == (32, 32, 3)
    assert not list(Path("f").glob(".dermis*"))


def test_a_capture_moves_the_head_and_says_what_it_lacks(animate: Run) -> None:
    ended = animate("face.glb", "--motion", "take.csv", "-o", "a.mp4", "--json")
    assert "note: take: the head has no TongueOut" in ended.stderr
    report = _report(ended)
    assert (report["fps"], report["frames"]) == (4.0, 3)


def test_a_scene_keeps_its_pose_where_the_clip_has_no_tracks(animate: Run, run: Run) -> None:
    Path("s.toml").write_text(
        '[head]\nname = "two.glb"\n[pose.weights]\nmouthSmileLeft = 1.0\njawOpen = 0.5\n'
    )
    words = ("s.toml", "--clip", "nod", "-o", "f/%d.exr", "--to", "0.05", "--pose", "jawOpen=0")
    assert animate(*words).code == 0
    assert run("render", "two.glb", "--pose", "mouthSmileLeft=1", "-o", "a.exr", *SMALL).code == 0
    np.testing.assert_allclose(read_image("f/0.exr"), read_image("a.exr"), atol=1e-5)
    assert run("render", "s.toml", "-o", "b.exr", *SMALL).code == 0
    assert np.abs(read_image("b.exr") - read_image("a.exr")).max() > 0.01


def test_a_sequence_has_a_file_for_each_frame(animate: Run) -> None:
    from small_head import obj_text

    Path("seq").mkdir()
    lines = obj_text().splitlines()
    for k in range(3):
        wider = [
            f"v {(1 + k / 20) * float(x[2:].split()[0])} {x.split(None, 2)[2]}" if x[:2] == "v " else x
            for x in lines
        ]
        Path(f"seq/{k:03}.obj").write_text("\n".join(wider))
    report = _report(
        animate("seq/000.obj", "--motion", "seq/%03d.obj", "--fps", "24", "-o", "a.mp4", "--json")
    )
    assert (report["frames"], report["fps"]) == (3, 24.0)
    ended = animate("seq/000.obj", "--motion", "seq", "--motion-fps", "10", "--fps", "20", "--json")
    assert _report(ended)["frames"] == 5 and Path("dermis.mp4").is_file()


def test_names_are_listed(animate: Run) -> None:
    ended = animate("two.glb", "--names")
    assert ended.stdout == "targets: jawOpen, mouthSmileLeft\nbones: head\nclips: talk, nod\n"
    found = _report(animate("two.glb", "--names", "--json"))
    assert found == {"targets": ["jawOpen", "mouthSmileLeft"], "bones": ["head"], "clips": ["talk", "nod"]}


def test_one_of_several_clips(animate: Run) -> None:
    first = _report(animate("two.glb", "--clip", "nod", "-o", "f/%d.exr", "--json"))
    assert first["frames"] > 2
    assert np.abs(read_image("f/1.exr") - read_image("f/0.exr")).max() > 0.01


REFUSED = {
    "no such clip": ("two.glb --clip wave", "two.glb", "got 'wave'"),
    "which clip": ("two.glb", "two.glb", "it has talk, nod"),
    "no motion": ("head.obj", "--motion", "head.obj cannot contain clips"),
    "no such motion": ("face.glb --motion nothing.csv", "nothing.csv", "no such file"),
    "no name in common": ("face.glb --motion other.csv", "other.csv", "it has browDown"),
    "to before from": ("face.glb --from 2 --to 1", "--to", "got 1 s"),
    "from below 0": ("face.glb --from -1", "--from", "got -1.0"),
    "to that is none": ("face.glb --to nan", "--to", "got nan"),
    "from after the end": ("face.glb --from 10", "--from", "talk lasts 0.300 s"),
    "between two frames": ("face.glb --fps 10 --from 0.11 --to 0.12", "--to", "there is none"),
    "rate": ("face.glb --fps fast", "--fps", "got 'fast'"),
    "rate of the motion": ("face.glb --motion-fps 0", "--motion-fps", "got 0.0"),
    "odd size": ("face.glb --size 31x32", "--size", "got 31x32"),
    "crf": ("face.glb --crf 99", "--crf", "got 99"),
    "crf of pictures": ("face.glb -o f/%d.png --crf 9", "--crf", "f/%d.png"),
    "--overwrite with a movie": ("face.glb --anew", "--overwrite", "out.mp4"),
    "one picture": ("face.glb -o a.png", "a.png", "one picture"),
    "another film": ("face.glb -o a.avi", "a.avi", "'.avi'"),
    "no folder": ("face.glb -o nowhere/a.mp4", "nowhere/a.mp4", "no folder"),
    "no number": ("face.glb -o f/%s.png", "f/%s.png", "the name is"),
}


@pytest.mark.parametrize("bad", REFUSED.values(), ids=REFUSED)
def test_invalid_options_are_refused_before_rendering(
    animate: Run, bad: tuple[str, str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from small_head import obj_text

    words, error_subject, actual = bad
    monkeypatch.setattr("dermis.frame.renderer.Renderer.__init__", lambda *_: pytest.fail("opened"))
    Path("other.csv").write_text("Timecode,BlendShapeCount,browDown\n10:00:00:00,1,0\n", encoding="utf-8")
    Path("head.obj").write_text(obj_text())
    before = sorted(path.name for path in Path().iterdir())
    ended = animate(*words.split(), *(() if "-o" in words else ("-o", "out.mp4")))
    assert (ended.code, ended.stdout) == (2, "")
    assert (
        ended.stderr.startswith(f"dermis: {error_subject}")
        and actual in ended.stderr
        and "expected" in ended.stderr
    )
    assert sorted(path.name for path in Path().iterdir()) == before


def test_a_missing_encoder_is_reported_before_the_head_is_loaded(
    animate: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.images.movie._VIDEO_ENCODER", "no such encoder")
    ended = animate("nobody.glb", "-o", "a.mp4")
    assert ended.code == 2 and "Install av" in ended.stderr


def test_the_writer_is_public() -> None:
    assert dermis.MovieWriter.__name__ == "MovieWriter"


@pytest.mark.photographed
def test_one_exposure_for_all_frames_is_metered_at_the_first(animate: Run, run: Run) -> None:
    """Independent of the rendered frames; pictures without a background have alpha."""
    words = ("face.glb", "-o", "f/%d.png", "--fps", "10", "--background", "none")
    ended = animate(*words)
    assert ended.code == 0 and ended.stderr.startswith("note: --exposure ")
    assert ended.stderr.endswith(", metered at the first frame\n")
    whole = {path.name: path.read_bytes() for path in Path("f").glob("*.png")}
    assert len(whole) == 4 and read_image("f/3.png").shape[2] == 4
    Path("f/3.png").unlink()
    assert animate(*words).stderr == ended.stderr
    assert {path.name: path.read_bytes() for path in Path("f").glob("*.png")} == whole
