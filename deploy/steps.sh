# shellcheck shell=bash
# Steps of a long run, each with its time by the clock, for .ci/run and deploy/nightly: source it, set `run` to the run's name, call
# `step NAME COMMAND...` for each, and `summary` in the end.

: "${run:?}"
steps=()
failed=()
begun=$SECONDS

clock() { printf '%d min %02d s' $(($1 / 60)) $(($1 % 60)); }

# Returns what the command returned.
step() {
  local name=$1 code=0 at=$SECONDS
  shift
  echo "$run: $name: $*"
  "$@" || code=$?
  steps+=("$(printf '%-16s %15s  %s' "$name" "$(clock $((SECONDS - at)))" "$([ $code = 0 ] && echo passed || echo "FAILED ($code)")")")
  [ $code = 0 ] || failed+=("$name")
  return $code
}

# A table of the steps so far, their sum, and a verdict; $1: minutes that the whole may take. Returns 1 if a step failed.
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
