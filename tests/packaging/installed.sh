#!/usr/bin/env bash
# What `cmake --install` makes below a prefix works from there: program, data, manual pages, completion, service.
#   installed.sh BUILD_FOLDER
# shellcheck source=scripts/common.sh
source "$(dirname "$0")/../../scripts/common.sh"

build=$1 folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
prefix=$folder/opt
cmake --install "$build" --prefix "$prefix" > "$folder/log" 2>&1 || fail "cmake --install failed: $(tail -n 2 "$folder/log")"
grep -vE -- "^-- (Installing|Up-to-date): $prefix/|^-- Install configuration|^-- Set (non-toolchain|runtime)" "$folder/log" &&
  fail "something is installed outside the prefix: see above"
unset KNUCKLE_CONFIG_DIR

# Its own data, not the checkout's: whoever changes these sees the change.
rm "$prefix/share/knuckle/machines/compact080.toml"
said=$("$prefix/bin/knuckle" export --machine compact080 --urdf - 2>&1) && fail "the program found a machine that is not installed"
[[ $said == *"$prefix/share/knuckle/machines has solar015"* ]] || fail "the installed program says: $said"
"$prefix/bin/knuckle" simulate --scenario free_motion --duration 1 > "$folder/out" || (($? == 1)) || fail "knuckle simulate failed"
grep -q '^free_motion on solar015' "$folder/out" || fail "knuckle simulate says: $(cat "$folder/out")"
# That of the build still has the checkout's.
"$build/knuckle" export --machine compact080 --urdf - > "$folder/out" || fail "the program of the build finds no machine"

commands=$("$prefix/bin/knuckle" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p')
(($(wc -w <<< "$commands") > 10)) || fail "the help lists: $commands"
for command in $commands; do
  page=$prefix/share/man/man1/knuckle-$command.1.gz
  [[ -f $page ]] || fail "no manual page of $command"
  zcat "$page" > "$folder/page"
  "$prefix/bin/knuckle" "$command" --help | sed -n 's/^  \(-h,\)\?\(--[a-z0-9-]*\).*/\2/p' | while read -r option; do
    grep -qF -- "\\fB${option//-/\\-}\\fP" "$folder/page" || fail "$option is not in knuckle-$command(1)"
  done
done
pages=("$prefix"/share/man/man1/*)
((${#pages[@]} == $(wc -w <<< "$commands") + 1)) || fail "there are pages of commands that are none"
bash -n "$prefix/share/bash-completion/completions/knuckle" || fail "bash cannot read the completion"
[[ -f $prefix/lib/sysusers.d/knuckle.conf && -f $prefix/lib/udev/rules.d/70-knuckle.rules ]] || fail "account or udev rule are missing"
unit=$prefix/lib/systemd/system/knuckle-slave.service
for line in Type=notify WatchdogSec= LimitRTPRIO= LimitMEMLOCK= User=knuckle; do
  grep -q "^$line" "$unit" || fail "the service has no $line"
done
echo "package: installed below a prefix, $(wc -w <<< "$commands") commands with their pages"
