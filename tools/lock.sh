#!/bin/sh
# Write requirements.lock: every package of the package and its dev extra, pinned by hash, for every platform.
# Options are handed to uv (`--upgrade` takes newer versions than the lock has now).
set -eu
cd "$(dirname "$0")/.."

find_uv() {
    for uv in .venv/bin/uv uv; do
        if command -v "$uv" >/dev/null 2>&1; then
            echo "$uv"
            return
        fi
    done
    echo "lock: expected uv, but found none. Run: .venv/bin/python -m pip install uv" >&2
    return 1
}

uv=$(find_uv)
# Where packages come from is the machine's affair: no index address may get into the file.
"$uv" pip compile pyproject.toml --extra dev --universal --python-version 3.11 --generate-hashes \
    --no-emit-index-url --no-emit-find-links --no-header --quiet -o requirements.lock "$@"
echo "lock: $(grep -c '==' requirements.lock) packages in requirements.lock"
