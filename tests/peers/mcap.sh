#!/usr/bin/env bash
# Files that our writer makes, read by us and by @mcap/core (scripts/peers installs it): both must find the same.
#   mcap.sh MCAP_ACCOUNT [FILE...]   with FILEs: these, instead of files made for the purpose
# shellcheck source=scripts/common.sh
source "$(dirname "$0")/../../scripts/common.sh"

account=$1
shift
export NODE_PATH=$PWD/build/peers/node_modules
if ! command -v node > /dev/null || [[ ! -d $NODE_PATH/@mcap/core ]]; then
  echo "peers: SKIPPED: no node or no @mcap/core; scripts/peers installs it"
  exit 77
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
files=("$@")
if ((${#files[@]} == 0)); then
  "$account" --write "$folder"
  files=("$folder"/*.mcap)
fi
for file in "${files[@]}"; do
  "$account" "$file" > "$folder/ours"
  [[ -s $folder/ours ]] || fail "nothing in $file"
  for reader in indexed stream; do
    # Without a summary there is nothing that an indexed reader could use.
    [[ $reader == indexed && $file == */killed.mcap ]] && continue
    node tests/peers/mcap_account.cjs "$reader" "$file" > "$folder/theirs"
    diff "$folder/ours" "$folder/theirs" || fail "$reader reader of @mcap/core finds something else in $file"
    echo "$(basename "$file"): $reader reader of @mcap/core agrees on $(wc -l < "$folder/ours") lines"
  done
done
