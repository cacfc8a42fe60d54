"""Skins shared by tests of exports."""

from __future__ import annotations

import pytest

from dermis.apps.export.subject import Subject, load_subject


@pytest.fixture(scope="session")
def skin1() -> Subject:
    return load_subject("skin1")


@pytest.fixture(scope="session")
def dj3() -> Subject:
    return load_subject("dj3")
