"""JavaScript libraries of pages: from where they are loaded, or the files that are put into the page."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from dermis.base.errors import refuse
from dermis.base.reading import read_file

_CDN = "https://cdn.jsdelivr.net/npm"
_MOST = 32 << 20


@dataclass(frozen=True)
class Script:
    """A file of a package, as npm has it.

    name : by which a page's modules import it, "" for one that is simply run
    sha384 : of its bytes, base64
    """

    package: str
    version: str
    path: str
    sha384: str
    name: str = ""

    @property
    def url(self) -> str:
        """Where it is loaded from."""
        return f"{_CDN}/{self.package}@{self.version}/{self.path}"

    @property
    def integrity(self) -> str:
        """What the browser checks it by."""
        return f"sha384-{self.sha384}"

    def read(self, folder: Path) -> str:
        """Its text, from the folder that npm installs packages into (node_modules).

        DermisError : it is not there, or another version
        """
        expected = f"{self.path} of {self.package} {self.version}, as npm installs it"
        file = folder / self.package / self.path
        data = read_file(file, expected, _MOST)
        if base64.b64encode(hashlib.sha384(data).digest()).decode() != self.sha384:
            remedy = f"Install it: npm install {self.package}@{self.version}"
            refuse(file, expected, "other bytes came", remedy)
        return data.decode("utf-8")


def module_url(text: str, names: dict[str, str]) -> str:
    """A module as an address that holds it.

    names : by which it imports others, and by which the page knows these
    """
    for old, new in names.items():
        text = re.sub(rf"(\bfrom\s*)(['\"]){re.escape(old)}\2", rf"\1\2{new}\2", text)
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"
