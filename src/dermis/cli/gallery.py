"""The command `dermis gallery`: a page with the comparisons of the talk "Advanced Skin Rendering" (2007)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import print_note, print_report, progress_bar
from dermis.cli.options import AdapterOption, IntegerOption, JsonOption, OutputPath

if TYPE_CHECKING:
    from dermis.apps.gallery.script import GalleryPicture

_PANEL_SIDE_PX = 448


def gallery(
    *,
    only: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    head: str | None = None,
    size: IntegerOption = None,
    output: OutputPath = Path("gallery"),
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Render the comparisons of the talk "Advanced Skin Rendering" (2007), with explanations.

    The command writes the pictures, and index.html, a page that contains and explains all pictures and works
    offline.

    Examples:

        dermis gallery -o out

        dermis gallery --only seams stretch --size 320 -o out

        dermis gallery --head human -o out

    Parameters
    ----------
    only:
        Pictures to render, by number or part of the name. [default: all]
    head:
        Head in the pictures: a sample or a file. [default: the scan lee_perry_smith if available, else human]
    size:
        Side of a panel, 32 to 2048 [pixel]. [default: 448]
    output:
        Folder of the pictures and the page, created if necessary.
    as_json:
        Print one JSON object with the pictures and their timings.
    """
    from dermis.apps.gallery.page import write_page
    from dermis.apps.gallery.script import draw_pictures, find_scripts, write_panels
    from dermis.apps.gallery.studio import Studio
    from dermis.base.atomic_write import refuse_output
    from dermis.base.errors import refuse

    side = _PANEL_SIDE_PX if size is None else size
    if not 32 <= side <= 2048:
        refuse("--size", "32 to 2048 pixels", f"got {side}", "Correct it")
    scripts, studio = find_scripts(only or ()), Studio(head, side, adapter)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(output, fault)
    studio.head()
    pictures = []
    with progress_bar("rendering pictures") as report_progress:
        for picture in draw_pictures(scripts, studio):
            write_panels(output, picture)
            pictures.append(picture)
            report_progress(len(pictures), len(scripts))
            if picture.fault:
                print_note(f"dermis: {picture.script.name}: {picture.fault}")
    page = output / "index.html"
    write_page(page, pictures, studio.name, studio.renderer.device.adapter.name)
    count = f"{len(pictures)} picture{'s' * (len(pictures) != 1)}"
    summary = f"{page}  {count}  {sum(picture.seconds for picture in pictures):.0f} s"
    report = {"page": str(page), "pictures": list(map(_picture_row, pictures))}
    print_report(as_json, report, lambda: [summary])
    return 2 if any(picture.fault for picture in pictures) else 0


def _picture_row(picture: GalleryPicture) -> dict[str, object]:
    return {
        "name": picture.script.name,
        "deck": list(picture.script.deck),
        "seconds": round(picture.seconds, 2),
        "frame_ms": picture.frame_ms,
        "fault": picture.fault or None,
    }
