"""Render a movie of the parametric human that smiles, speaks, blinks and turns under studio light.

The motion is written beside the movie as a CSV in the format of Live Link Face. Needs DERMIS_DATA with
heads/makehuman.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import dermis
from dermis.base.command_line import run_script
from dermis.formats.maps import load_maps
from dermis.images.movie import parse_frame_rate
from dermis.mesh.head import Head

DATA = Path(os.environ.get("DERMIS_DATA", "../shared")) / "heads"
SKIN = DATA / "makehuman" / "skins" / "young_lightskinned_male_diffuse.png"
MAN = dermis.Human(sex=1, age=25)
SIDE, FPS, ATLAS = 1024, "30", 1024
SECONDS, CAPTURE_FPS = 6.0, 60
Keys = Sequence[tuple[float, float]]
BLINKS = [(at + after, shut) for at in (1.35, 3.95) for after, shut in ((-0.08, 0), (0, 1), (0.14, 0))]
MOTION: dict[str, Keys] = {
    "MouthSmile": [
        (0.2, 0),
        (0.7, 0.9),
        (1.3, 0.9),
        (1.7, 0.1),
        (4.2, 0.1),
        (4.8, 0.8),
        (5.5, 0.6),
        (5.9, 0),
    ],
    "CheekSquint": [(0.2, 0), (0.7, 0.7), (1.3, 0.7), (1.7, 0), (4.2, 0), (4.8, 0.5), (5.5, 0.4), (5.9, 0)],
    "JawOpen": [(1.7, 0), (1.9, 0.6), (2.1, 0.25), (2.4, 0.3), (2.6, 0.12), (2.8, 0.5), (3.1, 0.1), (3.4, 0)],
    "MouthFunnel": [(2.1, 0), (2.35, 0.8), (2.55, 0)],
    "MouthPucker": [(2.4, 0), (2.6, 0.9), (2.8, 0)],
    "MouthStretch": [(2.7, 0), (2.85, 0.6), (3.0, 0)],
    "MouthClose": [(2.95, 0), (3.1, 0.12), (3.4, 0)],
    "MouthPress": [(2.95, 0), (3.1, 0.5), (3.4, 0)],
    "BrowInnerUp": [(3.2, 0), (3.5, 1), (3.8, 1), (4.1, 0)],
    "BrowOuterUp": [(3.2, 0), (3.5, 0.9), (3.8, 0.9), (4.1, 0)],
    "EyeWide": [(3.2, 0), (3.5, 0.6), (3.8, 0.6), (3.9, 0)],
    "EyeBlink": BLINKS,
    "HeadYaw": [(3.9, 0), (4.6, 0.55), (5.0, 0.55), (5.7, -0.1), (6.0, 0)],
    "HeadPitch": [(1.6, 0), (2.3, -0.08), (3.2, 0.06), (4.2, 0)],
    "HeadRoll": [(3.9, 0), (4.6, 0.1), (5.0, 0.1), (5.7, 0)],
}
"""Keys (seconds, value) of each column of the CSV; angles in radians."""
PAIRED = ("MouthSmile", "CheekSquint", "MouthStretch", "MouthPress", "BrowOuterUp", "EyeWide", "EyeBlink")
"""Columns that exist for the left and the right side."""


def main(output: Path, side: int = SIDE, fps: str = FPS) -> None:
    """Write the CSV and the movie.

    Parameters
    ----------
    output:
        Movie to write, such as NAME.mp4.
    side:
        Side of the pictures [pixel].
    fps:
        Frame rate, such as 30 or 30000/1001 [1/s].
    """
    rate = parse_frame_rate(fps)
    take = output.with_suffix(".csv")
    take.write_text(capture(), encoding="utf-8")
    head = MAN.head(load_maps(colour=SKIN), layout="hm08")
    clip = dermis.load_motion(take, head)
    count, started = clip.frame_count(float(rate)), time.perf_counter()
    times = [float(number / rate) for number in range(count)]
    with dermis.MovieWriter(output, (side, side), rate) as movie:
        pictures = dermis.Renderer().render_many(scenes(head, clip, times), size=(side, side), atlas=ATLAS)
        for picture in pictures:
            movie.write(picture)
    sys.stdout.write(f"{output}: {count} frames in {time.perf_counter() - started:.1f} s; motion in {take}\n")


def scenes(head: Head, clip: dermis.Clip, times: Sequence[float]) -> Iterator[dermis.Scene]:
    """Yield the scene with the head at each time [s]."""
    for seconds in times:
        yield dermis.Scene(head, pose=clip.pose_at(seconds))


def capture() -> str:
    """Return the text of the CSV."""
    columns = {
        f"{name}{side}": keys
        for name, keys in MOTION.items()
        for side in (("Left", "Right") if name in PAIRED else ("",))
    }
    rows = [",".join(["Timecode", "BlendShapeCount", *columns])]
    for number in range(round(SECONDS * CAPTURE_FPS) + 1):
        seconds, frame = divmod(number, CAPTURE_FPS)
        values = [f"{value_at(keys, number / CAPTURE_FPS):.6f}" for keys in columns.values()]
        rows.append(",".join([f"12:00:{seconds:02}:{frame:02}.000", "52", *values]))
    return "\n".join([*rows, ""])


def value_at(keys: Keys, seconds: float) -> float:
    """Return the value at a time of a curve through keys, with zero slope at each key."""
    if seconds <= keys[0][0] or seconds >= keys[-1][0]:
        return keys[0][1] if seconds <= keys[0][0] else keys[-1][1]
    index = next(k for k, (at, _) in enumerate(keys) if at > seconds)
    (begin, before), (end, after) = keys[index - 1], keys[index]
    share = 0.5 - 0.5 * math.cos(math.pi * (seconds - begin) / (end - begin))
    return before + share * (after - before)


if __name__ == "__main__":
    run_script(main)
