"""Files of settings: scenes, lights, cameras, people, regions, landmarks, media and profiles."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from adversity.case import Input, Plan
from adversity.checks import check_finite
from adversity.kind import Kind
from adversity.kinds.meshes import head_files, moving_files
from adversity.kinds.pictures import picture_bytes
from adversity.trees import toml_text

_PROFILE = "variance_mm2,red,green,blue\n0.01,0.3,0.5,0.6\n0.2,0.3,0.3,0.3\n2.0,0.4,0.2,0.1\n"
_MEDIUM: Mapping[str, Any] = {
    "name": "tissue",
    "eta": 1.4,
    "layers": [
        {"absorption_per_mm": [2.1, 2.1, 5.0], "scattering_per_mm": [48.0, 60.0, 65.0], "thickness_mm": 0.25},
        {"absorption_per_mm": [0.16, 0.19, 0.3], "scattering_per_mm": [32.0, 40.0, 46.0]},
    ],
}
_PIGMENTS: Mapping[str, Any] = {
    "skin": {"structure": "dj2006", "melanin": 0.05, "blood": 0.02, "oxygen": 0.7}
}
_GAUSSIANS: Mapping[str, Any] = {"variances_mm2": [0.01, 0.5], "weights": [[0.4, 0.5, 0.6], [0.6, 0.5, 0.4]]}


def _toml(tree: Mapping[str, Any]) -> bytes:
    return toml_text(_plain(dict(tree))).encode()


def _plain(value: Any) -> Any:
    """Return the tree without values that TOML does not support."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items() if one is not None}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


@cache
def _lights_tree() -> list[dict[str, Any]]:
    from dermis.scene.lights import LIGHTS

    return [{"kind": kind, **_dump(light)} for kind, light in LIGHTS.items()]


def _dump(model: Any) -> dict[str, Any]:
    """Return the defaults of a model, with numbers for fields without default."""
    needed = {
        "irradiance": (1.0, 1.0, 1.0),
        "position": (100.0, 200.0, 900.0),
        "direction": (0.0, -1.0, -1.0),
    }
    given = {key: value for key, value in needed.items() if key in model.model_fields}
    return {key: one for key, one in model(**given).model_dump().items() if key != "kind"}


@cache
def _scene_trees() -> tuple[dict[str, Any], ...]:
    """Return a scene with all parts and files, one with motion, and one with the human."""
    from dermis.scene.camera import Camera
    from dermis.scene.settings import Settings
    from dermis.scene.skin import Skin

    camera = Camera(position=(0.0, 0.0, 900.0), target=(0.0, 0.0, 0.0)).model_dump()
    files = {
        "name": "head.obj",
        "colour": "skin.png",
        "height": "height.png",
        "height_mm": 0.02,
        "unit_mm": 1.0,
    }
    parts = {
        "head": {
            **files,
            "normal": "normal.png",
            "specular": "grey.png",
            "roughness": "grey.png",
            "opaque": ["eye_L"],
        },
        "skin": {**Skin().model_dump(), "profile": "profile.csv"},
        "environment": {"name": "sky.hdr", "exposure": 1.0, "rotation_degrees": 10.0},
        "camera": camera,
        "render": Settings().model_dump(),
        "lights": _lights_tree(),
    }
    moving = {
        "head": {"name": "head.glb"},
        "pose": {"weights": {"jawOpen": 0.5}, "bones": {"head": [0.0, 20.0, 0.0]}},
        "lights": "lights.toml",
        "camera": "camera.toml",
    }
    return parts, moving


@cache
def files_of_scenes() -> Mapping[str, bytes]:
    """Return the files that the scenes refer to."""
    own = {
        "sky.hdr": picture_bytes("sky.hdr"),
        "profile.csv": _PROFILE.encode(),
        "head.glb": moving_files()[0],
    }
    lights, camera = {"lights": _lights_tree()}, {"camera": _scene_trees()[0]["camera"]}
    return {**head_files(), **own, "lights.toml": _toml(lights), "camera.toml": _toml(camera)}


@cache
def scene_files() -> tuple[bytes, ...]:
    """Return the scene files that refer to them."""
    return tuple(map(_toml, _scene_trees()))


def _scene(rng: Random) -> Input:
    files = {**files_of_scenes(), "scene.toml": rng.choice(scene_files())}
    return Input(files, {"file": "scene.toml", "words": ["scene.toml"]}, ("scene.toml",))


def _take_scene(plan: Plan) -> None:
    from dermis.optics.profiles import load_profile
    from dermis.scene.files import load_scene

    scene, settings = load_scene(plan["file"])
    parts = scene.skin, scene.lights, scene.camera, scene.environment, scene.pose, settings
    check_finite(parts, "scene")
    check_finite(load_profile(scene.skin.profile), "profile")


def _lights(rng: Random) -> Input:
    words = ["head.obj", "--lights", "lights.toml"]
    return Input({"lights.toml": files_of_scenes()["lights.toml"]}, {"file": "lights.toml", "words": words})


def _take_lights(plan: Plan) -> None:
    from dermis.scene.files import load_lights

    check_finite(load_lights(plan["file"]), "lights")


def _camera(rng: Random) -> Input:
    words = ["head.obj", "--camera", "camera.toml"]
    return Input({"camera.toml": files_of_scenes()["camera.toml"]}, {"file": "camera.toml", "words": words})


def _take_camera(plan: Plan) -> None:
    from dermis.human.regions.average import average_head
    from dermis.scene.files import load_camera

    check_finite(load_camera(plan["file"], average_head()), "camera")


def _person(rng: Random) -> Input:
    from dermis.human.person import Human
    from dermis.human.person_file import person_parameters

    numbers = json.dumps({"person": person_parameters(Human.sampled(rng.randrange(100)))}, default=float)
    return Input({"person.json": numbers.encode()}, {"file": "person.json", "words": ["person.json"]})


def _take_person(plan: Plan) -> None:
    from dermis.human.person_file import read_person

    person = read_person(Path(plan["file"]))
    check_finite((person.positions_mm, person.look, person.iris, person.hair_look), "person")


def _regions(rng: Random) -> Input:
    from importlib import resources

    from dermis.human.regions.labels import average_landmarks

    text = resources.files("dermis.human.regions").joinpath("default.toml").read_text("utf-8")
    named = rng.choice(("landmarks", "labels"))
    file = {"landmarks": "places.csv", "labels": "labels.png"}[named]
    rows = [f"{name},{x:.6g},{y:.6g},{z:.6g}" for name, (x, y, z) in average_landmarks().items()]
    labels = picture_bytes("labels.png")
    files = {"places.csv": "\n".join(["landmark,x,y,z", *rows, ""]).encode(), "labels.png": labels}
    table = f'{named} = "{file}"\n{text}'.encode()
    return Input({"regions.toml": table, file: files[file]}, {"file": "regions.toml"})


def _take_regions(plan: Plan) -> None:
    """Load the table and its files; painting a head with them would take seconds."""
    from dermis.formats.maps import load_labels
    from dermis.human.regions.labels import load_landmarks
    from dermis.human.regions.region_table import load_region_table

    table = load_region_table(plan["file"])
    check_finite(table.values, "regions")
    if table.labels is not None:
        load_labels(table.labels)
    if table.landmarks is not None:
        check_finite(load_landmarks(table.landmarks), "landmarks")


def _profile(rng: Random) -> Input:
    trees = {"medium.toml": _MEDIUM, "pigments.toml": _PIGMENTS, "gaussians.toml": _GAUSSIANS}
    files = {name: _toml(tree) for name, tree in trees.items()} | {"profile.csv": _PROFILE.encode()}
    name = rng.choice(tuple(files))
    error_subjects = [name, str(_MEDIUM["name"])]  # a medium may be called as its file calls it
    plan = {"file": name, "error_subjects": error_subjects, "words": ["head.obj", "--profile", name]}
    return Input({name: files[name]}, plan)


def _take_profile(plan: Plan) -> None:
    from dermis.optics.profiles import load_profile

    profile = load_profile(plan["file"])
    check_finite((profile.variance_mm2, profile.weight), "profile")


def _landmarks(rng: Random) -> Input:
    rows = [f"point {k},{rng.randrange(200)}" for k in range(rng.randrange(1, 80))]
    text = "\n".join(["# mine", "name,vertex", *rows, ""])
    return Input({"points.csv": text.encode()}, {"file": "points.csv"})


def _take_landmarks(plan: Plan) -> None:
    from dermis.human.landmarks.points import landmark_points

    found = landmark_points(_ball(), plan["file"])
    check_finite((found.weight, found.point), "landmarks")


def _photo_landmarks(rng: Random) -> Input:
    points = [(rng.uniform(0, 300), rng.uniform(0, 400)) for _ in range(68)]
    lines = [f"{x:.2f} {y:.2f}" for x, y in points]
    texts = {
        "face.pts": "\n".join(["version: 1", "n_points: 68", "{", *lines, "}"]),
        "face.txt": "\n".join(lines),
        "face.csv": "\n".join(["name;x;y", *(f"{k};{x:.2f};{y:.2f}" for k, (x, y) in enumerate(points))]),
        "face.json": json.dumps({"faceLandmarks": [[{"x": x, "y": y, "z": 0.0} for x, y in points]]}),
    }
    name = rng.choice(tuple(texts))
    return Input({name: texts[name].encode()}, {"file": name})


def _take_photo_landmarks(plan: Plan) -> None:
    from dermis.apps.inverse.fitting.landmark_files import read_landmarks

    _, pixels = read_landmarks(plan["file"], (300, 400))
    check_finite(list(pixels.values()), "landmarks")


@cache
def _ball() -> Any:
    from dermis.mesh.head import Head
    from dermis.mesh.maps import Maps
    from dermis.mesh.primitives import uv_sphere

    return Head("ball", uv_sphere(60.0, 24, 12), Maps())


KINDS = (
    Kind("scene", _scene, _take_scene, share=20),
    Kind("lights", _lights, _take_lights, share=8),
    Kind("camera", _camera, _take_camera, share=5),
    Kind("person", _person, _take_person, share=8),
    Kind("regions", _regions, _take_regions, share=6),
    Kind("landmarks", _landmarks, _take_landmarks, share=3),
    Kind("photo landmarks", _photo_landmarks, _take_photo_landmarks, share=4),
    Kind("profile", _profile, _take_profile, share=8),
)
