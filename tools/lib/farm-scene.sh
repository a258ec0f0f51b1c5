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

# is_unbroken FOLDER: every file of the room's FOLDER has the bytes of unbroken-FOLDER, and there is no other; wall clocks aside.
is_unbroken() {
    diff -r --brief --exclude=timings.jsonl --exclude=lock "$room/unbroken-$1" "$room/$1"
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
