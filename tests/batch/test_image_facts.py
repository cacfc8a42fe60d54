"""Facts in the records of a data set: persons, splits, gaze errors and boxes."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from small_observation import observation, small_spec

from dermis.apps.batch.face_boxes import box_points, face_boxes
from dermis.apps.batch.image_facts import image_split, person_facts, record_parameters
from dermis.apps.batch.licences import image_licence
from dermis.apps.batch.reader import UNKNOWN_OCCLUSION, decode_image
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.scenes import sampled_person
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.person import Human
from dermis.scene.camera import Camera
from dermis.scene.gaze import MAX_GAZE_WEIGHT, looking_at
from dermis.scene.head_pose import gaze_errors_deg
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

VARIED: dict[str, Any] = {
    "light": {"kind": {"choice": ["studio", "rig"]}},
    "environment": {"name": {"choice": ["none", "uniform"]}},
    "gaze": {"at": {"choice": ["camera", "angles"]}},
    "background": {"kind": {"choice": ["colour", "none", "gradient"]}},
}


def test_records_of_a_spec_have_the_same_parameters() -> None:
    spec = small_spec(count=40, **VARIED)
    values = [record_parameters(spec, spec.parameters(k), person_facts(Human())) for k in range(40)]
    assert all(list(one) == list(values[0]) for one in values)
    for k, one in enumerate(values):
        assert one.items() >= spec.parameters(k).items()
    unused = {name for name in values[0] if {one[name] is None for one in values} == {True, False}}
    assert unused >= {"light.key.yaw_deg", "gaze.yaw_deg", "background.red", "environment.strength"}


def test_all_that_a_seed_has_drawn_is_in_the_record() -> None:
    spec = small_spec(person={"age": 70})
    person = sampled_person(spec.parameters(5))
    found = person_facts(person)
    assert found["person.sex"] == pytest.approx(person.sex, rel=1e-5) and found["person.age"] == 70
    assert found["person.skin.melanin"] == pytest.approx(person.look.melanin, rel=1e-5)
    assert found["person.hair.style"] == person.hair_look.style
    assert found["person.eyes.eumelanin"] == pytest.approx(person.iris.eumelanin, rel=1e-5)
    assert not any("seed" in name or "targets" in name for name in found)


def test_splits_are_by_person_and_have_their_fractions() -> None:
    spec = small_spec(count=60_000, images_per_person=20)
    splits = [image_split(spec, {"person.number": k}) for k in range(20_000)]
    fractions = [splits.count(name) / len(splits) for name in ("train", "val", "test")]
    assert fractions == pytest.approx([0.8, 0.1, 0.1], abs=0.01)
    assert len({image_split(spec, spec.parameters(k)) for k in range(20, 40)}) == 1
    other = small_spec(count=60_000, images_per_person=20, seed=9)
    assert splits[:100] != [image_split(other, {"person.number": k}) for k in range(100)]
    named = [image_split(spec, {"person.number": k, "person.head": "human:7"}) for k in range(50)]
    assert len(set(named)) == 1, "several numbers, one head"


def test_licences_are_those_of_the_assets_in_the_image() -> None:
    assert image_licence({"environment.name": "none"}) == "MakeHuman community: CC0"
    both = image_licence({"environment.name": "lebombo", "person.head": "human:7"})
    assert both.startswith("MakeHuman community: CC0; ") and both.count(";") == 1
    assert "set by its owner" in image_licence({"person.head": "mine.glb", "environment.name": "none"})


def test_gaze_errors_are_the_angles_beyond_the_range_of_the_eyes() -> None:
    head = Human().head(subdivide=0)
    for wanted, missed in ((20.0, 0.0), (50.0, 50.0 - 28.0 * MAX_GAZE_WEIGHT)):
        target = 1e5 * np.array([np.sin(np.radians(wanted)), 0.0, np.cos(np.radians(wanted))])
        scene = Scene(head, pose=looking_at(head, target))
        assert gaze_errors_deg(scene, target) == pytest.approx((missed, missed), abs=0.1)


def test_boxes_contain_what_the_labels_show() -> None:
    head = Human(sex=0.5, hair=HairLook()).head()
    camera = Camera(position=(300.0, 40.0, 900.0), target=(0.0, 0.0, 0.0), frame_mm=400.0)
    scene, size = Scene(head, camera=camera), (256, 256)
    settings = Settings(size=size, atlas=64, shadow_size=64, samples=1)
    (seen,) = Renderer("cpu").observe([scene], settings, outputs=["label"])
    boxes = face_boxes(head, box_points(head), head.control_rig.rest, camera.to_opencv(size))
    outside = [class_number(name) for name in ("background", "neck", "torso")]
    rows, columns = np.nonzero(~np.isin(seen.outputs["label"], outside))
    bounds = columns.min(), rows.min(), columns.max(), rows.max()
    assert boxes["head"] == pytest.approx(bounds, abs=2.0)
    left, top, right, bottom = boxes["detector"]
    assert right - left == pytest.approx(bottom - top)
    face = boxes["face"]
    assert face[1] > boxes["head"][1] + 10 and face[3] == pytest.approx(bounds[3], abs=2.0)


def test_records_of_earlier_versions_are_read() -> None:
    spec = small_spec()
    files = encode_record(1, observation(1), spec.parameters(1), spec)
    record = json.loads(files["json"])
    for name in ("split", "licence", "boxes", "gaze_error_deg"):
        del record[name]
    record["parameters"] = spec.parameters(1)
    del record["landmarks"]["ibug-68"]["occlusion"]
    found = decode_image(files | {"json": json.dumps(record).encode()})
    assert found["boxes"] is None and found["gaze_error_deg"] is None
    assert found["split"] == found["licence"] == ""
    assert found["landmarks"]["ibug-68"].occlusion.tolist() == [UNKNOWN_OCCLUSION] * 2


def test_an_unknown_split_is_refused() -> None:
    """Exports use the split as the name of a folder."""
    spec = small_spec()
    files = encode_record(1, observation(1), spec.parameters(1), spec)
    record = json.loads(files["json"]) | {"split": "../other"}
    with pytest.raises(DermisError, match="its split is none of train, val, test"):
        decode_image(files | {"json": json.dumps(record).encode()})
