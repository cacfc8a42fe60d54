"""`dermis gallery`: every comparison of the talk as a picture, and all of them as one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import note, print_report, progress
from dermis.cli.options import Adapter, OutputPath, Json, Integer

if TYPE_CHECKING:
    from dermis.apps.gallery.script import Picture

_SIZE = 448


def gallery(
    *,
    only: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    head: str | None = None,
    size: Integer = None,
    output: OutputPath = Path("gallery"),
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Draw the comparisons of the talk, and a page that explains them.

    Writes the pictures, and index.html, which holds them all and works without a network.

    Examples:

        dermis gallery -o out

        dermis gallery --only seams stretch --size 320 -o out

        dermis gallery --head human -o out

    Parameters
    ----------
    only:
        Some of the pictures, by number or a part of their names.
    head:
        The head to show: a sample or a file [the scan where its files are at hand, else human].
    size:
        Side of a panel in pixels, 32 to 2048 [448].
    output:
        Folder for pictures and page; made if it is not there.
    """
    from dermis.apps.gallery.page import write_page
    from dermis.apps.gallery.script import draw_pictures, find_scripts, write_panels
    from dermis.apps.gallery.studio import Studio
    from dermis.base.atomic_write import refuse_output
    from dermis.base.errors import refuse

    side = _SIZE if size is None else size
    if not 32 <= side <= 2048:
        refuse("--size", "32 to 2048 pixels", f"{side} came", "Correct it")
    scripts, studio = find_scripts(only or ()), Studio(head, side, adapter)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(output, fault)
    studio.head()
    pictures = []
    with progress("drawing pictures") as report:
        for picture in draw_pictures(scripts, studio):
            write_panels(output, picture)
            pictures.append(picture)
            report(len(pictures), len(scripts))
            if picture.fault:
                note(f"dermis: {picture.script.name}: {picture.fault}")
    page = output / "index.html"
    write_page(page, pictures, studio.name, studio.renderer.device.adapter.name)
    number = f"{len(pictures)} picture{'s' * (len(pictures) != 1)}"
    said = f"{page}  {number}  {sum(one.seconds for one in pictures):.0f} s"
    print_report(as_json, {"page": str(page), "pictures": list(map(_row, pictures))}, lambda: [said])
    return 2 if any(picture.fault for picture in pictures) else 0


def _row(picture: Picture) -> dict[str, object]:
    return {
        "name": picture.script.name,
        "deck": list(picture.script.deck),
        "seconds": round(picture.seconds, 2),
        "frame_ms": picture.frame_ms,
        "fault": picture.fault or None,
    }
