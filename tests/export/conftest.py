"""Subjects that the tests of exports share."""

from __future__ import annotations

import pytest

from dermis.apps.export.subject import Subject, subject_of


@pytest.fixture(scope="session")
def skin1() -> Subject:
    return subject_of("skin1")


@pytest.fixture(scope="session")
def dj3() -> Subject:
    return subject_of("dj3")
