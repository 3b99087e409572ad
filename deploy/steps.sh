# shellcheck shell=bash
# Steps of a long run with the time that each takes, for .ci/run and deploy/nightly. Source this file, set `run` to the
# name of the run, call `step NAME COMMAND...` for each step, and `summary` at the end.

: "${run:?}"
steps=()
failed=()
begun=$SECONDS

clock() { printf '%d min %02d s' $(($1 / 60)) $(($1 % 60)); }

# step NAME COMMAND...: runs a command as a step, and returns its exit code.
step() {
  local name=$1 code=0 at=$SECONDS
  shift
  echo "$run: $name: $*"
  "$@" || code=$?
  steps+=("$(printf '%-16s %15s  %s' "$name" "$(clock $((SECONDS - at)))" "$([ $code = 0 ] && echo passed || echo "FAILED ($code)")")")
  [ $code = 0 ] || failed+=("$name")
  return $code
}

# summary MINUTES: prints a table of the steps, their total time, and a verdict. MINUTES is the allowed total time.
# Returns 1 if a step failed.
summary() {
  local total=$((SECONDS - begun))
  echo "$run: times"
  printf '  %s\n' "${steps[@]}"
  printf '  %-16s %15s  of at most %d min\n' all "$(clock $total)" "$1"
  [ $total -le $(($1 * 60)) ] || echo "$run: WARNING: it took longer than it may; see tests/README.md" >&2
  if [ ${#failed[@]} -gt 0 ]; then
    echo "$run: FAILED: ${failed[*]}" >&2
    return 1
  fi
  echo "$run: everything holds"
}
