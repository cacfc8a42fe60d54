"""Where the package keeps files of its own."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """Atlases and fetched samples, which can all be had again: DERMIS_CACHE, else the user's cache folder."""
    import platformdirs

    return Path(os.environ.get("DERMIS_CACHE") or platformdirs.user_cache_dir("dermis"))
