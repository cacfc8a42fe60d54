"""HTML files with embedded scripts and styles, and a Content-Security-Policy that forbids all others."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Sequence
from pathlib import Path
from string import Template

_BASE_CSP_DIRECTIVES = "default-src 'none'; base-uri 'none'; form-action 'none'"
_SCRIPT_END_PATTERN = re.compile("</(?=script)", re.IGNORECASE)


def render_page(
    folder: Path,
    *,
    title: str,
    note: str,
    script: str,
    policy: str,
    script_sources: Sequence[str] = (),
    **placeholder_texts: str,
) -> str:
    """Return the HTML of a page from the template page.html and the style page.css of a folder.

    title, note : plain texts, which are escaped
    script : JavaScript of the page, already escaped by `escape_script`
    policy : directives of the Content-Security-Policy except script-src and style-src
    script_sources : sources that script-src allows in addition to the embedded script
    placeholder_texts : HTML or data for each of the template's other placeholders
    """
    style = (folder / "page.css").read_text("utf-8")
    allowed = " ".join([csp_hash(script), *script_sources])
    return Template((folder / "page.html").read_text("utf-8")).substitute(
        policy=html.escape(
            f"{_BASE_CSP_DIRECTIVES}; {policy}; style-src {csp_hash(style)}; script-src {allowed}"
        ),
        title=html.escape(title),
        note=html.escape(note),
        style=style,
        script=script,
        **placeholder_texts,
    )


def escape_script(script_text: str) -> str:
    """Return a script escaped for a <script> element; the values of its string literals do not change."""
    return _SCRIPT_END_PATTERN.sub(r"<\\/", script_text).replace("<!--", r"<\!--")


def csp_hash(inline_text: str) -> str:
    """Return the hash with which a Content-Security-Policy allows an inline script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(inline_text.encode()).digest()).decode()}'"
