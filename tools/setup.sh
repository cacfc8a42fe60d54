#!/bin/sh
# Create .venv and install a Vulkan driver if necessary. A second run does only what is missing.
# setup.sh [dev]: install the requirements of the package from requirements.lock; with dev also those of tests and docs.
# PYTHON=... names the Python interpreter to use instead of the first one that is new enough.
set -eu
cd "$(dirname "$0")/.."

level=${1:-base}
case $level in
base) lock=requirements.lock ;;
dev) lock=requirements-dev.lock ;;
*)
    echo "setup: expected nothing or dev, but $level came" >&2
    exit 2
    ;;
esac
# Record of the installed pins and of the folder, because an environment cannot be moved.
installed_stamp=.venv/.installed-$level
# Record of the Vulkan drivers among which an adapter was found.
adapter_stamp=.venv/.adapter

say() { echo "setup: $*"; }

fail() {
    echo "setup: $*" >&2
    exit 1
}

new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() {
    for name in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11}; do
        if new_enough "$name"; then
            command -v "$name"
            return
        fi
    done
    fail "expected Python 3.11 or newer as ${PYTHON:-python3 or python3.11 to python3.14}, but found none." \
        "Install it, or name one: make setup PYTHON=/path/to/python3.12"
}

# Run a command silently; if it fails, print its output.
quietly() {
    if ! said=$("$@" 2>&1); then
        printf '%s\n' "$said" >&2
        return 1
    fi
}

# Install Debian packages if no password is needed; otherwise return 1.
install_packages() {
    command -v apt-get >/dev/null 2>&1 || return 1
    sudo=
    if [ "$(id -u)" -ne 0 ]; then
        sudo -n true 2>/dev/null || return 1
        sudo=sudo
    fi
    say "installing $* with apt-get"
    # Continue after a failed update, because a stale package list may be sufficient.
    quietly $sudo apt-get -qq update || true
    quietly $sudo env DEBIAN_FRONTEND=noninteractive \
        apt-get -qq -y -o DPkg::Lock::Timeout=120 install --no-install-recommends "$@"
}

# Three methods to create an environment with pip; the minimal python3 of Debian has neither venv nor pip.
create_venv() {
    "$1" -m venv .venv >/dev/null 2>&1 && return
    rm -rf .venv
    install_packages "python$2-venv" && "$1" -m venv .venv && return
    rm -rf .venv
    "$1" -m pip --version >/dev/null 2>&1 &&
        "$1" -m venv --without-pip .venv >/dev/null 2>&1 &&
        quietly "$1" -m pip --python .venv/bin/python install --quiet pip
}

make_venv() {
    python=$(find_python)
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    trap 'rm -rf .venv' EXIT
    trap 'exit 130' INT TERM
    create_venv "$python" "$version" ||
        fail "$python cannot make an environment. Run: sudo apt-get install -y python$version-venv $drivers"
    trap - EXIT INT TERM
    say "made .venv with Python $version ($python)"
}

# Return whether .venv works, with pip, in the folder where it was created.
venv_works() {
    new_enough .venv/bin/python || return 1
    for stamp in .venv/.installed-*; do
        [ ! -f "$stamp" ] || [ "$(head -n 1 "$stamp")" = "$PWD" ] || return 1
    done
    .venv/bin/python -c 'import pip' 2>/dev/null || .venv/bin/python -m ensurepip >/dev/null 2>&1
}

wanted_stamp() {
    echo "$PWD"
    cksum "$1" pyproject.toml
}

# Return whether everything of a level is installed with the current pins.
installed() { [ -f ".venv/.installed-$1" ] && [ "$(wanted_stamp "$2")" = "$(cat ".venv/.installed-$1")" ]; }

pip_install() { quietly .venv/bin/python -m pip install --quiet --no-input --disable-pip-version-check "$@"; }

install_locked() {
    if installed "$level" $lock || installed dev requirements-dev.lock; then
        say ".venv is up to date"
        return
    fi
    say "installing $(grep -c '==' $lock) locked packages (once)"
    pip_install --require-hashes -r $lock || fail "could not install the locked packages (see above)."
    pip_install --no-deps --no-build-isolation -e . || fail "could not install dermis itself (see above)."
    .venv/bin/python -m compileall -q src/dermis || true # otherwise the first command compiles hundreds of modules
    wanted_stamp $lock >"$installed_stamp"
}

# List the drivers that the Vulkan loader would find, which is much faster than asking wgpu.
list_drivers() {
    echo "${VK_DRIVER_FILES:-} ${VK_ICD_FILENAMES:-}"
    ls -l /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d 2>/dev/null || true
}

# Print the name of the first Vulkan adapter, if any. Drivers print messages on stderr.
find_adapter() {
    .venv/bin/python - 2>/dev/null <<'PYTHON' || true
import wgpu

infos = [adapter.info for adapter in wgpu.gpu.enumerate_adapters_sync()]
print(next((info["device"] for info in infos if info["backend_type"] == "Vulkan"), ""))
PYTHON
}

ensure_adapter() {
    [ "$(uname -s)" = Linux ] || return 0
    if [ -f $adapter_stamp ] && [ "$(list_drivers)" = "$(cat $adapter_stamp)" ]; then
        return
    fi
    adapter=$(find_adapter)
    if [ -z "$adapter" ]; then
        # shellcheck disable=SC2086  # two package names
        install_packages $drivers && adapter=$(find_adapter)
    fi
    [ -n "$adapter" ] || fail "found no Vulkan adapter. Run: sudo apt-get install -y $drivers"
    list_drivers >$adapter_stamp
    say "Vulkan adapter: $adapter"
}

drivers="libvulkan1 mesa-vulkan-drivers"
if ! venv_works; then
    rm -rf .venv
    make_venv
fi
install_locked
ensure_adapter
