"""Every numeric field is finite in single precision and has a stated range."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from typing import Any, get_args

import numpy as np
import pytest
from pydantic.fields import FieldInfo

import dermis
from dermis.base.errors import DermisError
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.mesh.eye_look import EyeLook
from dermis.optics.pigments.parameters import SkinParameters
from dermis.scene import Environment, Skin
from dermis.scene.camera import Camera
from dermis.scene.field_errors import BoundsReason, InvalidFieldsError, field_bounds, numeric_fields
from dermis.scene.files import PoseTable
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.head_table import EyeTable, HeadTable
from dermis.scene.lights import LIGHTS
from dermis.scene.pulse import Pulse
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments, TissueLayer

PLACE = {"position": (0, 0, 900)}
THIRD = (0.1, 0.1, 0.1)
NEEDED: dict[type[FrozenModel], dict[str, Any]] = {
    **{LIGHTS[kind]: PLACE for kind in LIGHTS},
    **{LIGHTS[kind]: {"direction": (0, 0, -1)} for kind in ("directional", "stripe")},
    Camera: PLACE,
    Environment: {"name": "uniform"},
    HeadTable: {"name": "human"},
    TissueLayer: {"absorption_per_mm": THIRD, "scattering_per_mm": THIRD},
    **{model: {} for model in (EyeTable, Pigments, Skin, Settings, PoseTable, Pulse)},
}
"""The package's models, each with what it cannot be without."""
PEOPLE = (Human, SkinLook, HairLook, EyeLook, SkinParameters)
HUGE = 10**400
NONE = [np.nan, np.inf, -np.inf, 1e308, -1e308, HUGE, 10**5000, True, "1", 1j, [1.0], np.ones((2, 2))]
"""What no number is, in or out of any range."""
LEAST = 5e-324  # which is 0 in single precision


def _models(kind: type[FrozenModel] = FrozenModel) -> Iterator[type[FrozenModel]]:
    """Yield all models except those of data sets, whose fields are distributions (tests/batch)."""
    for one in kind.__subclasses__():
        ours = one.__module__.startswith("dermis.") and not one.__module__.startswith("dermis.apps.batch.")
        if ours and not one.__name__.startswith("_"):
            yield one
        yield from _models(one)


def test_all_models_are_tested() -> None:
    assert set(_models()) == set(NEEDED)


def _made(model: type[FrozenModel], field: str, value: Any) -> Any:
    """Build a model with the value as a number of the field, at each position of a list or mapping."""
    kind = model.model_fields[field].annotation
    count = len(get_args(kind)) if getattr(kind, "__origin__", None) is tuple else 0
    if getattr(kind, "__origin__", None) is dict:
        value = {"name": value}
    return model(**{**NEEDED[model], field: (value,) * count if count else value})


NUMBERS = [(model, field) for model in NEEDED for field in numeric_fields(model)]
IDS = [f"{model.__name__}.{field}" for model, field in NUMBERS]


@pytest.mark.parametrize(("model", "field"), NUMBERS, ids=IDS)
def test_invalid_numbers_of_models_are_refused(model: type[FrozenModel], field: str) -> None:
    for value in NONE:
        if isinstance(value, str) and numeric_fields(model)[field]:  # a word may stand for it
            continue
        with pytest.raises(InvalidFieldsError, match=rf"^{model.__name__}: {field}"):
            _made(model, field, value)


@pytest.mark.parametrize(("model", "field"), NUMBERS, ids=IDS)
def test_each_number_of_a_model_has_a_documented_range(model: type[FrozenModel], field: str) -> None:
    info = model.model_fields[field]
    kind = get_args(info.annotation)
    if field_bounds(info) == (None, None):
        info = FieldInfo.from_annotation(kind[-1])
    low, high = field_bounds(info)
    assert low is not None and high is not None and np.isfinite(np.float32([low, high])).all()
    assert (low, high) == (0, 1) or any(isinstance(one, BoundsReason) for one in info.metadata)
    assert low <= 0 or np.float32(low) > 0
    if low > 0:
        with pytest.raises(InvalidFieldsError):
            _made(model, field, LEAST)


@pytest.mark.parametrize("kind", PEOPLE)
def test_invalid_numbers_of_people_are_refused(kind: Callable[..., object]) -> None:
    numbers = [one for one in fields(kind) if one.type in ("float", "int")]  # type: ignore[arg-type]
    assert len(numbers) > 3
    for name, default in ((one.name, one.default) for one in numbers):
        for value in [*NONE, *([] if default is None else [None])]:
            with pytest.raises(DermisError, match=r"expected a (whole )?number from"):
                kind(**{name: value})


POSES: Mapping[str, Callable[[Any], dermis.Pose]] = {
    "weight": lambda value: dermis.Pose({"jawOpen": value}),
    "angle": lambda value: dermis.Pose(bones={"head": [0, value, 0]}),
    "matrix": lambda value: dermis.Pose(
        bones={"head": [[1, 0, 0, value], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
    ),
    "place": lambda value: dermis.Pose(positions_mm=[[value, 0, 0]]),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("part", POSES)
def test_invalid_numbers_of_poses_are_refused(part: str) -> None:
    head = Human().head()
    for value in NONE:
        with pytest.raises(DermisError, match=r"^pose: "):
            dermis.Scene(head, pose=POSES[part](value))
