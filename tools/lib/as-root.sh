# shellcheck shell=bash
# Sourced by what installs packages, which defines `say` and `fail`.

# Runs a command as root, with sudo only where it is needed and there.
as_root() {
    if [[ $(id -u) -eq 0 ]]; then
        say "running: $*"
        "$@"
    elif command -v sudo >/dev/null; then
        say "running: sudo $*"
        sudo "$@"
    else
        fail "this needs root, and there is no sudo; run as root: $*"
    fi
}

# Installs Debian packages.
apt_install() {
    # The package lists of a fresh image are empty; where they cannot be had, old ones may do.
    as_root apt-get update || say "apt-get update failed; trying with the package lists that are there"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"
}
