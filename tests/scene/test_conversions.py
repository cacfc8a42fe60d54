"""Arguments of a scene: clear ones are converted, others are refused with a message."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from small_head import write_head

import dermis
from dermis.base.errors import DermisWarning
from dermis.mesh.head import Head
from dermis.scene.camera import cheek

LAMP = dermis.PointLight(position=(0, 0, 900))


@pytest.fixture
def head(tmp_path: Path) -> Head:
    return dermis.load_head(write_head(tmp_path / "head.obj"))


def test_lights_accept_one_light_an_iterable_or_a_name(head: Head) -> None:
    assert dermis.Scene(head, lights=LAMP).lights == (LAMP,)
    assert dermis.Scene(head, lights=(one for one in [LAMP, LAMP])).lights == (LAMP, LAMP)
    assert dermis.Scene(head, lights="window").lights == dermis.load_lights("window")
    assert dermis.Scene(head, lights="none").lights == ()


def test_cameras_skins_and_environments_may_be_named(head: Head) -> None:
    scene = dermis.Scene(head, camera="cheek", skin={"mix": 0.2}, environment="uniform")
    assert scene.camera == cheek(head) and scene.skin == dermis.Skin(mix=0.2)
    assert scene.environment == dermis.Environment(name="uniform") and scene.lights == ()
    assert dermis.Scene(head, camera=dermis.side).camera == dermis.side(head)


def test_heads_may_be_named(head: Head, tmp_path: Path) -> None:
    assert dermis.Scene(tmp_path / "head.obj").head.name == head.name
    person = dermis.Human(age=60)
    assert dermis.Scene(person).head.maps == person.head().maps


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"lights": "windo"}, "lights: expected lights, or one of the presets .*got 'windo'"),
        ({"lights": [None]}, r"lights\[0\]: expected a light, but got None"),
        ({"lights": [LAMP, dermis.PointLight]}, r"lights\[1\]: .*got the class PointLight"),
        ({"lights": 3}, "lights: expected a list of lights, but got 3"),
        ({"lights": {"kind": "point"}}, "lights: expected a list of lights"),
        ({"camera": "portait"}, "camera portait: expected one of portrait"),
        ({"camera": (0, 0, 900)}, r"camera: expected a camera, but got \(0, 0, 900\)"),
        ({"skin": "dark"}, r"skin: expected a Skin, but got 'dark'\. Write skin=dermis\.Skin\("),
        ({"environment": 3}, "environment: expected an environment, but got 3"),
    ],
)
def test_ambiguous_values_are_refused(head: Head, parts: dict[str, Any], said: str) -> None:
    with pytest.raises(dermis.DermisError, match=said):
        dermis.Scene(head, **parts)


def test_positions_in_metres_are_pointed_out(head: Head) -> None:
    with pytest.warns(DermisWarning, match=r"^camera: .*1\.1 mm from the centre\. Write 1100 for 1\.1 m\."):
        dermis.Scene(head, camera=dermis.Camera(position=(0, 0, 1.1)))
    with pytest.warns(DermisWarning, match="^light: "):
        dermis.Scene(head, lights=[dermis.PointLight(position=(0.5, 0, 0.9))])
