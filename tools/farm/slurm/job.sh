# shellcheck shell=bash
# Sourced by the batch scripts.

# run COMMAND...: the command, which is told of a SIGTERM and may finish its frame. Where that ended it (exit code 130) the job goes back into the queue,
# unless a user cancelled it or Slurm has put it there; any other fault is the job's own, and is not tried again.
run() {
    local program code=0 told=""
    "$@" &
    program=$!
    trap 'told=yes; kill -TERM "$program" 2>/dev/null' TERM
    wait "$program" || code=$?
    # A trapped signal ends `wait` before the program.
    while kill -0 "$program" 2>/dev/null; do
        code=0
        wait "$program" || code=$?
    done
    if [[ -n $told && $code -eq 130 ]] && is_running; then
        echo "told to stop: the job goes back into the queue"
        scontrol requeue "$SLURM_JOB_ID"
    fi
    exit "$code"
}

# Whether Slurm counts the job as running: not where a user cancelled it, and not where it is in the queue already.
is_running() {
    scontrol show job "$SLURM_JOB_ID" | grep -q "JobState=RUNNING"
}
