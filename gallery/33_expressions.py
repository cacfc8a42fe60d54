"""A face that moves.

One head under studio light, moved by weights of its targets and turns of its bones. Shape, shadows and what
scatters below the skin follow each pose on the device. Its skin is one of MakeHuman's, from the sample data.

Deck: +
Columns: 3
"""

import os
from pathlib import Path

import dermis
from dermis.gallery.picture import main
from dermis.mesh.maps import load_maps

DATA = Path(os.environ.get("DERMIS_DATA", ".")) / "heads"
COLOUR = DATA / "makehuman" / "skins" / "young_lightskinned_male_diffuse.png"
MAN = dermis.Human(sex=1, age=25)
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
    head = MAN.head(load_maps(colour=COLOUR), layout="hm08")
    return {name: studio.render(dermis.Scene(head, pose=pose)) for name, pose in POSES.items()}


if __name__ == "__main__":
    main(draw)
