# shellcheck shell=bash
# Sourced by what tries farms: a small shot, what it is when nothing interrupts it, and the comparison with that. Uses `swell` and `room`.

# write_shot SPACING FRAMES: scene and look in the room.
write_shot() {
    cat >"$room/tank.toml" <<END
[shot]
name = "tank"
frames = $2
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 2.0, 1.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.5, 1.0, 1.0]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = $1
[[probe]]
kind = "front"
axis = "+x"
name = "front"
END
    cat >"$room/look.toml" <<'END'
[camera]
focal_length_mm = 30.0
position = [-2.0, 1.8, 2.2]
target = [1.0, 0.5, 0.5]
[image]
width = 96
height = 54
samples = 1
[sky]
model = "hosek_wilkie"
END
}

# bake_unbroken: the same shot without a farm, in unbroken-cache and unbroken-pictures.
bake_unbroken() {
    "$swell" bake "$room/tank.toml" -o "$room/unbroken-cache" --progress none
    "$swell" whitewater "$room/unbroken-cache" --progress none
    "$swell" render "$room/unbroken-cache" --look "$room/look.toml" -o "$room/unbroken-pictures" --progress none
}

# export_unbroken: meshes and a USD shot of the same, in unbroken-export.
export_unbroken() {
    "$swell" export "$room/unbroken-cache" --mesh "$room/unbroken-export/m.%04d.ply" --usd "$room/unbroken-export/shot.usda" --progress none
}

# is_unbroken FOLDER: every file of the room's FOLDER has the bytes of unbroken-FOLDER, and there is no other; wall clocks aside.
is_unbroken() {
    diff -r --brief --exclude=timings.jsonl --exclude=lock "$room/unbroken-$1" "$room/$1"
}

# study_unbroken: a sweep over the shot in study.toml, and what it is without a farm, in unbroken-study.
study_unbroken() {
    cat >"$room/study.toml" <<'END'
kind = "sweep"
scene = "tank.toml"
key = "solver.pbf.iterations"
values = [2, 4, 8]
steps = 24
errors = ["density_error_mean", "density_error_max"]
[[method]]
name = "jacobi"
set = ["solver.pbf.iteration=jacobi"]
[[method]]
name = "red_black"
END
    "$swell" study "$room/study.toml" -o "$room/unbroken-study" --progress none
}

# results_of FOLDER: a study's own ledger without wall clocks and shares.
results_of() { sed -e 's/"seconds":\[[^]]*\]//' -e 's/"share":"[^"]*",//' "$1/results.jsonl"; }

# is_unbroken_study FOLDER: the room's FOLDER has the points of unbroken-study, in their order and nothing else, and the same files beside ledgers of shares.
is_unbroken_study() {
    diff <(results_of "$room/unbroken-study") <(results_of "$room/$1") >&2 &&
        diff <(cd "$room/unbroken-study" && find . -type f | sort) <(cd "$room/$1" && find . -type f ! -name 'results.*-of-*.jsonl' | sort) >&2
}

# points_of FOLDER: points that shares have run there.
points_of() { cat "$1"/results.*-of-*.jsonl 2>/dev/null | wc -l; }

# studying FOLDER: ids of the programs that run a study there.
studying() { pgrep -f "^$swell study [^ ]+ -o $1 "; }

# wait_for_point FOLDER: until a share has run a point; gives up after a minute.
wait_for_point() {
    local tries=0
    until [[ $(points_of "$1") -ge 1 ]]; do
        tries=$((tries + 1))
        [[ $tries -lt 1200 ]] || { say "FAILED: no point of $1 was run"; exit 1; }
        sleep 0.05
    done
}

# frames_of CACHE: whole lines of its ledger less the start's.
frames_of() {
    local lines=0
    [[ ! -f $1/frames.jsonl ]] || lines=$(wc -l <"$1/frames.jsonl")
    echo $((lines > 0 ? lines - 1 : 0))
}

# baking CACHE: the id of the program that bakes into it.
baking() { pgrep -f "^$swell bake [^ ]+ -o $1 "; }

# is_held ID: whether a process is stopped, and has no SIGTERM (the 15th, so bit 14) that it has not taken yet.
is_held() {
    local status
    status=$(cat "/proc/$1/status" 2>/dev/null) || return
    [[ $status == *$'\nState:\tT'* ]] && ! (($(sed -n 's/^ShdPnd:\t/0x/p' <<<"$status") & 1 << 14))
}

# hold_until_told CACHE COMMAND...: runs what has the bake told to stop. The program is held until it is told, since it could else be done before; Slurm
# tells it to go on as well.
hold_until_told() {
    local program tries=0
    program=$(baking "$1") && kill -STOP "$program" || { say "FAILED: the bake into $1 was done before it could be told to stop"; exit 1; }
    # A thread that still runs would take the signal.
    while grep -q '^State:.[^T]' "/proc/$program/task/"*/status; do sleep 0.01; done
    shift
    "$@"
    while is_held "$program"; do
        tries=$((tries + 1))
        [[ $tries -lt 1200 ]] || { kill -KILL "$program"; say "FAILED: the bake was not told to stop"; exit 1; }
        sleep 0.05
    done
    kill -CONT "$program" 2>/dev/null || true
}

# wait_for_frame CACHE FRAME: until that frame is in the ledger; gives up after a minute.
wait_for_frame() {
    local tries=0
    until [[ $(frames_of "$1") -ge $2 ]]; do
        tries=$((tries + 1))
        [[ $tries -lt 1200 ]] || { say "FAILED: frame $2 of $1 did not come"; exit 1; }
        sleep 0.05
    done
}
