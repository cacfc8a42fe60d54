"""Commands, Python code and files in the documentation are valid, and the scripts start."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from cyclopts import App

import dermis
from dermis.base.command_line import make_app, run_app
from dermis.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "benchmarks" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SCRIPTS = [path for folder in ("tools", "benchmarks") for path in sorted((ROOT / folder).glob("*.py"))]
FENCE = re.compile(r"^ *```(?P<kind>\w*)\n(?P<text>.*?)^ *```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(dermis [^`]+)`")
FILE = re.compile(r"`(?:python )?([\w./-]+/[\w.-]+\.(?:py|wgsl|toml|csv|json|bib|md))`")
BARE = re.compile(r"`(\w+\.(?:py|wgsl))`")
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
FOLDERS = ("src", "gallery", "tools", "benchmarks", "docs", "tests")
NAMES = {path.name for folder in FOLDERS for path in (ROOT / folder).rglob("*.*")}
MADE_UP = {"src/dermis/apps/viewer/panel/sections/name.py"}  # an example's name


def commands(page: Path) -> list[str]:
    """Return lines that begin with `dermis` in code blocks, and such inline code."""
    text = page.read_text(encoding="utf-8")
    fenced = [line.strip() for found in FENCE.finditer(text) for line in found["text"].splitlines()]
    return [line for line in [*fenced, *INLINE.findall(FENCE.sub("", text))] if line.startswith("dermis ")]


def app() -> App:
    """Return the command line as made by `dermis.cli`."""
    made = App(name="dermis", result_action="return_value")
    for name in COMMANDS:
        made.command(f"dermis.cli.{name}:{name}", name=name)
    return made


def words(command: str) -> list[str]:
    """Return the arguments of a command, without comments, redirections, ellipses and optional brackets."""
    shown = command.replace("\\|", "|").split("...")[0].split(" > ")[0]
    typed = shlex.split(re.sub(r"[\[\]]", "", shown), comments=True)[1:]
    return ["8765" if word == "N" else word for word in typed]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_documented_commands_are_parsed(page: Path) -> None:
    made, refused = app(), []
    for command in commands(page):
        name, *rest = words(command)
        if not rest or rest == ["--help"] or name == "X":
            assert name in COMMANDS, command
            continue
        try:
            made.parse_args([name, *rest], exit_on_error=False, print_error=False)
        except Exception as error:
            refused.append(f"{command}: {error}")
    assert refused == []


def test_the_readme_lists_every_command() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `dermis (\w+)", text, re.MULTILINE)
    assert set(listed) == set(COMMANDS)


def test_invalid_options_would_be_detected() -> None:
    with pytest.raises(Exception, match="frobnicate"):
        app().parse_args(["render", "--frobnicate"], exit_on_error=False, print_error=False)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_documented_python_names_exist(page: Path) -> None:
    blocks = [found["text"] for found in FENCE.finditer(page.read_text("utf-8")) if found["kind"] == "python"]
    for node in (node for block in blocks for node in ast.walk(ast.parse(block))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "dermis":
            assert node.attr in dermis.__all__


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_documented_files_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    folders = [ROOT, ROOT / "src" / "dermis", page.parent]
    folders += [folder for folder in (ROOT / "src" / "dermis").iterdir() if folder.is_dir()]
    missing = [
        name
        for name in set(FILE.findall(text)) - MADE_UP
        if not any((folder / name).is_file() for folder in folders)
    ]
    missing += [name for name in BARE.findall(text) if name not in NAMES]
    missing += [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    assert missing == []


RUN_ALL = """
import contextlib, io, runpy, sys
for script in sys.argv[2:]:
    sys.path.insert(0, script.rpartition("/")[0])
    for option in ("--help", "--frobnicate"):
        sys.argv, said = [script, option], io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                runpy.run_path(script, run_name="__main__")
                code = None
            except SystemExit as end:
                code = end.code
        shown = said.getvalue()
        sound = shown.lower().startswith("usage:") or (option, shown.count("\\n")) == ("--frobnicate", 1)
        if code != (2 if option == "--frobnicate" else 0) or not sound:
            print(script, option, code, shown[-200:])
    sys.path.pop(0)
"""


def test_scripts_explain_themselves_and_refuse_other_options() -> None:
    """All in one process; scripts import extras only when they run."""
    scripts = [str(path) for path in SCRIPTS if '__name__ == "__main__"' in path.read_text("utf-8")]
    command = [sys.executable, "-c", RUN_ALL, "", *scripts]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert scripts and (run.returncode, run.stdout) == (0, ""), run.stdout + run.stderr


@pytest.mark.parametrize("name", ["accuracy", "engines", "peers"])
def test_commands_of_the_validation_explain_themselves(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    module = f"dermis.apps.validation.{name}.__main__"
    peer_report = {"report": ("dermis.apps.validation.peers.report:write_peer_report", "")}
    places = [path for path, _ in getattr(import_module(module), "COMMANDS", peer_report).values()]
    for place in places:
        folder, _, function = place.partition(":")
        command = make_app(function, None)
        command.default(getattr(import_module(folder), function))
        assert run_app(command, ["--help"]) == 0 and run_app(command, ["--frobnicate"]) == 2
    said = capsys.readouterr()
    assert said.out.count("Usage:") == said.err.count("frobnicate: expected an option") == len(places)
