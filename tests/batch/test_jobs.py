"""Job files in the documentation: syntax, and validity of their commands."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path
from string import Template
from typing import Any

import pytest
from cyclopts import App

from dermis.cli import batch as command

PAGE = (Path(__file__).parents[2] / "docs" / "batch.md").read_text("utf-8")
BLOCKS = re.findall(r"```(bash|yaml)\n(.*?)```", PAGE, re.DOTALL)
ENVIRONMENT = {
    "SLURM_ARRAY_TASK_ID": "15",
    "JOB_COMPLETION_INDEX": "15",
    "SKYPILOT_NODE_RANK": "1",
    "SKYPILOT_NUM_NODES": "2",
}
"""Variables that the schedulers set."""


def yaml_of(word: str) -> Any:
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(next(text for kind, text in BLOCKS if kind == "yaml" and word in text))


def slurm() -> str:
    return str(next(text for kind, text in BLOCKS if kind == "bash" and "#SBATCH" in text))


def commands() -> dict[str, str]:
    pod = yaml_of("kind: Job")["spec"]["template"]["spec"]
    return {
        "slurm": slurm().splitlines()[-1].removeprefix("srun "),
        "kubernetes": pod["containers"][0]["args"][0],
        "skypilot": yaml_of("num_nodes")["run"],
    }


@pytest.mark.parametrize("kind", ["slurm", "kubernetes", "skypilot"])
def test_commands_work_with_the_variables_of_schedulers(kind: str) -> None:
    """Every placeholder has a value, and the parser accepts every argument."""
    app = App(name="dermis", result_action="return_value")
    app.command(command.batch, name="batch")
    words = shlex.split(Template(commands()[kind]).substitute(ENVIRONMENT))
    assert words[:2] == ["dermis", "batch"]
    function, bound, _ = app.parse_args([*words[1:], "--dry-run"], exit_on_error=False, print_error=False)
    arguments = bound.arguments
    assert function is command.batch and arguments["dry_run"] and arguments["output"] == Path("/shared/faces")
    index, count = command._parse_selection("--shard", arguments["shard"])
    assert (index, count) == ((1, 2) if kind == "skypilot" else (15, 16))


def test_there_is_one_job_per_part() -> None:
    job = yaml_of("kind: Job")
    assert job["apiVersion"] == "batch/v1" and job["spec"]["completionMode"] == "Indexed"
    assert job["spec"]["completions"] == 16 and "/16" in commands()["kubernetes"]
    pod = job["spec"]["template"]["spec"]
    mounted = {one["name"] for one in pod["containers"][0]["volumeMounts"]}
    assert mounted == {one["name"] for one in pod["volumes"]}
    first, last = re.findall(r"--array=(\d+)-(\d+)", slurm())[0]
    assert (int(first), int(last)) == (0, 15) and "/16" in commands()["slurm"]
    assert yaml_of("num_nodes")["num_nodes"] == 2


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_the_script_is_valid_bash() -> None:
    assert slurm().startswith("#!/bin/bash\n")
    for text in (slurm(), commands()["kubernetes"], commands()["skypilot"]):
        subprocess.run(["bash", "-n", "-c", text], check=True, timeout=30)
