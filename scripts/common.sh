# Sourced by the other scripts: fail, jobs, build, insert_table. Leaves the shell in the project's root.
# shellcheck shell=bash
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# One clear line, then out.
fail() {
  echo "$(basename "$0"): $*" >&2
  exit 1
}

# Parallel compilers: one per processor, but each may take 1.5 GB.
jobs() {
  local processors gigabytes_x2
  processors=$(nproc)
  gigabytes_x2=$(awk '/MemAvailable/ {print int($2 / 524288)}' /proc/meminfo)
  local by_memory=$((gigabytes_x2 / 3))
  ((by_memory < 1)) && by_memory=1
  echo $((processors < by_memory ? processors : by_memory))
}

# build PRESET [TARGET...]: configures and builds, incrementally; the log is build/PRESET.log.
build() {
  local preset=$1
  shift
  local log=build/$preset.log
  mkdir -p build
  echo "building $preset${*:+: $*}"
  cmake --preset "$preset" > "$log" 2>&1 ||
    fail "configuring $preset failed: $(grep -m1 -A2 'CMake Error' "$log" | tr -s '\n ' ' ') (all of it: $log)"
  local targets=()
  (($#)) && targets=(--target "$@")
  # Ninja's one moving status line on a terminal; elsewhere a line each 15 s, warnings and errors.
  if [[ -t 1 ]]; then
    cmake --build "build/$preset" -j "$(jobs)" "${targets[@]}" || fail "building $preset failed: see the first error above"
    return
  fi
  local ended code step since=$SECONDS
  exec {ended}< <(cmake --build "build/$preset" -j "$(jobs)" "${targets[@]}" >> "$log" 2>&1 && echo 0 || echo 1)
  until read -r -t 15 -u "$ended" code; do
    (($? > 128)) || fail "building $preset was ended"  # not the time-out
    step=$(grep -oE '^\[[0-9]+/[0-9]+\]' "$log" | tail -n 1 | tr -d '[]' || true)
    echo "building $preset: ${step:+step ${step/\// of }, }$((SECONDS - since)) s"
  done
  exec {ended}<&-
  ((code == 0)) || {
    grep -m1 -B1 -A6 'error:' "$log" >&2 || tail -n 20 "$log" >&2
    fail "building $preset failed (all of it: $log)"
  }
}

# insert_table FILE DOCUMENT NAME: puts FILE between the document's markers "<!-- NAME: begin -->" and "... end -->".
insert_table() {
  local begin="<!-- $3: begin -->" end="<!-- $3: end -->" text
  grep -qxF -e "$begin" "$2" && grep -qxF -e "$end" "$2" || fail "$2 has no place for '$3'"
  text=$(awk -v begin="$begin" -v end="$end" -v table="$1" '
    $0 == end { inside = 0 }
    !inside { print }
    $0 == begin { inside = 1; while ((getline line < table) > 0) print line }' "$2")
  printf '%s\n' "$text" > "$2"
}
