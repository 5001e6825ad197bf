#!/usr/bin/env bash
# Recorded sessions, all of their messages decoded by the libraries that Foxglove reads with (scripts/peers installs them).
#   recording.sh KNUCKLE [FILE...]   with FILEs: these recordings, instead of some made for the purpose
# shellcheck source=tests/peers/common.sh
source "$(dirname "$0")/common.sh"

knuckle=$1
shift
needs_module @foxglove/schemas
files=("$@")
if ((${#files[@]} == 0)); then
  files=("$folder/dismantle.mcap" "$folder/link_faults.mcap")  # contact and a load; events
  for file in "${files[@]}"; do
    # 1: the session missed a bound of its scenario; it has run, and is recorded.
    "$knuckle" simulate --scenario "$(basename "$file" .mcap)" --log "$file" --flights "$folder/flights" > "$folder/output" ||
      (($? == 1)) || fail "$(cat "$folder/output")"
  done
  # With pictures of a camera.
  xvfb-run -a "$knuckle" console --simulate --demo --duration 3 --camera mast=simulated --log "$folder/console" \
    --log-pictures 5 > "$folder/output" 2>&1 || fail "$(cat "$folder/output")"
  files+=("$folder"/console/*.mcap)
fi
for file in "${files[@]}"; do
  node tests/peers/recording_decode.cjs "$file"
done
