"""Write four heads as web pages and an index page."""

from __future__ import annotations

import html
import re
from pathlib import Path

from dermis.apps.export.run import export_skin
from dermis.base.command_line import run_script
from dermis.formats.samples import is_available

HEADS = {"human": "the human", "human-7": "human:7", "human-12": "human:12", "scan": "lee_perry_smith"}
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
STYLE = (
    "body{background:#000;color:#ddd;font:16px system-ui,sans-serif;margin:0;display:grid;gap:8px;"
    "padding:8px;"
    "grid-template-columns:repeat(auto-fit,minmax(min(320px,100%),1fr))}"
    "img{width:100%;display:block}a{color:inherit}"
)


def main(folder: Path) -> None:
    """Write the pages."""
    folder.mkdir(parents=True, exist_ok=True)
    shown = []
    for name, title in HEADS.items():
        word = "human" if title.startswith("the") else title
        if word == "lee_perry_smith" and not is_available(word):
            word = title = "human:19"
        export_skin(word, "web", folder / f"{name}.html")
        text = (folder / f"{name}.html").read_text(encoding="utf-8")
        poster = re.search(r'src="(data:image/webp;base64,[^"]*)"', text)
        assert poster is not None
        shown.append(f'<a href="{name}.html"><img alt="" src="{poster[1]}">{html.escape(title)}</a>')
    told = f"{VIEWPORT}<title>dermis</title><style>{STYLE}</style>"
    head = f'<!doctype html><html lang="en"><meta charset="utf-8">{told}'
    (folder / "index.html").write_text("\n".join([head, *shown, "</html>\n"]), encoding="utf-8")


if __name__ == "__main__":
    run_script(main)
