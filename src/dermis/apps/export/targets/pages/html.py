"""Scripts and styles inside a page: how they may stand there, and what lets them run."""

from __future__ import annotations

import base64
import hashlib
import re

_END = re.compile("</(?=script)", re.IGNORECASE)


def inline(text: str) -> str:
    """A script as it may stand between <script> and </script>: strings keep their meaning."""
    return _END.sub(r"<\\/", text).replace("<!--", r"<\!--")


def hash_of(text: str) -> str:
    """What a Content-Security-Policy knows an inline script or style by."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
