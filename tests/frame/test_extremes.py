"""Pictures of scenes with each number at an end of its range are finite."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from pydantic.fields import FieldInfo
from small_head import write_head

import dermis
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.scene.field_errors import field_bounds, numeric_fields
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.lights import LIGHTS

SMALL: dict[str, Any] = {"size": (24, 24), "atlas": 64, "samples": 1, "shadow_size": 64}
NEEDED: dict[str, Any] = {"position": (0.0, 0.0, 900.0), "direction": (0.0, 0.0, -1.0)}
END = (1e6, 1e6, 9e5)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dermis.Head:
    return dermis.load_head(write_head(tmp_path_factory.mktemp("head") / "head.obj"))


def ends(model: type[FrozenModel], field: str) -> list[Any]:
    """Return the least and the greatest value of a field."""
    info = model.model_fields[field]
    kind = get_args(info.annotation)
    if field_bounds(info) != (None, None):
        return list(field_bounds(info))
    return [(end,) * len(kind) for end in field_bounds(FieldInfo.from_annotation(kind[0]))]


def check(renderer: Renderer, scene: dermis.Scene, **settings: Any) -> None:
    drawn = renderer.draw(scene, dermis.Settings(**{**SMALL, **settings}))
    assert np.isfinite(drawn.linear()).all() and np.isfinite(drawn.exposure)


@pytest.mark.parametrize("kind", LIGHTS)
def test_extreme_lights_give_finite_pictures(renderer: Renderer, small: dermis.Head, kind: str) -> None:
    model = LIGHTS[kind]
    needed = {name: value for name, value in NEEDED.items() if name in model.model_fields}
    taken = 0
    for field in numeric_fields(model):
        for end in ends(model, field):
            try:
                light = model(**{**needed, "irradiance": (1e6,) * 3, field: end})
                scene = dermis.Scene(small, lights=[light])
                check(renderer, scene, exposure=1e6, bloom=1.0, tone="filmic")
                taken += 1
            except DermisError:  # of values that do not go together
                continue
    assert taken > 3


@pytest.mark.parametrize("field", numeric_fields(dermis.Camera))
def test_extreme_cameras_give_finite_pictures(renderer: Renderer, small: dermis.Head, field: str) -> None:
    for end in ends(dermis.Camera, field):
        for position in ((0.0, 0.0, 1100.0), END):
            camera = dermis.Camera(**{"position": position, "frame_mm": 30.0, "up": (0, 1, 0), field: end})
            check(renderer, dermis.Scene(small, camera=camera))


def test_extreme_settings_and_environments_give_finite_pictures(
    renderer: Renderer, small: dermis.Head
) -> None:
    around = [
        dermis.Environment("uniform", **{field: end})
        for field in numeric_fields(dermis.Environment)
        for end in ends(dermis.Environment, field)
    ]
    for one in around:
        for exposure in ("auto", 1e6):
            check(renderer, dermis.Scene(small, environment=one), exposure=exposure, background="environment")
    for field in set(numeric_fields(dermis.Settings)) - set(SMALL):
        for end in ends(dermis.Settings, field):
            check(renderer, dermis.Scene(small), **{field: end})


def test_extreme_skins_give_finite_pictures(renderer: Renderer, small: dermis.Head, tmp_path: Path) -> None:
    for field in numeric_fields(dermis.Skin):
        for end in ends(dermis.Skin, field):
            check(renderer, dermis.Scene(small, skin=dermis.Skin(**{field: end})))
    for number, rows in enumerate(["1e-12,1e-12,1e-12,1e-12\n1e4,100,100,100", "1e4,1e-12,100,1e-12"]):
        table = tmp_path / f"{number}.csv"
        table.write_text(f"variance_mm2,red,green,blue\n{rows}\n")
        for technique in ("texture-space", "screen-space", "pre-integrated"):
            skin = dermis.Skin(profile=str(table), albedo="profile")
            check(renderer, dermis.Scene(small, skin=skin), technique=technique)


def test_distant_human_gives_a_finite_picture(renderer: Renderer) -> None:
    """Products of corners of small triangles cancel in single precision."""
    camera = dermis.Camera(position=(6e4, 6e4, 6e4), target=(5, 20, 90), frame_mm=30)
    check(renderer, dermis.Scene("human", camera=camera), size=(128, 128))
