"""Dockerfile, conda recipe, release workflow and install lines agree with pyproject.toml and each other."""

from __future__ import annotations

import re
import shlex
import tomllib
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from dermis.cli import COMMANDS
from dermis.gpu.drivers import all_driver_advice

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = DOCUMENT["project"]
DOCKERFILE = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text("utf-8"))
RECIPE = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text("utf-8"))
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8"))
INSTALLING = (ROOT / "docs" / "install.md").read_text("utf-8")
CLASSIFIED = [name for name in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", name)]
PYTHON_VERSIONS = [name.rpartition(" ")[2] for name in CLASSIFIED]
SETUP = (ROOT / "tools" / "setup.sh").read_text("utf-8")
(DRIVER_PACKAGES,) = re.findall(r'^drivers="(.+)"$', SETUP, re.MULTILINE)
CONDA_NAMES = {"wgpu": "wgpu-py", "OpenEXR": "openexr-python"}  # openexr is the library for C++ there


def docker(instruction: str) -> list[str]:
    """Return the arguments of each use of an instruction in the Dockerfile."""
    return re.findall(rf"^{instruction} (.+)$", DOCKERFILE, re.MULTILINE)


def section(title: str) -> str:
    """Return a section of docs/install.md as one line."""
    return " ".join(INSTALLING.partition(f"## {title}\n")[2].partition("\n## ")[0].split())


def table(page: str, head: str) -> list[list[str]]:
    """Return the cells of a table."""
    rows = page.partition(f"| {head} |\n|---|---|\n")[2].partition("\n\n")[0].splitlines()
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def steps(job: str) -> list[dict[str, Any]]:
    return list(WORKFLOW["jobs"][job]["steps"])


def commands(job: str) -> str:
    return "\n".join(step.get("run", "") for step in steps(job))


def test_python_versions_are_consecutive_and_start_at_the_required_one() -> None:
    minors = [int(version.partition(".")[2]) for version in PYTHON_VERSIONS]
    assert minors == list(range(minors[0], minors[0] + len(minors)))
    assert PROJECT["requires-python"] == f">={PYTHON_VERSIONS[0]}"
    named = re.search(r"\$\{PYTHON:-python3 (.+)\}; do", SETUP)
    assert named and named[1].split() == [f"python{version}" for version in reversed(PYTHON_VERSIONS)]
    assert f"Python {PYTHON_VERSIONS[0]} to {PYTHON_VERSIONS[-1]}" in " ".join(INSTALLING.split())


def test_image_has_a_supported_python_the_drivers_and_the_command() -> None:
    (base,) = docker("FROM")
    python = re.fullmatch(r"python:(3\.\d+)-slim-\w+", base)
    assert python and python[1] in PYTHON_VERSIONS
    (apt,) = [command for command in docker("RUN") if "apt-get install" in command]
    assert set(DRIVER_PACKAGES.split()) <= set(shlex.split(apt))
    (entry,) = docker("ENTRYPOINT")
    assert entry == '["dermis"]' and "dermis" in PROJECT["scripts"]
    assert docker("USER") == ["1000"] and any("useradd --uid 1000" in command for command in docker("RUN"))
    ((name, _, extras),) = (line.partition("=") for line in docker("ARG"))
    assert name == "EXTRAS" and set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    assert all(f"`{extra}`" in section("Docker") for extra in extras.split(","))


def test_image_copies_all_files_that_the_wheel_is_built_from() -> None:
    copied = {name for line in docker("COPY") for name in line.split()[:-1]}
    wheel = DOCUMENT["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = {"pyproject.toml", PROJECT["readme"], *PROJECT["license-files"], *wheel["force-include"]}
    needed |= {package.partition("/")[0] for package in wheel["packages"]}
    assert copied == needed | {"requirements.lock"}
    assert all((ROOT / name).exists() for name in copied)
    rules = [line for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line[:1] != "#"]
    assert rules[0] == "*" and {line[1:] for line in rules if line[0] == "!"} == copied
    ignored = [line for line in rules[1:] if line[0] != "!"]
    assert not [name for name in copied for rule in ignored if fnmatch(name, rule)]


def test_recipe_requires_the_same_packages_in_the_same_versions() -> None:
    wanted = {}
    for requirement in map(Requirement, PROJECT["dependencies"]):
        wanted[CONDA_NAMES.get(requirement.name, requirement.name.lower())] = requirement.specifier
    run = [
        line.replace("${{ python_min }}", RECIPE["context"]["python_min"])
        for line in RECIPE["requirements"]["run"]
    ]
    assert {line.split()[0]: SpecifierSet(line.split()[1]) for line in run} == wanted | {
        "python": SpecifierSet(PROJECT["requires-python"])
    }
    host = {line.partition(" ")[0]: line.partition(" ")[2] for line in RECIPE["requirements"]["host"]}
    (backend,) = map(Requirement, DOCUMENT["build-system"]["requires"])
    assert SpecifierSet(host[backend.name]) == backend.specifier


def test_recipe_describes_the_project() -> None:
    assert RECIPE["package"]["name"] == PROJECT["name"]
    assert RECIPE["context"]["version"] == PROJECT["version"]
    entry_points = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == entry_points
    about = RECIPE["about"]
    assert (about["summary"], about["license"]) == (PROJECT["description"], PROJECT["license"])
    assert about["license_file"] == PROJECT["license-files"]
    assert (ROOT / "packaging" / "conda" / RECIPE["source"]["path"]).resolve() == ROOT


def test_release_is_published_by_trust_after_all_checks() -> None:
    assert WORKFLOW[True] == {"push": {"tags": ["v*"]}}  # YAML 1.1 reads the key "on" as true
    publish = WORKFLOW["jobs"]["publish"]
    assert set(publish["needs"]) == set(WORKFLOW["jobs"]) - {"publish"}
    assert publish["permissions"] == {"id-token": "write"} and WORKFLOW["permissions"] == {"contents": "read"}
    assert steps("publish")[-1]["uses"].startswith("pypa/gh-action-pypi-publish@")
    assert "secrets." not in (ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8")
    for command in ("python -m build", "twine check", "check-wheel-contents", "published.py index --check"):
        assert command in commands("build")


def test_release_is_installed_with_each_python_version() -> None:
    assert WORKFLOW["jobs"]["install"]["strategy"]["matrix"]["python-version"] == PYTHON_VERSIONS
    used = [
        step["with"]["python-version"] for step in steps("build") if "setup-python" in step.get("uses", "")
    ]
    assert used and set(used) <= set(PYTHON_VERSIONS)
    assert DRIVER_PACKAGES in commands("install")
    tried = re.findall(r"^(\w+) (\w+) --adapter cpu", commands("install"), re.MULTILINE)
    assert {command for command, _ in tried} == set(PROJECT["scripts"])
    assert {name for _, name in tried} == {"doctor", "render"} <= set(COMMANDS)


def test_extras_are_listed_and_exist() -> None:
    cells = table(INSTALLING, "extra | for")
    listed = {name for cell, _ in cells for name in re.findall(r"`(\w+)`", cell)}
    assert listed == set(PROJECT["optional-dependencies"])


def test_drivers_of_the_page_are_those_of_the_messages() -> None:
    rows = table(INSTALLING.replace("`", ""), "system | what to install")
    assert rows == [[system.partition(" ")[2], advice] for system, advice in all_driver_advice().items()]
    assert DRIVER_PACKAGES in rows[0][1]


@pytest.fixture
def published(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the module tools/published.py."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    import published

    return published


def test_all_pages_have_the_same_install_lines(published: Any) -> None:
    texts = {path: path.read_text("utf-8") for path in published.pages()}
    for text in texts.values():  # all lines that install dermis have a form that the script rewrites
        for line in re.finditer(r"pip install ['\"]?(?:\.|dermis)", text):
            assert published.INSTALL.match(text, line.start()), text[line.start() :][:60]
        for extras in re.findall(r'(?:\.|dermis|whl\)?)\[([a-z,]+)\]"', text):
            assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    rewritten = {
        source: [published.rewrite(text, source) for text in texts.values()] for source in published.PACKAGES
    }
    assert list(texts.values()) in rewritten.values(), "run python tools/published.py with the right source"
    for path in (ROOT / "README.md", ROOT / "docs" / "install.md"):
        assert sum(texts[path].count(sentence) for sentence in published.SENTENCES.values()) == 1


def test_switch_of_the_install_lines_is_reversible(published: Any) -> None:
    line = 'pip install .\n`pip install ".[viewer,video]"`'
    rest = ", `pip install -e .`, pip install dist/dermis-*.whl"
    changed = 'pip install dermis\n`pip install "dermis[viewer,video]"`'
    assert published.rewrite(line + rest, "index") == changed + rest
    assert published.rewrite(changed + rest, "checkout") == line + rest
