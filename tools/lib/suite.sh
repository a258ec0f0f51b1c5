# shellcheck shell=bash
# Sourced by tools/test: the tests of tests/suite, timed.

# Where each test of the suite leaves its time.
suite_log=${TMPDIR:-/tmp}/swell-suite-$$.log

# Modules whose tests run with a software adapter's own threads, where a race of a pass would show: the passes alone.
suite_threads='^(gpu|check)::'

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

# All tests of the suite but those that are ignored.
suite_tests() { comm -23 <(suite_listed) <(suite_listed --ignored); }
suite_listed() { "$(suite_program)" --list "$@" | sed -n 's/: test$//p' | sort; }

# Tests that `tools/test` leaves to `tools/test --ci`.
suite_long() { sed -n 's/^\([a-z0-9_:]\{1,\}\) .*/\1/p' tests/long.txt | sort; }

# What `tools/test` runs of the suite: all but the long tests. A name in their list that no test has is an error.
suite_short() {
    local unknown
    unknown=$(comm -13 <(suite_tests) <(suite_long))
    if [[ -n $unknown ]]; then
        printf 'tests/long.txt names what is no test of the suite: %s\n' "$unknown" >&2
        return 1
    fi
    suite_side_by_side <(comm -23 <(suite_tests) <(suite_long))
}

suite_threaded() {
    local names
    mapfile -t names < <(suite_tests | grep -E "$suite_threads")
    suite --exact "${names[@]}"
}

suite_in_turn() { suite_side_by_side <(suite_tests | grep -vE "$suite_threads"); }

# suite_side_by_side FILE: the tests that a file names, several at a time. Each device works on its caller's core, which takes
# less time; one test more than there are cores fills the waits for the disk.
suite_side_by_side() {
    local names
    mapfile -t names <"$1"
    [[ ${#names[@]} -gt 0 ]] && LP_NUM_THREADS=0 suite --exact "${names[@]}" --test-threads=$(($(nproc) + 1))
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
