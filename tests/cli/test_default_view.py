"""Commands show people in a headshot, and other heads whole; both in the rig "portrait"."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_head import write_head

from dermis.cli.scene_options import SceneOptions, assemble_scene
from dermis.scene.camera import headshot, portrait
from dermis.scene.lights import preset_lights, studio
from dermis.scene.model import Scene

pytestmark = pytest.mark.photographed


def person(**options: object) -> Scene:
    given = SceneOptions(head={"subdivide": 1}, **options)  # type: ignore[arg-type]
    return assemble_scene("human", given, looks_at_camera=True)[0]


def gaze(scene: Scene) -> dict[str, float]:
    weights = {} if scene.pose is None else scene.pose.weights
    return {name: weight for name, weight in weights.items() if name.startswith("eyeLook")}


def test_people_are_seen_in_a_headshot_and_look_at_the_camera() -> None:
    scene = person()
    assert scene.camera == headshot(scene.head) and scene.lights == preset_lights("portrait")
    assert gaze(scene)["eyeLookOutLeft"] > 0.5 and gaze(scene)["eyeLookInRight"] > 0.5


def test_gaze_is_kept_where_an_option_or_another_camera_turns_it() -> None:
    assert gaze(person(pose=["eyeLookUpLeft=0.5"])) == {"eyeLookUpLeft": 0.5}
    assert gaze(person(bone=["head=0,10,0"])) == gaze(person(camera="portrait")) == {}
    assert gaze(person(look_at="0,0,2000")) != gaze(person())


def test_expression_keeps_the_gaze_at_the_camera() -> None:
    smiling = person(pose=["mouthSmileLeft=0.5"])
    assert gaze(smiling)["eyeLookOutLeft"] > 0.5
    assert smiling.pose is not None and smiling.pose.weights["mouthSmileLeft"] == 0.5


def test_other_heads_are_seen_whole(tmp_path: Path) -> None:
    write_head(tmp_path / "head.obj")
    scene, _ = assemble_scene(str(tmp_path / "head.obj"), SceneOptions(), looks_at_camera=True)
    assert scene.camera == portrait(scene.head)
    assert scene.lights == preset_lights("portrait") and scene.pose is None


def test_scene_files_keep_lights_and_camera_of_earlier_releases(tmp_path: Path) -> None:
    write_head(tmp_path / "head.obj")
    (tmp_path / "scene.toml").write_text('[head]\nname = "head.obj"\n')
    scene, _ = assemble_scene(str(tmp_path / "scene.toml"), SceneOptions(), looks_at_camera=True)
    assert scene.camera == portrait(scene.head) and scene.lights == studio(scene.head)
