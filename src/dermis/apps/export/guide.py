"""README of an export: files, import into the program, picture of the expected result, and licence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path, PurePath
from urllib.parse import quote

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import EXPORT_JSON_MEANING, Target

PREVIEW_SUFFIX = "preview.png"
_PREVIEW_MEANING = {f"*{PREVIEW_SUFFIX}": "the head in the light rig `studio`, rendered by dermis"}
_COMMON_FILES = {
    "export.json": EXPORT_JSON_MEANING,
    "*.json": EXPORT_JSON_MEANING,
    "*_colour.png": "diffuse reflectance of the skin; sRGB",
    "*_normal.png": "normals in tangent space, green up; linear",
    "*_roughness.png": "Beckmann's m of the skin; linear",
    "*_specular.png": "specular strength of the skin; linear",
    "*_height.png": "relief of the skin, 16 bits; linear",
    "*_eye.png": "colour of the eyeball; sRGB",
    "*parts_*.png": "pictures of parts that are not skin, such as clothes of a scanned head",
}
"""Contents of files by the patterns of their names, for all targets."""
_NO_RIGHTS = "The authors of dermis claim no rights in the written files."


def file_meaning(target: Target, file_name: str) -> str:
    """Return what a file of an export contains; an empty text if neither target nor package describe it."""
    for patterns in (_PREVIEW_MEANING, target.file_meanings, _COMMON_FILES):
        for pattern, meaning in patterns.items():
            if fnmatch(file_name, pattern) or fnmatch(PurePath(file_name).name, pattern):
                return meaning
    return ""


def guide_lines(target: Target, subject: Subject, files: Iterable[Path], picture: str) -> list[str]:
    """Return the first sections of the README as lines of Markdown.

    files : paths of the written files, relative to the folder of the README; the main file is first
    picture : name of the picture of the expected result; empty without a picture
    """
    files = list(files)
    link = f"![{subject.identifier}]({quote(picture)})"
    lines = ["It should look like this:", "", link, ""] if picture else []
    if target.untested:
        lines += [f"Not run in {target.title}: the files follow its published documentation.", ""]
    lines += ["## Files", "", "| file | content |", "|---|---|", *_file_rows(target, files), ""]
    if steps := target.steps(subject, files):
        numbered = [f"{number}. {step}" for number, step in enumerate(steps, 1)]
        lines += [f"## Import into {target.title}", "", *numbered, ""]
    return [*lines, "## Licence", "", licence_text(subject, target), "", "## Parameters and errors", ""]


def _file_rows(target: Target, files: Iterable[Path]) -> Iterator[str]:
    """Yield a row of the table for each file; numbered files with the same content share one row."""
    rows = dict[str, list[str]]()
    for file in sorted(files):
        name = file.as_posix()
        meaning = file_meaning(target, name)
        key = meaning if any(letter.isdigit() for letter in file.stem[-3:]) else f"{meaning}\n{name}"
        rows.setdefault(key, []).append(name)
    for key, names in rows.items():
        more = f" and {len(names) - 1} more like it" if len(names) > 1 else ""
        shown = f"`{names[0]}`{more}".replace("|", "\\|")
        yield f"| {shown} | {key.partition(chr(10))[0]} |"


def licence_text(subject: Subject, target: Target) -> str:
    """Return sentences on the licences of the exported head and of scripts in the files."""
    texts = []
    if subject.head is not None:
        credit = subject.head.attribution or "as its owner states; the file of the head names none"
        texts.append(f"Head: {credit}.")
    if target.licence:
        texts.append(f"The page contains or loads {target.title}, {target.licence}.")
    return " ".join([*texts, _NO_RIGHTS])


def write_preview(subject: Subject, file: Path, width: int, adapter: str) -> Path:
    """Render the scene of a subject, with the camera and lights that exports of scenes contain.

    width : width and height of the picture [pixel]
    """
    from dermis.frame.renderer import render
    from dermis.images.io import write_image
    from dermis.scene.resolved_atlas import atlas_side_for_picture
    from dermis.scene.settings import Settings

    assert subject.scene is not None
    size = width, width
    side = atlas_side_for_picture(subject.scene, Settings(size=size))
    write_image(file, render(subject.scene, adapter=adapter, size=size, atlas=side, background="gradient"))
    return file
