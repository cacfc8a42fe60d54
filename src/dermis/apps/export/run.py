"""Export of a skin or head to a program, with a report of what it becomes there."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dermis.apps.export.fitting import Deviation, deviation, fit_d
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import ModelName, Subject, subject_of
from dermis.apps.export.target import Rows, Target, Value
from dermis.base.atomic_write import check_output, folder_beside, replacing, replacing_folder
from dermis.base.errors import refuse
from dermis.optics.media import Floats

_NOTABLE = 0.05  # of the light at the wrong radius
_CHANNELS = "red", "green", "blue"
_ERRORS = {
    "cdf": "most light at the wrong radius, of 1",
    "edge": "most beside an edge of light, of 1",
    "energy": "too much or too little light in all, relative",
}
REPORT = "export.json"
_PAGE = "README.md"
_SIDE = 2048


@dataclass(frozen=True)
class Report:
    """One export.

    target, title, version, variant : of the program; the variant is "" where there is only one
    subject, model : name, and where its profile comes from
    rows : parameters that were written
    naive_rows : parameters that a user would have typed
    d_mm : (3,) of the one lobe that is nearest to the profile [mm]
    error, naive_error : against the profile, by the target's own formulas
    wrong : what stays wrong, in words
    not_run : whether nobody has run the program with it
    files : all that were written
    """

    target: str
    title: str
    version: str
    variant: str
    subject: str
    model: str
    rows: Rows
    naive_rows: Rows
    d_mm: Floats
    error: Deviation
    naive_error: Deviation
    wrong: str
    not_run: bool
    files: tuple[Path, ...] = ()

    def as_json(self) -> dict[str, object]:
        """Return everything in plain numbers, lists and words."""
        return {
            "target": self.target,
            "version": self.version,
            **({"variant": self.variant} if self.variant else {}),
            "subject": self.subject,
            "model": self.model,
            "parameters": {row.name: row.value for row in self.rows},
            "units": {row.name: row.unit for row in self.rows},
            "d_mm": [round(float(d), 6) for d in self.d_mm],
            "error": self.error.as_json(),
            "naive_parameters": {row.name: row.value for row in self.naive_rows},
            "naive_error": self.naive_error.as_json(),
            "wrong": " ".join(self.words()),
            "run": not self.not_run,
            "files": [str(file) for file in self.files],
        }

    def lines(self, naive: bool = False) -> list[str]:
        """Return the lines of the report.

        naive : also what a user would have typed
        """
        what = " ".join(filter(None, (self.title, self.version, self.variant)))
        head = f"{self.subject}, profile by {self.model}, for {what}"
        lines = [head, *(["not run: by published meanings"] if self.not_run else []), "", *_table(self.rows)]
        if naive:
            lines += ["", "what one would type", *_table(self.naive_rows)]
        lines += ["", f"{'':12}" + "".join(f"{name:>9}" for name in _CHANNELS)]
        lines.append(f"{'d [mm]':12}{_numbers(self.d_mm)}  of the nearest lobe")
        for name, meaning in _ERRORS.items():
            lines.append(f"{name:12}{_numbers(getattr(self.error, name))}  {meaning}")
            lines.append(f"{'  naive':12}{_numbers(getattr(self.naive_error, name))}  as one would type it")
        return [*lines, "", *self.words()]

    def words(self) -> list[str]:
        """Return what stays wrong, of this skin and of the target."""
        worst = int(self.error.cdf.argmax())
        share = float(self.error.cdf[worst])
        if share < _NOTABLE:
            return [self.wrong]
        what = f"the program cannot hold this profile: {share:.0%} of the {_CHANNELS[worst]} light leaves"
        return [f"Whatever is typed, {what} at another radius.", self.wrong]

    def markdown(self) -> str:
        """Return the report as a Markdown page."""
        lines = [f"# {_plain(self.subject)} for {self.title} {self.version}".rstrip(), ""]
        lines += [f"```\n{chr(10).join(map(_plain, self.lines(naive=True)))}\n```", ""]
        return "\n".join(lines)


def _table(rows: Rows) -> Sequence[str]:
    cells = [(row.name, shown(row.value), row.unit, row.meaning) for row in rows]
    wide = [max((len(line[i]) for line in cells), default=0) for i in range(3)]
    return ["  ".join([*(one.ljust(wide[i]) for i, one in enumerate(line[:3])), line[3]]) for line in cells]


def shown(value: Value) -> str:
    """Return a parameter's value as it is printed."""
    if isinstance(value, tuple):
        return ", ".join(f"{x:.4g}" for x in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _numbers(values: Floats) -> str:
    return "".join(f"{x:9.4f}" for x in values)


def _plain(words: str) -> str:
    """Return words without what would end a line or a block of code."""
    return words.replace("`", "'").replace("\n", " ").replace("\r", " ")


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
