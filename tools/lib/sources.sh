# shellcheck shell=bash
# Sources of programs that are not ours, at one commit; sourced. Needs a function `fail`, which says why what needs them is not run.

# sources FOLDER REPOSITORY COMMIT CLONE [PATHSPEC]...: the files of that commit in FOLDER, those that git's pathspecs choose, from REPOSITORY or, where
# CLONE is not empty, from this clone of it. They are not taken again where they are there. A clone that is named has to have them: without them the
# script ends with exit code 1.
sources() {
    local into=$1 repository=$2 at=$3 from=$4
    shift 4
    [[ $(cat "$into.commit" 2>/dev/null) == "$at" ]] && return
    if [[ $from ]]; then
        git -C "$from" cat-file -e "$at^{commit}" || {
            echo "$from is no clone of $repository with commit $at" >&2
            exit 1
        }
    else
        from=$into.git
        rm -rf "$from"
        git init --quiet --bare "$from"
        git -C "$from" fetch --quiet --depth 1 "$repository" "$at" || fail "commit $at of $repository cannot be had"
    fi
    rm -rf "$into"
    mkdir -p "$into"
    git -C "$from" archive "$at" -- "$@" | tar -x -C "$into"
    [[ $from != "$into.git" ]] || rm -rf "$from"
    echo "$at" >"$into.commit"
}
