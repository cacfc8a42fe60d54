"""The command as a program: help, start-up, exit codes, and the output of the two small commands."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from small_head import without_colour_note

from dermis.base.citations import parse_bibtex
from dermis.cli.options import option_name
from dermis.scene.frozen_model import fields_under
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.talk_comparisons import COMPARISONS_HEADING

Run = Callable[..., Any]


def _process(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "dermis", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def test_an_error_exits_with_status_2_and_leaves_no_files(tmp_path: Path) -> None:
    ended = _process("render", "nobody.obj", "-o", "a.png", folder=tmp_path)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("dermis: nobody.obj: expected ") and ended.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_process_renders(folder: Path) -> None:
    ended = _process(
        "render",
        "head.obj",
        "-o",
        "a.png",
        "--size",
        "64x64",
        "--atlas",
        "64",
        "--adapter",
        "cpu",
        "--json",
        folder=folder,
    )
    assert (ended.returncode, without_colour_note(ended.stderr)) == (0, "")
    assert json.loads(ended.stdout)["image"] == "a.png"
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "words",
    [
        ["--help"],
        *([name, "--help"] for name in ("render", "batch", "export", "profile", "unmix", "fit", "cite")),
        ["--version"],
    ],
)
def test_help_loads_nothing_heavy(words: list[str]) -> None:
    """The help of a command with model options needs the model, and therefore pydantic."""
    heavy = {"numpy", "wgpu", "trimesh", "scipy"} | ({"pydantic"} if len(words) == 1 else set())
    code = (
        f"import sys, dermis.cli; sys.argv = ['dermis', *{words}]\n"
        "try: dermis.cli.main()\n"
        f"except SystemExit: heavy = {heavy} & set(sys.modules)\n"
        "print(heavy or 'light', file=sys.stderr)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stderr.strip() == "light"
    assert ended.stdout


def test_general_help_names_each_command(run: Run) -> None:
    ended = run("--help")
    assert (ended.code, ended.stderr) == (0, "")
    for command in ("render", "doctor", "cite"):
        line = next(line for line in ended.stdout.splitlines() if f" {command} " in line)
        assert len(line.split()) > 5  # with a sentence of what it does


@pytest.mark.parametrize("command", ["render", "animate", "batch", "compare", "doctor", "cite"])
def test_help_of_each_command_shows_examples(run: Run, command: str) -> None:
    ended = run(command, "--help")
    assert (ended.code, ended.stderr) == (0, "")
    assert ended.stdout.count(f"    dermis {command}") >= 2


def test_help_of_render_explains_every_option(run: Run) -> None:
    text = run("render", "--help").stdout
    for line in text.splitlines():
        option = line.removeprefix("│ ").split(" ")[0]
        assert not (option.startswith("--") and len(line.strip(" │").split()) < 4), line
    assert text.count("│ --") >= 24


def test_comparisons_of_the_talk_are_a_group_of_their_own_after_all_others(run: Run) -> None:
    *before, last = re.split(r"╭─+ ", run("render", "--help").stdout)
    assert last.startswith(f"{COMPARISONS_HEADING} ")
    options = {
        option_name(name) for kind in (Skin, Settings) for name in fields_under(COMPARISONS_HEADING, kind)
    }
    assert set(re.findall(r"│ (--[\w-]+)", last)) == options
    assert not options & set(re.findall(r"--[\w-]+", "".join(before)))


def test_version(run: Run) -> None:
    assert run("--version").stdout == f"{version('dermis')}\n"


def test_cite_prints_the_works_behind_the_technique(run: Run) -> None:
    ended = run("cite")
    assert (ended.code, ended.stderr) == (0, "")
    keys = set(parse_bibtex(ended.stdout))
    assert {"dEonLuebke2007", "JensenBuhler2002", "Kelemen2001", "Beckmann1963", "DonnerJensen2005"} <= keys
    assert {"Schlick1994", "OlanoBaker2010", "Williams1978"} <= keys
    assert not {"Penner2011", "Jimenez2015", "Green2004", "Karis2013", "Baum1989"} & keys


@pytest.mark.parametrize(
    ("words", "has", "lacks"),
    [
        (("--technique", "none"), set(), {"Geusebroek2003", "JensenBuhler2002"}),
        (("--technique", "one-blur"), {"Green2004", "Dudash2007"}, {"JensenBuhler2002"}),
        (("--technique", "screen-space"), {"Jimenez2015"}, {"Geusebroek2003"}),
        (("--technique", "pre-integrated"), {"Penner2011"}, {"Geusebroek2003"}),
        (("--transmission", "none"), {"Geusebroek2003"}, {"JensenBuhler2002"}),
        (("--specular", "none"), set(), {"Kelemen2001", "Schlick1994"}),
        (("--specular", "none", "--seams", "alpha"), {"Dudash2007"}, set()),
        (("--specular", "none", "--seams", "stitch"), set(), {"Dudash2007"}),
        (("--against", "surface-integral"), {"Turk1992", "Andersson2020", "Penner2011"}, {"Bank1985"}),
        (("--against", "heat", "--technique", "none"), {"Bank1985", "Andersson2020"}, {"Penner2011"}),
        (
            ("--scene", "scene.toml"),
            {"Baum1989", "Hable2010", "Jimenez2015", "Smith1967"},
            {"OlanoBaker2010"},
        ),
        (("--scene", "scene.toml", "--technique", "none"), {"Baum1989"}, {"Jimenez2015"}),
    ],
)
def test_cite_names_the_techniques_in_use(
    run: Run, folder: Path, words: tuple[str, ...], has: set[str], lacks: set[str]
) -> None:
    (folder / "scene.toml").write_text(
        '[head]\nname = "head.obj"\n[skin]\nspecular = "torrance-sparrow-smith"\n'
        '[render]\ntechnique = "screen-space"\ntone = "filmic"\n'
        '[[lights]]\nkind = "rectangle"\nposition = [0, 0, 900]\n'
    )
    ended = run("cite", *words)
    assert (ended.code, ended.stderr) == (0, "")
    keys = set(parse_bibtex(ended.stdout))
    assert has <= keys and not lacks & keys


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("Kelemen2001", "--technique", "none"), "--technique: expected no such option with keys"),
        (("--against", "heat", "--seams", "alpha"), "--seams: expected no such option with --against"),
    ],
)
def test_cite_refuses_options_without_effect(run: Run, words: tuple[str, ...], says: str) -> None:
    ended = run("cite", *words)
    assert (ended.code, ended.stdout) == (2, "") and says in ended.stderr


def test_cite_adds_the_works_behind_a_profile(run: Run) -> None:
    keys = list(parse_bibtex(run("cite", "--profile", "light").stdout))
    assert keys[0] == "dEonLuebke2007"
    assert {"DonnerJensen2006", "Kienle1998"} <= set(keys)


def test_cite_names_the_surface_model_in_use(run: Run) -> None:
    keys = list(parse_bibtex(run("cite", "--specular", "torrance-sparrow-smith").stdout))
    assert {"TorranceSparrow1967", "Smith1967"} <= set(keys) and "Beckmann1963" not in keys


def test_cite_prints_the_works_asked_for(run: Run) -> None:
    ended = run("cite", "Kelemen2001", "Donner2008")
    assert list(parse_bibtex(ended.stdout)) == ["Kelemen2001", "Donner2008"]


def test_cite_refuses_an_unknown_key(run: Run) -> None:
    ended = run("cite", "Nobody1900")
    assert (ended.code, ended.stdout) == (2, "")
    assert "'Nobody1900'" in ended.stderr and "Kelemen2001" in ended.stderr
