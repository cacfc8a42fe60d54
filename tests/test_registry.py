"""Registries: imported on first use, extensible by other packages, and strict about names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import pytest

from dermis.base.errors import DermisError
from dermis.base.registry import RegisteredName, Registry
from dermis.scene.field_errors import InvalidFieldsError
from dermis.scene.frozen_model import FrozenModel, field_choices, field_help
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

ANIMALS: Registry[Any] = Registry("animal", {"cat": 1, "root": "math:sqrt"})


class Owner(FrozenModel):
    """Model of a person with an animal."""

    animal: Annotated[str, RegisteredName(ANIMALS)] = "cat"
    """What it owns."""


@pytest.fixture
def wet() -> Iterator[None]:
    """Register a technique of another package."""
    TECHNIQUES.register("wet", "math:pi", "shines all over")
    yield
    del TECHNIQUES._entries["wet"], TECHNIQUES._summaries["wet"]


def test_entries_are_imported_on_first_use() -> None:
    assert ANIMALS.names == ("cat", "root") and len(ANIMALS) == 2 and "dog" not in ANIMALS
    assert ANIMALS["cat"] == 1 and ANIMALS["root"](9.0) == 3.0


def test_unknown_names_are_refused() -> None:
    with pytest.raises(DermisError, match="animal: expected one of cat, root, but got 'dog'"):
        ANIMALS["dog"]
    with pytest.raises(InvalidFieldsError, match="animal: expected one of cat, root, but got 'dog'"):
        Owner(animal="dog")
    with pytest.raises(InvalidFieldsError, match="got 5"):
        Owner(animal=5)


def test_duplicate_names_are_refused() -> None:
    with pytest.raises(DermisError, match="animal cat: expected an unused name"):
        ANIMALS.register("cat", 2)


def test_names_from_other_packages_are_accepted(wet: None) -> None:
    assert Settings(technique="wet").technique == "wet"
    assert field_choices(Settings, "technique")[-1] == "wet"
    assert field_help(Settings, "technique").endswith("wet: shines all over.")
