#!/bin/sh
# Write requirements.lock, what a picture from a clone needs, and requirements-dev.lock, with all that the dev extra adds:
# every package pinned by hash, for every platform. What both have is of one version.
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
lock() {
    lock_file=$1
    shift
    "$uv" pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
        --no-emit-index-url --no-emit-find-links --no-header --quiet -o "$lock_file" "$@"
    echo "lock: $(grep -c '==' "$lock_file") packages in $lock_file"
}

lock requirements-dev.lock --extra dev "$@"
lock requirements.lock --extra build --constraint requirements-dev.lock
