"""Command `dermis correspondences`: landmarks and blend shapes of other face models on a person."""

from __future__ import annotations

import json

from dermis.base.console import print_report, spinner
from dermis.cli.head_options import HeadOptions, check_head_options
from dermis.cli.options import NO_OPTIONS, JsonOption, OutputPath


def correspondences(
    person: str = "human",
    /,
    *,
    output: OutputPath,
    head: HeadOptions = NO_OPTIONS,
    as_json: JsonOption = False,
) -> int:
    """Write a person's vertices that are landmarks of other face models, and names of blend shapes.

    The JSON file lists the landmarks of MediaPipe's face mesh, of 300-W (iBUG) and of FaceSynthetics as
    weighted means of vertices of exports to gltf and usd, and the names of the blend shapes in ARKit,
    MediaPipe and Live Link Face. With it, another face model can be fitted to the person.

    Examples:

        dermis correspondences human:7 -o human_7.json

    Parameters
    ----------
    person:
        A person: human, human:SEED, or the file of a person (.json).
    output:
        JSON file to write.
    as_json:
        Print one JSON object with the file, the number of landmarks in each set and that of blend shapes.
    """
    from dermis.apps.export.correspondences import correspondence_table
    from dermis.base.atomic_write import atomic_file, check_output
    from dermis.scene.heads import load_head

    check_head_options(person, head)
    check_output(output, (".json",))
    with spinner("computing correspondences"):
        table = correspondence_table(load_head(person, **head))
        with atomic_file(output) as file:
            file.write_text(json.dumps(table, separators=(",", ":")) + "\n", encoding="utf-8")
    counts = {name: len(rows) for name, rows in table["landmarks"].items()}
    counts["blend_shapes"] = len(table["blend_shapes"])
    report = {"file": str(output), **counts}
    lines = [*(f"{count:4d}  {name}" for name, count in counts.items()), "", str(output)]
    print_report(as_json, report, lambda: lines)
    return 0
