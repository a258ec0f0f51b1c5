# Virtual environments for readers that are not ours; sourced. Needs a function `fail`.

# venv FOLDER PACKAGES: an environment with these packages, installed where they are not there yet.
venv() {
    [[ $(cat "$1/wanted" 2>/dev/null) == "$2" ]] && return
    echo "installing $2 into $1"
    rm -rf "$1"
    python3 -m venv "$1" || fail "python3 -m venv failed; install Python 3.10 or newer with its venv"
    # shellcheck disable=SC2086
    "$1/bin/python" -m pip install --quiet --disable-pip-version-check $2 || fail "pip could not install $2"
    echo "$2" >"$1/wanted"
}
