"""Values alone, for programs that nobody here has run."""

from __future__ import annotations

import json
from pathlib import Path

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Rows, Target


def write_values(target: Target, subject: Subject, rows: Rows, place: Path, version: str) -> Path:
    """A JSON file of parameters with unit and meaning, marked as not run."""
    file = place if place.suffix else place / f"{subject.identifier}.json"
    told = {
        "for": f"{target.title} {version}",
        "status": "not run: by the published meanings",
        "skin": subject.name,
        "profile": subject.model,
        "parameters": {
            row.name: {"value": row.value, "unit": row.unit, "meaning": row.meaning} for row in rows
        },
        "remains_wrong": target.wrong,
    }
    file.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    return file
