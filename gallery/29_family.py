"""Six heads of one generator.

Shape, age, melanin, blood, freckles and oil are parameters; each head is a mesh with maps that other programs
can open.

Columns: 3
"""

import tempfile
from pathlib import Path

import dermis
from dermis.gallery.picture import main
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust_file import BustRecipe, write_bust
from dermis.human.skin_maps.look import SkinLook

FAMILY = [
    (BustParameters(seed=1), SkinLook(seed=1)),
    (BustParameters(seed=2, nose=1.15, jaw=1.08), SkinLook(seed=2, melanin=0.03, age=0.7)),
    (BustParameters(seed=3, width=0.95, fullness=0.8), SkinLook(seed=3, melanin=0.008, freckles=0.9)),
    (BustParameters(seed=4, ears=1.15, jaw=0.92), SkinLook(seed=4, melanin=0.06)),
    (BustParameters(seed=5, width=1.06, fullness=0.5), SkinLook(seed=5, melanin=0.1, oil=0.7)),
    (BustParameters(seed=6, fullness=-0.8, nose=1.2), SkinLook(seed=6, blood=0.025, age=1.0)),
]


def draw(studio):
    panels = {}
    with tempfile.TemporaryDirectory() as folder:
        for number, (shape, look) in enumerate(FAMILY, 1):
            path = Path(folder) / f"head-{number}.glb"
            write_bust(path, BustRecipe(shape, look, size=1024))
            head = dermis.load_head(path)
            panels[f"seed {number}"] = studio.render(dermis.Scene(head, camera=dermis.portrait(head)))
    return panels


if __name__ == "__main__":
    main(draw)
