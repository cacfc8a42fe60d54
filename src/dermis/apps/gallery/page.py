"""Gallery page: one self-contained HTML file that needs no network."""

from __future__ import annotations

import base64
import csv
import html
import re
import unicodedata
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path
from string import Template

from dermis.apps.gallery.script import GalleryPicture
from dermis.base import citations as cite
from dermis.base.atomic_write import atomic_file

_BIBTEX_FIELD = re.compile(r"(\w+)\s*=\s*\{")
_TEX_ACCENT = re.compile(r"\\(['\"`^~])\s*(\w)")
_COMBINING_ACCENTS = {"'": "\u0301", '"': "\u0308", "`": "\u0300", "^": "\u0302", "~": "\u0303"}
_TEX_SYMBOLS = {
    r"$\mu$": "µ",
    r"\&": "&",
    r"\AA": "Å",
    "; others": " and others",
    "---": "—",
    "--": "–",
    "``": "“",
    "''": "”",
}


def write_page(path: Path, pictures: Sequence[GalleryPicture], head: str, adapter: str) -> None:
    """Write the HTML page with all pictures, atomically.

    pictures : pictures in the order of the page
    head : name of the head in the pictures
    adapter : name of the adapter that drew the pictures

    Raises DermisError when the file cannot be written.
    """
    page = Template(_read_resource("page.html")).substitute(
        style=_read_resource("page.css"),
        script=_read_resource("page.js"),
        head=html.escape(head),
        adapter=html.escape(adapter),
        contents="".join(_contents_entry_html(picture) for picture in pictures),
        pictures="\n".join(_section_html(picture) for picture in pictures),
        deck=_slide_rows(pictures),
        works=_bibliography_html(pictures),
    )
    with atomic_file(path) as file:
        file.write_text(page, encoding="utf-8")


def _contents_entry_html(picture: GalleryPicture) -> str:
    return f'<li><a href="#{picture.script.name}">{html.escape(picture.script.title)}</a></li>'


def _section_html(picture: GalleryPicture) -> str:
    script = picture.script
    equation = f'<p class="equation">{_equation_html(script.equation)}</p>' if script.equation else ""
    return (
        f'<section id="{script.name}"><h2>{html.escape(script.title)}</h2>'
        f"<p>{html.escape(script.caption)}</p>{equation}{_panels_html(picture)}"
        f'<p class="facts">{_picture_facts(picture)}</p></section>'
    )


def _equation_html(equation: str) -> str:
    """Convert a one-line equation, in which _ begins a subscript and ^ a superscript, to HTML."""
    equation = re.sub(r"_(\w+)", r"<sub>\1</sub>", html.escape(equation))
    return re.sub(r"\^\(([^)]*)\)|\^(\w+)", lambda found: f"<sup>{found[1] or found[2]}</sup>", equation)


def _panels_html(picture: GalleryPicture) -> str:
    if picture.fault:
        return f'<p class="fault">Not drawn: {html.escape(picture.fault)}</p>'
    slider, panels = picture.script.slider, dict(picture.panels)
    comparison = _slider_html(slider, [panels.pop(name) for name in slider]) if slider else ""
    if not panels:
        return comparison
    columns = picture.script.columns or min(len(panels), 4)
    figures = "".join(_figure_html(caption, file) for caption, file in panels.items())
    return f'{comparison}<div class="panels" style="--columns: {columns}">{figures}</div>'


def _slider_html(captions: tuple[str, str], webp_files: Sequence[bytes]) -> str:
    before, after = (html.escape(caption) for caption in captions)
    below, above = (_data_url(file) for file in webp_files)
    label = f"{before} on the left, {after} on the right"
    return (
        f'<figure class="slider"><img src="{above}" alt="{after}">'
        f'<img class="before" src="{below}" alt="{before}">'
        f'<input type="range" min="0" max="100" value="50" aria-label="{label}">'
        f"<figcaption><span>{before}</span><span>{after}</span></figcaption></figure>"
    )


def _figure_html(caption: str, webp_file: bytes) -> str:
    text = html.escape(caption)
    return f'<figure><img src="{_data_url(webp_file)}" alt="{text}"><figcaption>{text}</figcaption></figure>'


def _data_url(webp_file: bytes) -> str:
    return "data:image/webp;base64," + base64.b64encode(webp_file).decode("ascii")


def _picture_facts(picture: GalleryPicture) -> str:
    script = picture.script
    width, height = picture.size
    facts = [f"<code>dermis gallery --only {script.name}</code>"]
    facts += [f"{width}×{height}"] if width else []
    facts += [f"{_format_number(picture.frame_ms)} ms per frame"] if picture.frame_ms else []
    facts += [f"{picture.seconds:.0f} s in total"]
    facts += [f'<a href="#{row}" title="row {row[1:]} of the talk, below">{row}</a>' for row in script.deck]
    facts += [f'<a href="#{key}">{key}</a>' for key in script.sources]
    return " · ".join(facts)


def _format_number(number: float) -> str:
    return f"{number:.0f}" if number >= 100 else f"{number:.3g}"


def _slide_rows(pictures: Sequence[GalleryPicture]) -> str:
    """Return HTML table rows for the slides of the talk "Advanced Skin Rendering" (2007).

    Each row has links to the pictures that show the slide, and a command that draws them.
    """
    rows = csv.DictReader(
        line for line in _read_resource("deck.csv").splitlines() if not line.startswith("#")
    )
    return "".join(_slide_row(row, pictures) for row in rows)


def _slide_row(slide: dict[str, str], pictures: Sequence[GalleryPicture]) -> str:
    scripts = [picture.script for picture in pictures if slide["row"] in picture.script.deck]
    links = ", ".join(f'<a href="#{script.name}">{html.escape(script.title)}</a>' for script in scripts)
    command = slide["command"] or " ".join(["dermis gallery", *(f"--only {one.name}" for one in scripts)])
    return (
        f'<tr id="{slide["row"]}"><td>{slide["row"]}</td><td>{html.escape(slide["shows"])}</td>'
        f"<td>{links}</td><td><code>{html.escape(command)}</code></td></tr>"
    )


def _bibliography_html(pictures: Sequence[GalleryPicture]) -> str:
    keys = sorted({key for picture in pictures for key in picture.script.sources})
    return "".join(f'<dt id="{key}">{key}</dt><dd>{html.escape(format_reference(key))}</dd>' for key in keys)


def _read_resource(file_name: str) -> str:
    return (resources.files("dermis.apps.gallery") / file_name).read_text(encoding="utf-8")


def format_reference(bibliography_key: str) -> str:
    """Format a work from the bibliography on one line: authors, title, year.

    Raises DermisError for a key that is not in the bibliography.
    """
    fields = dict(_bibtex_fields(cite.bibtex([bibliography_key])))
    if "author" in fields:
        fields["author"] = "; ".join(re.split(r"\s+and\s+", fields["author"]))
    known = [_without_tex(fields[name]).rstrip(".") for name in ("author", "title", "year") if name in fields]
    return ". ".join(known)


def _bibtex_fields(bibtex_entry: str) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each field of a BibTeX entry.

    Texts may span lines and contain braces.
    """
    at = 0
    while found := _BIBTEX_FIELD.search(bibtex_entry, at):
        at, depth = found.end(), 1
        while depth:
            depth += {"{": 1, "}": -1}.get(bibtex_entry[at], 0)
            at += 1
        yield found[1].lower(), bibtex_entry[found.end() : at - 1]


def _without_tex(tex_text: str) -> str:
    """Convert TeX accents and symbols to Unicode, and remove braces."""
    text = tex_text.replace("{", "").replace("}", "")
    for markup, character in _TEX_SYMBOLS.items():
        text = text.replace(markup, character)
    text = _TEX_ACCENT.sub(lambda found: found[2] + _COMBINING_ACCENTS[found[1]], text)
    return " ".join(unicodedata.normalize("NFC", text).split())
