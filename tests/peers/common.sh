# What every comparison with npm's libraries begins with.
# shellcheck source=scripts/common.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../scripts/common.sh"

# needs_module NAME: ends the test as skipped where node or the module is not installed.
needs_module() {
  export NODE_PATH=$PWD/build/peers/node_modules
  if ! command -v node > /dev/null || [[ ! -d $NODE_PATH/$1 ]]; then
    echo "peers: SKIPPED: no node or no $1; scripts/peers installs it"
    exit 77
  fi
}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
