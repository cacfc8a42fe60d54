"""A lost device is opened again, once, and the frame is rendered again with an identical picture."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
TESTS = Path(__file__).parents[1]
STAGES = (
    "loading",
    "recording",
    "between_passes",
    "submitting",
    "waiting",
    "reading",
    "begun_to_read",
    "painting",
    "many",
    "observing",
    "beside_frames",
    "animate",
)
TWICE = re.compile(r"dermis: device: expected .+ to last for a frame, but it was lost twice\. Close .+\.\n")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> subprocess.CompletedProcess[str]:
    """Run all stages in one process, as the library may end it."""
    paths = [str(TESTS), str(TESTS / "frame"), os.environ.get("PYTHONPATH", "")]
    command = [sys.executable, str(TESTS / "frame" / "lost_device.py"), ADAPTER]
    return subprocess.run(
        [*command, str(tmp_path_factory.mktemp("lost"))],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.parametrize("stage", STAGES)
def test_recovered_device_draws_the_same_picture(ran: subprocess.CompletedProcess[str], stage: str) -> None:
    assert f"{stage}: same\n" in ran.stdout, ran.stdout + ran.stderr[-2000:]


@pytest.mark.parametrize("name", ["animate", "render"])
def test_second_device_loss_is_an_error(ran: subprocess.CompletedProcess[str], name: str) -> None:
    assert ran.returncode == 0 and f"{name} twice: 2\n" in ran.stdout
    assert len(TWICE.findall(ran.stderr)) == 2 and "Traceback" not in ran.stderr
    assert "DEVICE LOST" not in ran.stderr  # wgpu's own words


def test_recovered_device_loss_is_logged(ran: subprocess.CompletedProcess[str]) -> None:
    assert re.search(r"note: .+ was lost by its driver; it is opened again", ran.stderr)
