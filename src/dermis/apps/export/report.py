"""Report of an export: parameters, their meanings, and their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dermis.apps.export.fitting import Deviation
from dermis.apps.export.target import Rows, Value
from dermis.optics.media import Floats

_NOTABLE = 0.05  # of the light at the wrong radius
_CHANNELS = "red", "green", "blue"
_ERRORS = {
    "cdf": "most light at the wrong radius, of 1",
    "edge": "most beside an edge of light, of 1",
    "energy": "too much or too little light in all, relative",
}


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
