"""Many people in turn: one topology, and pictures that do not depend on the people before."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.frame.renderer import Renderer
from dermis.gpu import Device
from dermis.human.hair.look import HairLook
from dermis.human.model import head_template
from dermis.human.person import Human
from dermis.mesh.pose import Pose
from dermis.scene.lights import preset_lights
from dermis.scene.model import Scene
from dermis.scene.people import skin_of

SETTINGS = {"size": (128, 128), "atlas": 256, "shadow_size": 256}
HAIR = HairLook(style="cropped", density=0.2, beard_mm=3.0)
OTHER_HAIR = HairLook(style="cropped", length_mm=11.0, beard_mm=2.0)
PEOPLE = (
    Human(african=1, asian=0, caucasian=0, sex=1.0, age=60, hair=HAIR),
    Human(african=0, asian=1, caucasian=0, sex=0.0, hair=OTHER_HAIR, targets={"nose/nose-hump-incr": 1.0}),
    Human(african=0, asian=0, caucasian=1, sex=0.3, age=40, weight=0.8, hair=HairLook(style="none")),
)
FACES = ({"jawOpen": 0.6, "eyeBlinkLeft": 1.0}, {"mouthSmileLeft": 1.0}, None)


def scene_of(number: int, **others: object) -> Scene:
    person, face = PEOPLE[number], FACES[number]
    light = preset_lights(("studio", "backlit", "studio")[number])[:2]
    pose = Pose(weights=face) if face else None
    return Scene(person.head(), lights=light, pose=pose, skin=skin_of(person), **others)  # type: ignore[arg-type]


def pictures(
    renderer: Renderer, order: tuple[int, ...], scenes: dict[int, Scene]
) -> dict[int, NDArray[np.uint8]]:
    drawn = renderer.render_many((scenes[k] for k in order), **SETTINGS)  # type: ignore[call-overload]
    return dict(zip(order, drawn, strict=True))


@pytest.fixture(scope="module")
def scenes() -> dict[int, Scene]:
    return {k: scene_of(k) for k in range(3)}


def test_picture_does_not_depend_on_the_previous_person(renderer: Renderer, scenes: dict[int, Scene]) -> None:
    fresh = Renderer(renderer.device.adapter.name)
    forth, back = pictures(renderer, (0, 1, 2), scenes), pictures(fresh, (2, 1, 0), scenes)
    for k in range(3):
        assert np.array_equal(forth[k], back[k])
        assert not np.array_equal(forth[k], forth[(k + 1) % 3])
    assert all(picture.max() > 60 for picture in forth.values())


class Made:
    """Sizes of the buffers that a device creates and fills [bytes]."""

    def __init__(self, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
        self.sizes, make = list[int](), device.buffer

        def noted(data: NDArray[np.generic], usage: str, name: str = "buffer") -> object:
            if usage == "STORAGE":
                self.sizes.append(data.nbytes)
            return make(data, usage, name)

        monkeypatch.setattr(device, "buffer", noted)


def test_only_data_of_a_new_person_is_uploaded(
    renderer: Renderer, scenes: dict[int, Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only brows and lashes are uploaded: no style of hair, no atlas, no triangles, no morph targets."""
    list(renderer.render_many([scenes[0]], **SETTINGS))  # type: ignore[call-overload]
    made = Made(renderer.device, monkeypatch)
    second = scenes[1].replace(skin=scenes[0].skin)
    list(renderer.render_many([second], **SETTINGS))  # type: ignore[call-overload]
    hairs = scenes[1].head.strands
    assert hairs is not None
    own = 48 * len(hairs) + 4 * (hairs.knots_mm.size + hairs.radius_mm.size)
    assert own <= sum(made.sizes) < own + 400_000  # and what is painted


def test_all_heads_share_the_template() -> None:
    heads = [person.head() for person in PEOPLE[:2]]
    assert all(head.topology_head is head_template("own", 1).head for head in heads)
    assert np.array_equal(heads[0].mesh.positions, PEOPLE[0].head().mesh.positions)
    assert not np.array_equal(heads[0].mesh.positions, heads[1].mesh.positions)
