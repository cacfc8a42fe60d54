#!/bin/sh
# Write requirements.lock with the requirements of the package, and requirements-dev.lock with those of the extra `dev`:
# every package pinned by hash, for all platforms. Packages in both files have the same version.
# Options are passed to uv (`--upgrade` selects newer versions).
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
# The package index is a setting of the machine: no index address may be written to the file.
lock() {
    lock_file=$1
    shift
    "$uv" pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
        --no-emit-index-url --no-emit-find-links --no-header --quiet -o "$lock_file" "$@"
    echo "lock: $(grep -c '==' "$lock_file") packages in $lock_file"
}

lock requirements-dev.lock --extra dev "$@"
lock requirements.lock --extra build --constraint requirements-dev.lock
