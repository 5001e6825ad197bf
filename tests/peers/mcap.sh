#!/usr/bin/env bash
# Files that our writer makes, read by us and by @mcap/core (scripts/peers installs it): both must find the same.
#   mcap.sh MCAP_ACCOUNT [FILE...]   with FILEs: these, instead of files made for the purpose
# shellcheck source=tests/peers/common.sh
source "$(dirname "$0")/common.sh"

account=$1
shift
needs_module @mcap/core
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
