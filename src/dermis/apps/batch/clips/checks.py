"""Checks of the table [clip], and the default of `images_per_person` for it."""

from __future__ import annotations

from pathlib import Path

from dermis.apps.batch.clips.table import GENERATED_MOTION, ClipTable
from dermis.apps.batch.distributions import Choice
from dermis.base.errors import refuse
from dermis.base.reading import is_file

_MIN_PULSE_PER_MIN = 20.0
_PULSE_ADVICE = (
    "Correct it; for people of whom some have no pulse, write {choice = [0, {uniform = [50, 90]}]}"
)
_CAPTURE_SUFFIXES = ".csv", ".tsv", ".json", ".jsonl", ".ndjson"


def check_clip(clip: ClipTable, folder: Path) -> None:
    """Raise DermisError for captures that do not exist, and for heart rates too low for a pulse.

    folder : folder to which file names in the spec are relative
    """
    for name in map(str, clip.motion.support):
        if name == GENERATED_MOTION or (name.lower().endswith(_CAPTURE_SUFFIXES) and is_file(folder / name)):
            continue
        expected = f'"{GENERATED_MOTION}", or captures ({", ".join(_CAPTURE_SUFFIXES)}) in the spec\'s folder'
        refuse("clip: motion", expected, f"{name!r} is neither", "Correct it")
    rates = clip.pulse_per_min
    alternatives = rates.values if isinstance(rates, Choice) else (rates,)
    if any(one.support != (0.0,) and float(min(one.support)) < _MIN_PULSE_PER_MIN for one in alternatives):
        expected = f"0 or {_MIN_PULSE_PER_MIN:g} and more"
        refuse("clip: pulse_per_min", expected, f"got {rates.spec_value()}", _PULSE_ADVICE)
