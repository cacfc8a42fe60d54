"""Export of a skin or head to another program, with a report of the predicted errors of the rendered skin."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dermis.apps.export.fitting import ProfileError, fit_burley_width, profile_error
from dermis.apps.export.guide import PREVIEW_SUFFIX, guide_lines, write_preview
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import ModelName, Subject, load_subject
from dermis.apps.export.target import Parameters, ParameterValue, Target
from dermis.base.atomic_write import (
    atomic_file,
    atomic_folder,
    check_output,
    check_output_folder,
    temporary_folder,
)
from dermis.base.errors import notify, refuse
from dermis.optics.media import Floats
from dermis.scene.living import SkinState

_NOTABLE_PROFILE_ERROR = 0.05  # fraction of the light that leaves at the wrong radius
_CHANNEL_NAMES = "red", "green", "blue"
_ERROR_MEANINGS = {
    "cdf": "largest fraction of the light that leaves at the wrong radius",
    "edge": "largest error beside an edge of light",
    "energy": "relative error of the total light",
}
REPORT_JSON_FILE = "export.json"
_REPORT_MARKDOWN_FILE = "README.md"
_DEFAULT_MAP_SIDE = 2048


@dataclass(frozen=True)
class ExportReport:
    """Report of one export.

    target, variant : name and variant of the export target; the variant is "" if there are no variants
    title, version : displayed name and version of the program
    subject : name of the exported skin or head
    model : name of the model from which the skin's reference profile was computed
    parameters : exported parameters
    naive_parameters : parameters that a user might choose without knowing their meaning in the program
    d_mm : (3,) width of the Burley profile closest to the reference profile [mm]
    error, naive_error : predicted errors of the profile that the program renders, with the exported
        parameters and with the naive parameters
    limitations : sentences on what the program cannot reproduce
    untested : True if files of this target have not been tested in the program
    files : paths of all written files
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
    error: ProfileError
    naive_error: ProfileError
    limitations: str
    untested: bool
    files: tuple[Path, ...] = ()

    def as_json(self) -> dict[str, object]:
        """Return the report as a dictionary that JSON can store."""
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

    def lines(self, with_naive_parameters: bool = False) -> list[str]:
        """Return the report as lines of plain text for the terminal.

        with_naive_parameters : whether to list also `naive_parameters`, which a user might choose without
            knowing their meaning in the program
        """
        target = " ".join(filter(None, (self.title, self.version, self.variant)))
        lines = [f"{self.subject}, profile by {self.model}, for {target}"]
        lines += ["not tested: parameters follow published documentation"] if self.untested else []
        lines += ["", *_parameter_table_lines(self.parameters)]
        if with_naive_parameters:
            lines += ["", "naive parameters", *_parameter_table_lines(self.naive_parameters)]
        lines += ["", f"{'':12}" + "".join(f"{name:>9}" for name in _CHANNEL_NAMES)]
        lines.append(f"{'d [mm]':12}{_format_colour_channels(self.d_mm)}  width of the fitted Burley profile")
        for name, meaning in _ERROR_MEANINGS.items():
            lines.append(f"{name:12}{_format_colour_channels(getattr(self.error, name))}  {meaning}")
            lines.append(
                f"{'  naive':12}{_format_colour_channels(getattr(self.naive_error, name))}"
                "  of naive parameters"
            )
        return [*lines, "", *self.limitation_texts()]

    def limitation_texts(self) -> list[str]:
        """Return sentences on what the target program renders wrongly.

        If no parameters reproduce the skin's profile, the first sentence states the error. The last sentences
        are the `limitations` of the program.
        """
        worst = int(self.error.cdf.argmax())
        error = float(self.error.cdf[worst])
        if error < _NOTABLE_PROFILE_ERROR:
            return [self.limitations]
        text = (
            f"No parameters reproduce this profile: {error:.0%} of the {_CHANNEL_NAMES[worst]} light leaves"
        )
        return [f"{text} at another radius.", self.limitations]

    def markdown(self, guide: Sequence[str] = ()) -> str:
        """Return the report as a Markdown page.

        guide : lines of Markdown that precede the parameters and errors
        """
        lines = [f"# {_as_single_line(self.subject)} for {self.title} {self.version}".rstrip(), "", *guide]
        lines += [
            f"```\n{chr(10).join(map(_as_single_line, self.lines(with_naive_parameters=True)))}\n```",
            "",
        ]
        return "\n".join(lines)


def _parameter_table_lines(parameters: Parameters) -> Sequence[str]:
    rows = [(one.name, format_parameter(one.value), one.unit, one.meaning) for one in parameters]
    widths = [max((len(row[i]) for row in rows), default=0) for i in range(3)]
    return ["  ".join([*map(str.ljust, row[:3], widths), row[3]]) for row in rows]


def format_parameter(parameter_value: ParameterValue) -> str:
    """Return the value of a parameter as text, with four significant digits."""
    if isinstance(parameter_value, tuple):
        return ", ".join(f"{x:.4g}" for x in parameter_value)
    return f"{parameter_value:.4g}" if isinstance(parameter_value, float) else str(parameter_value)


def _format_colour_channels(channel_values: Floats) -> str:
    return "".join(f"{x:9.4f}" for x in channel_values)


def _as_single_line(text: str) -> str:
    """Return a text with line breaks and backticks replaced, as these could end a code block of Markdown."""
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
    side: int = _DEFAULT_MAP_SIDE,
    adapter: str = "auto",
    state: SkinState | Mapping[str, float] | None = None,
    picture_width: int = 0,
    **head: Any,
) -> ExportReport:
    """Write a skin or a head for another program, and report the predicted errors of the rendered skin.

    Parameters
    ----------
    subject : str, Path or Subject
        Name or file of a profile ("skin1", "light", ...), name or file of a head, or a loaded `Subject`.
    to : str
        Name of the target, such as "unity" or "blender".
    output : str or Path
        File, or folder if the name has no suffix. The report is written as Markdown and JSON beside the file
        or into the folder.
    version : str, optional
        Version of the program; by default the newest supported version.
    variant : str, optional
        Variant of the target, such as a scattering method; the target's first variant by default.
    model : {"montecarlo", "layered", "multipole", "dipole", "better-dipole"}, optional
        Model of the diffusion profile. By default, tabulated Monte Carlo for the built-in homogeneous media,
        and layered diffusion for other tissue. A profile given as a table of Gaussians needs no model.
    profile : str or Path, optional
        Name or file of the profile of a head's skin. By default, the skin of a parametric person has the
        pigments of that person, and other heads have the default skin.
    library : str or Path, optional
        npm folder node_modules with the JavaScript library of a web page. The page then embeds the library;
        by default, the page loads the library from a public server.
    side : int, default 2048
        Side of the maps that are generated for the export [texel].
    adapter : str, default "auto"
        Graphics adapter on which maps are generated.
    state : SkinState or mapping, optional
        State of the skin of a person, such as {"blush": 0.6}, which the painted maps show.
    picture_width : int, default 0
        Width and height of a picture of the head for the README [pixel]; 0 writes no picture.
    **head
        Options of `load_head`.

    Returns
    -------
    ExportReport
        Parameters, errors and written files.

    Raises
    ------
    DermisError
        For an unknown target, version, variant or model, and for files that cannot be read or written.

    Examples
    --------
    >>> import tempfile, dermis
    >>> folder = tempfile.mkdtemp()
    >>> report = dermis.export_skin("skin1", "unity", f"{folder}/skin.asset")
    >>> sorted(path.name for path in report.files)
    ['skin.asset', 'skin.asset.json', 'skin.asset.md']
    >>> bool(report.error.cdf.max() < report.naive_error.cdf.max())
    True
    """
    target = replace(TARGETS[to].with_variant(variant), side=side, adapter=adapter)
    target = target if library is None else target.with_embedded_library(library)
    resolved, path = target.resolve_version(version), _check_output_path(target, output)
    if state is not None and not target.shows_states:
        actual = f"{target.title} gets parameters without maps"
        refuse("state", "a target with maps, such as gltf", actual, "Leave it out, or choose another target")
    options = {"model": model, "profile": profile, "state": state, **head}
    if not isinstance(subject, Subject):
        subject = load_subject(subject, **options)
    elif given := [name for name, value in options.items() if value is not None]:
        refuse(given[0], "a subject by name or file", "it is given with a Subject", "Omit this option")
    if subject.part_pictures is not None and target.part_limitations:
        notify(f"{subject.name}: {target.part_limitations}")
    shown = subject = replace(subject, adapter=adapter)
    if target.needs_maps:
        subject = subject.with_painted_maps(side, adapter)
    report = evaluate_export(subject, target, resolved)
    with _staging_path(path) as staged:
        root, final_root = (one.parent if path.suffix else one for one in (staged, path))
        files, picture = target.write(subject, report.parameters, staged, resolved), ""
        if picture_width and subject.head is not None:
            files.append(write_preview(shown, _beside(staged, PREVIEW_SUFFIX), picture_width, adapter))
            picture = files[-1].name
        report = replace(report, files=tuple(file.relative_to(root) for file in files))
        page, data_file = _report_files(staged)
        guide = guide_lines(target, subject, [*report.files, data_file.relative_to(root)], picture)
        page.write_text(report.markdown(guide), encoding="utf-8")
        data_file.write_text(json.dumps(report.as_json(), indent=2) + "\n", encoding="utf-8")
        files += [page, data_file]
    return replace(report, files=tuple(final_root / file.relative_to(root) for file in files))


def evaluate_export(subject: Subject, target: Target, version: str) -> ExportReport:
    """Return a report with the parameters and predicted errors of an export, without writing any file."""
    part_limitations = () if subject.part_pictures is None else (target.part_limitations,)
    parameters, naive = target.parameters(subject, version), target.naive_parameters(subject, version)
    errors = [
        profile_error(subject.curve, target.predicted_profile(one, subject, version))
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
        limitations=" ".join([target.limitations, *part_limitations]).rstrip(),
        untested=target.untested,
    )


def _check_output_path(target: Target, output: str | Path) -> Path:
    """Return the output path; raise DermisError for an unsupported suffix, and if it cannot be written."""
    path = Path(output)
    if path.suffix.lower() not in target.suffixes:
        allowed = [suffix or "no suffix, for a folder" for suffix in target.suffixes]
        actual = f"its suffix is {path.suffix!r}" if path.suffix else "it has no suffix"
        refuse(output, f"a name that ends in {' or '.join(allowed)}", actual, "Choose one of them")
    if path.suffix:
        return check_output(path, target.suffixes)
    check_output_folder(path, REPORT_JSON_FILE)
    return path


@contextmanager
def _staging_path(output: Path) -> Iterator[Path]:
    """Yield a temporary path for `Target.write`, and move the written files to `output` on success."""
    if not output.suffix:
        with atomic_folder(output, REPORT_JSON_FILE) as folder:
            yield folder
        return
    with temporary_folder(output) as folder:
        yield folder / output.name
        for file in sorted(folder.iterdir(), key=lambda file: file.name == output.name):  # the output last
            _move_written_files(file, output.with_name(file.name))


def _move_written_files(staged_path: Path, output_path: Path) -> None:
    if staged_path.is_dir():
        with atomic_folder(output_path, REPORT_JSON_FILE) as folder:
            folder.rmdir()
            staged_path.replace(folder)
        return
    with atomic_file(output_path) as temporary:
        staged_path.replace(temporary)


def _report_files(output: Path) -> tuple[Path, Path]:
    """Return the paths of the report as Markdown and as JSON, beside the output or in its folder."""
    if output.suffix:
        return _beside(output, "md"), _beside(output, "json")
    return output / _REPORT_MARKDOWN_FILE, output / REPORT_JSON_FILE


def _beside(output: Path, suffix: str) -> Path:
    """Return the path of a file beside an output file, whose name it extends, or in an output folder."""
    return output.with_name(f"{output.name}.{suffix}") if output.suffix else output / suffix
