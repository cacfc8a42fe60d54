"""Export of a skin or head by name: files and a report of errors."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from dermis.apps.export.fitting import deviation, fit_d
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.report import Report
from dermis.apps.export.subject import ModelName, Subject, subject_of
from dermis.apps.export.target import Target
from dermis.base.atomic_write import check_output, folder_beside, replacing, replacing_folder
from dermis.base.errors import refuse

REPORT = "export.json"
_PAGE = "README.md"
_SIDE = 2048


def export_skin(
    subject: str | Path | Subject,
    to: str,
    output: str | Path,
    *,
    version: str | None = None,
    variant: str | None = None,
    model: ModelName | None = None,
    profile: str | Path | None = None,
    library: str | Path | None = None,
    side: int = _SIDE,
    adapter: str = "auto",
    **head: Any,
) -> Report:
    """Write a skin or a head for another program, and say how wrong it will be there.

    subject : a profile by name or file, a head, or what `subject_of` has made
    to : a target's name: "unity", "blender" ...
    output : file, or a folder that is made where the name has no suffix; beside a file come a page and JSON
    version : of the program, its newest known by default
    variant : of what it can do, a method of scattering say, its first by default
    model : of the profile, see `true_curve`
    profile : skin of a head
    library : of a page, the folder that npm has installed its library into, which it then holds
    side : of maps that are painted [texels]
    adapter : that paints them
    head : options of `load_head`

    DermisError : an unknown target, version, variant or model, and what cannot be read or written
    """
    target = replace(TARGETS[to].with_variant(variant), side=side, adapter=adapter)
    target = target if library is None else target.with_library(library)
    known, place = target.known_version(version), _checked_place(target, output)
    options = {"model": model, "profile": profile, **head}
    if not isinstance(subject, Subject):
        subject = subject_of(subject, **options)
    elif given := [name for name, value in options.items() if value is not None]:
        refuse(given[0], "a subject that is still to be made", "it came with one", "Leave it out")
    if target.needs_maps:
        subject = subject.painted(side, adapter)
    report = assess(subject, target, known)
    with _staged(place) as inside:
        home = inside.parent if place.suffix else inside
        files = target.write(subject, report.rows, inside, known)
        ends = place.parent if place.suffix else place
        files += _write_report(replace(report, files=tuple(file.relative_to(home) for file in files)), inside)
    return replace(report, files=tuple(ends / file.relative_to(home) for file in files))


def assess(subject: Subject, target: Target, version: str) -> Report:
    """Return the report of an export, before anything is written."""
    rows, naive = target.parameters(subject, version), target.naive(subject, version)
    errors = [deviation(subject.curve, target.shown(one, subject, version)) for one in (rows, naive)]
    return Report(
        target=target.name,
        title=target.title,
        version=version,
        variant=target.variant,
        subject=subject.name,
        model=subject.model,
        rows=rows,
        naive_rows=naive,
        d_mm=fit_d(subject.curve),
        error=errors[0],
        naive_error=errors[1],
        wrong=target.wrong,
        not_run=target.not_run,
    )


def _checked_place(target: Target, output: str | Path) -> Path:
    """Return where to write, if the target can."""
    place = Path(output)
    if place.suffix.lower() not in target.suffixes:
        words = [suffix or "no suffix, for a folder" for suffix in target.suffixes]
        came = f"its suffix is {place.suffix!r}" if place.suffix else "it has no suffix"
        refuse(output, f"a name that ends in {' or '.join(words)}", came, "Choose one of them")
    return check_output(place, target.suffixes) if place.suffix else place


@contextmanager
def _staged(place: Path) -> Iterator[Path]:
    """Provide the place that `Target.write` gets, and move what it wrote to its end if all went well."""
    if not place.suffix:
        with replacing_folder(place, REPORT) as folder:
            yield folder
        return
    with folder_beside(place) as folder:
        yield folder / place.name
        for part in sorted(folder.iterdir(), key=lambda part: part.name == place.name):  # it comes last
            _move(part, place.with_name(part.name))


def _move(part: Path, end: Path) -> None:
    if part.is_dir():
        with replacing_folder(end, REPORT) as folder:
            folder.rmdir()
            part.replace(folder)
        return
    with replacing(end) as trial:
        part.replace(trial)


def _write_report(report: Report, inside: Path) -> list[Path]:
    """Write the page and the numbers in the folder or beside the file; return their paths."""
    single = bool(inside.suffix)
    page = inside.with_name(f"{inside.name}.md") if single else inside / _PAGE
    numbers = inside.with_name(f"{inside.name}.json") if single else inside / REPORT
    page.write_text(report.markdown(), encoding="utf-8")
    numbers.write_text(json.dumps(report.as_json(), indent=2) + "\n", encoding="utf-8")
    return [page, numbers]
