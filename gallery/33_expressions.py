"""A face that moves.

One head under studio light, moved by weights of its targets and turns of its bones. Shape, shadows and what
scatters below the skin follow each pose on the device. It needs the parametric human of the sample data.

Deck: +
Columns: 3
"""

import os
from pathlib import Path

import dermis
from dermis.gallery.picture import main
from dermis.human.hm08 import hm08
from dermis.mesh.subdivide import subdivide_head

DATA = Path(os.environ.get("DERMIS_DATA", ".")) / "heads"
COLOUR = DATA / "makehuman" / "skins" / "young_lightskinned_male_diffuse.png"
MAN = {f"macrodetails/{name}-male-young": 1 / 3 for name in ("african", "asian", "caucasian")}
NECK = ("neck01", "neck02", "neck03", "head")
SMILE = dict.fromkeys(("mouthSmileLeft", "mouthSmileRight", "cheekSquintLeft", "cheekSquintRight"), 0.8)
POSES = {
    "at rest": dermis.Pose(),
    "a smile": dermis.Pose(SMILE),
    "wonder": dermis.Pose({"jawOpen": 0.4, "browInnerUp": 1.0, "eyeWideLeft": 0.8, "eyeWideRight": 0.8}),
    "pursed lips": dermis.Pose({"mouthPucker": 0.9, "mouthFunnel": 0.3, "browDownLeft": 0.5}),
    "closed eyes": dermis.Pose({"eyeBlinkLeft": 1, "eyeBlinkRight": 1}, dict.fromkeys(NECK, (5, 0, 2))),
    "turned by 40 degrees": dermis.Pose(SMILE, dict.fromkeys(NECK, (0, 10, 0))),
}


def draw(studio):
    head = subdivide_head(hm08(DATA / "human", MAN, COLOUR), 1)
    return {name: studio.render(dermis.Scene(head, pose=pose)) for name, pose in POSES.items()}


if __name__ == "__main__":
    main(draw)
