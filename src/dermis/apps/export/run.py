"""Export of a skin or head to a program, with a report of what it becomes there."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dermis.apps.export.fitting import CurveError, curve_error, fit_burley_width
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import ModelName, Subject, load_subject
from dermis.apps.export.target import Parameters, Target, Value
from dermis.base.atomic_write import atomic_file, atomic_folder, check_output, temporary_folder
from dermis.base.errors import refuse
from dermis.optics.media import Floats

_NOTABLE_ERROR = 0.05  # fraction of the light that leaves at the wrong radius
_CHANNELS = "red", "green", "blue"
_ERRORS = {
    "cdf": "largest fraction of the light that leaves at the wrong radius",
    "edge": "largest error beside an edge of light",
    "energy": "relative error of the total light",
}
REPORT_FILE = "export.json"
_PAGE_FILE = "README.md"
_MAP_SIDE = 2048


@dataclass(frozen=True)
class ExportReport:
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
    parameters: Parameters
    naive_parameters: Parameters
    d_mm: Floats
    error: CurveError
    naive_error: CurveError
    limitations: str
    untested: bool
    files: tuple[Path, ...] = ()

    def as_json(self) -> dict[str, object]:
        """Return everything in plain numbers, lists and words."""
        return {
            "target": self.target,
            "version": self.version,
            **({"variant": self.variant} if self.variant else {}),
            "subject": self.subject,
            "model": self.model,
            "parameters": {one.name: one.value for one in self.parameters},
            "units": {one.name: one.unit for one in self.parameters},
            "d_mm": [round(float(d), 6) for d in self.d_mm],
            "error": self.error.as_json(),
            "naive_parameters": {one.name: one.value for one in self.naive_parameters},
            "naive_error": self.naive_error.as_json(),
            "wrong": " ".join(self.limitation_texts()),
            "run": not self.untested,
            "files": [str(file) for file in self.files],
        }

    def lines(self, naive: bool = False) -> list[str]:
        """Return the lines of the report.

        naive : also what a user would have typed
        """
        target = " ".join(filter(None, (self.title, self.version, self.variant)))
        lines = [f"{self.subject}, profile by {self.model}, for {target}"]
        lines += ["not tested: parameters follow published documentation"] if self.untested else []
        lines += ["", *_table(self.parameters)]
        if naive:
            lines += ["", "naive parameters", *_table(self.naive_parameters)]
        lines += ["", f"{'':12}" + "".join(f"{name:>9}" for name in _CHANNELS)]
        lines.append(f"{'d [mm]':12}{_numbers(self.d_mm)}  width of the fitted Burley profile")
        for name, meaning in _ERRORS.items():
            lines.append(f"{name:12}{_numbers(getattr(self.error, name))}  {meaning}")
            lines.append(
                f"{'  naive':12}{_numbers(getattr(self.naive_error, name))}  with the naive parameters"
            )
        return [*lines, "", *self.limitation_texts()]

    def limitation_texts(self) -> list[str]:
        """Return what stays wrong, of this skin and of the target."""
        worst = int(self.error.cdf.argmax())
        error = float(self.error.cdf[worst])
        if error < _NOTABLE_ERROR:
            return [self.limitations]
        text = f"No parameters reproduce this profile: {error:.0%} of the {_CHANNELS[worst]} light leaves"
        return [f"{text} at another radius.", self.limitations]

    def markdown(self) -> str:
        """Return the report as a Markdown page."""
        lines = [f"# {_single_line(self.subject)} for {self.title} {self.version}".rstrip(), ""]
        lines += [f"```\n{chr(10).join(map(_single_line, self.lines(naive=True)))}\n```", ""]
        return "\n".join(lines)


def _table(parameters: Parameters) -> Sequence[str]:
    rows = [(one.name, format_parameter(one.value), one.unit, one.meaning) for one in parameters]
    widths = [max((len(row[i]) for row in rows), default=0) for i in range(3)]
    return ["  ".join([*map(str.ljust, row[:3], widths), row[3]]) for row in rows]


def format_parameter(value: Value) -> str:
    """Return a parameter's value as it is printed."""
    if isinstance(value, tuple):
        return ", ".join(f"{x:.4g}" for x in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _numbers(values: Floats) -> str:
    return "".join(f"{x:9.4f}" for x in values)


def _single_line(text: str) -> str:
    """Return a text without characters that would end a line or a block of code."""
    return text.replace("`", "'").replace("\n", " ").replace("\r", " ")


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
    side: int = _MAP_SIDE,
    adapter: str = "auto",
    **head: Any,
) -> ExportReport:
    """Write a skin or a head for another program, and say how wrong it will be there.

    subject : a profile by name or file, a head, or what `load_subject` has made
    to : a target's name: "unity", "blender" ...
    output : file, or a folder that is made where the name has no suffix; beside a file come a page and JSON
    version : of the program, its newest known by default
    variant : of what it can do, a method of scattering say, its first by default
    model : of the profile, see `reference_curve`
    profile : skin of a head
    library : of a page, the folder that npm has installed its library into, which it then holds
    side : of maps that are painted [texels]
    adapter : that paints them
    head : options of `load_head`

    DermisError : an unknown target, version, variant or model, and what cannot be read or written
    """
    target = replace(TARGETS[to].with_variant(variant), side=side, adapter=adapter)
    target = target if library is None else target.with_library(library)
    resolved, path = target.resolve_version(version), _checked_output(target, output)
    options = {"model": model, "profile": profile, **head}
    if not isinstance(subject, Subject):
        subject = load_subject(subject, **options)
    elif given := [name for name, value in options.items() if value is not None]:
        refuse(given[0], "a subject by name or file", "it is given with a Subject", "Omit this option")
    if target.needs_maps:
        subject = subject.with_painted_maps(side, adapter)
    report = evaluate_export(subject, target, resolved)
    with _staging_path(path) as staged:
        root, final_root = (one.parent if path.suffix else one for one in (staged, path))
        files = target.write(subject, report.parameters, staged, resolved)
        files += _write_report(replace(report, files=tuple(file.relative_to(root) for file in files)), staged)
    return replace(report, files=tuple(final_root / file.relative_to(root) for file in files))


def evaluate_export(subject: Subject, target: Target, version: str) -> ExportReport:
    """Return the report of an export, before anything is written."""
    parameters, naive = target.parameters(subject, version), target.naive_parameters(subject, version)
    errors = [
        curve_error(subject.curve, target.predicted_curve(one, subject, version))
        for one in (parameters, naive)
    ]
    return ExportReport(
        target=target.name,
        title=target.title,
        version=version,
        variant=target.variant,
        subject=subject.name,
        model=subject.model,
        parameters=parameters,
        naive_parameters=naive,
        d_mm=fit_burley_width(subject.curve),
        error=errors[0],
        naive_error=errors[1],
        limitations=target.limitations,
        untested=target.untested,
    )


def _checked_output(target: Target, output: str | Path) -> Path:
    """Return where to write, if the target can."""
    path = Path(output)
    if path.suffix.lower() not in target.suffixes:
        allowed = [suffix or "no suffix, for a folder" for suffix in target.suffixes]
        actual = f"its suffix is {path.suffix!r}" if path.suffix else "it has no suffix"
        refuse(output, f"a name that ends in {' or '.join(allowed)}", actual, "Choose one of them")
    return check_output(path, target.suffixes) if path.suffix else path


@contextmanager
def _staging_path(output: Path) -> Iterator[Path]:
    """Yield a temporary path for `Target.write`, and move the written files to the output afterwards."""
    if not output.suffix:
        with atomic_folder(output, REPORT_FILE) as folder:
            yield folder
        return
    with temporary_folder(output) as folder:
        yield folder / output.name
        for file in sorted(folder.iterdir(), key=lambda file: file.name == output.name):  # the output last
            _move_into_place(file, output.with_name(file.name))


def _move_into_place(source: Path, target: Path) -> None:
    if source.is_dir():
        with atomic_folder(target, REPORT_FILE) as folder:
            folder.rmdir()
            source.replace(folder)
        return
    with atomic_file(target) as temporary:
        source.replace(temporary)


def _write_report(report: ExportReport, output: Path) -> list[Path]:
    """Write the page and the numbers into the folder or beside the file; return their paths."""
    single = bool(output.suffix)
    page = output.with_name(f"{output.name}.md") if single else output / _PAGE_FILE
    numbers = output.with_name(f"{output.name}.json") if single else output / REPORT_FILE
    page.write_text(report.markdown(), encoding="utf-8")
    numbers.write_text(json.dumps(report.as_json(), indent=2) + "\n", encoding="utf-8")
    return [page, numbers]
