# shellcheck shell=bash
# Sourced by the tools: named stages with their wall time.

stage_times=""

# stage NAME COMMAND...: runs a command, remembers how long it took, and ends the script with the
# command's exit code where it fails.
stage() {
    local name=$1 start=$SECONDS code=0
    shift
    printf '\n== %s\n' "$name"
    "$@" || code=$?
    if [[ $code -ne 0 ]]; then
        printf '\nFAILED: %s (exit code %d after %d s)\n' "$name" "$code" "$((SECONDS - start))" >&2
        exit "$code"
    fi
    stage_times+=$(printf '  %-12s %5d s' "$name" "$((SECONDS - start))")$'\n'
}

# Prints what each stage took.
print_stage_times() {
    printf '%s' "$stage_times"
    printf '  %-12s %5d s\n' total "$SECONDS"
}

# Ends the script with advice where Rust is missing or older than Cargo.toml asks.
require_rust() {
    local wanted found oldest
    wanted=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
    if ! command -v cargo >/dev/null || ! command -v rustc >/dev/null; then
        echo "cargo is not there. Install Rust $wanted or newer: https://rustup.rs" >&2
        exit 2
    fi
    if ! command -v cc >/dev/null && ! command -v clang >/dev/null && [[ ${OS-} != Windows_NT ]]; then
        echo "No C linker. Install one: Debian and Ubuntu 'gcc libc6-dev', Fedora and Arch 'gcc'." >&2
        exit 2
    fi
    found=$(rustc --version | sed 's/^rustc \([0-9.]*\).*/\1/')
    oldest=$(printf '%s\n%s\n' "$wanted" "$found" | sort -V | sed -n 1p)
    if [[ $oldest != "$wanted" ]]; then
        echo "Rust $found is older than the $wanted that Cargo.toml asks for: rustup update" >&2
        exit 2
    fi
}

# beside NAME FILE LABEL:COMMAND...: starts stages in the background, one after the other; `rejoin NAME` waits for them, shows what
# they printed, and ends the script where one failed.
beside() {
    local name=$1 file=$2
    shift 2
    printf '\n== %s, beside what follows: %s\n' "$name" "${*%%:*}"
    (
        stage_times=""
        for entry in "$@"; do stage "${entry%%:*}" "${entry#*:}"; done
        printf '%s' "$stage_times" >"$file.times"
    ) >"$file.log" 2>&1 &
    printf -v "beside_$name" '%s %s' "$!" "$file"
}

rejoin() {
    local variable=beside_$1 process file code=0
    read -r process file <<<"${!variable}"
    wait "$process" || code=$?
    cat "$file.log"
    [[ $code -eq 0 ]] || exit "$code"
    stage_times+=$(cat "$file.times")$'\n'
}
