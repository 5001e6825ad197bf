#!/usr/bin/env bash
# A recorded session, all of its messages decoded by the libraries that Foxglove reads with (scripts/peers installs them).
#   recording.sh KNUCKLE [FILE]   with FILE: this recording, instead of one made for the purpose
# shellcheck source=scripts/common.sh
source "$(dirname "$0")/../../scripts/common.sh"

knuckle=$1
file=${2-}
export NODE_PATH=$PWD/build/peers/node_modules
if ! command -v node > /dev/null || [[ ! -d $NODE_PATH/@foxglove/schemas ]]; then
  echo "peers: SKIPPED: no node or no @foxglove/schemas; scripts/peers installs it"
  exit 77
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if [[ -z $file ]]; then
  file=$folder/session.mcap
  # 1: the session missed a bound of its scenario; it has run, and is recorded.
  "$knuckle" simulate --scenario dismantle --log "$file" > "$folder/output" || (($? == 1)) || fail "$(cat "$folder/output")"
fi
node tests/peers/recording_decode.cjs "$file"
