# shellcheck shell=bash
# Sourced by tools/test: the tests of tests/suite, timed.

# Where each test of the suite leaves its time.
suite_log=${TMPDIR:-/tmp}/swell-suite-$$.log

# Modules whose tests run with a software adapter's own threads, where a race of a pass would show: the passes alone.
suite_threads=(gpu:: check::)

# suite WORDS...: runs tests of the suite by libtest's arguments, and keeps their times. libtest tells times only with an
# option that it calls unstable, which RUSTC_BOOTSTRAP allows on a stable toolchain; nothing is compiled with it.
suite() {
    local code=0
    RUSTC_BOOTSTRAP=1 "$(suite_program)" "$@" -Zunstable-options --report-time 2>&1 | tee -a "$suite_log" || code=$?
    return "$code"
}

# The suite's test binary, as cargo built it last.
suite_program() {
    cargo test --release --locked --test suite --no-run --message-format=json 2>/dev/null |
        sed -n 's/.*"name":"suite".*"executable":"\([^"]*\)".*/\1/p'
}

suite_threaded() { suite "${suite_threads[@]}"; }

# Elsewhere tests run side by side and each device works on its caller's core, which takes less time; one test more than there
# are cores fills the waits for the disk.
suite_in_turn() {
    LP_NUM_THREADS=0 suite "${suite_threads[@]/#/--skip=}" --test-threads=$(($(nproc) + 1))
}

# print_dearest COUNT: the tests that took longest, while others ran beside them.
print_dearest() {
    printf '\nthe %s longest tests, seconds each, several at a time:\n' "$1"
    sed -n 's/^test \([a-z0-9_:]*\) .*ok <\([0-9.]*\)s>$/\2 \1/p' "$suite_log" | sort -rn |
        awk -v count="$1" 'NR <= count { printf "  %7.1f  %s\n", $1, $2 }'
    rm -f "$suite_log"
}

# scratch: a folder in memory with room for caches, or the usual one for temporary files.
scratch() {
    local free
    free=$(df --output=avail -k /dev/shm 2>/dev/null | tail -n 1)
    if [[ -w /dev/shm && ${free:-0} -gt 2097152 ]]; then
        echo /dev/shm
    else
        echo "${TMPDIR:-/tmp}"
    fi
}
