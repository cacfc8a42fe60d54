"""Six people of one model.

Ancestry, sex, age, weight, muscle and each feature of the face are numbers. All people share one mesh and
differ only in its vertex positions.

Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

AFRICAN = {"african": 1, "asian": 0, "caucasian": 0}
ASIAN = {"african": 0, "asian": 1, "caucasian": 0}
CAUCASIAN = {"african": 0, "asian": 0, "caucasian": 1}
PEOPLE = {
    "a woman of 28": dermis.Human(**AFRICAN, sex=0, age=28),
    "a man of 35": dermis.Human(**ASIAN, sex=1, age=35, targets={"nose/nose-hump-incr": 0.3}),
    "a woman of 45": dermis.Human(**CAUCASIAN, sex=0, age=45, weight=0.4),
    "a man of 60": dermis.Human(**AFRICAN, sex=1, age=60, weight=0.3),
    "a woman of 75": dermis.Human(**ASIAN, sex=0, age=75),
    "a man of 85": dermis.Human(**CAUCASIAN, sex=1, age=85, weight=-0.3, muscle=-0.3),
}


def draw(studio):
    panels = {}
    for name, person in PEOPLE.items():
        head = person.head()
        panels[name] = studio.render(dermis.Scene(head, camera=dermis.portrait(head)))
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
