# The machine's side against simulated nodes on the kernel's CAN, first vcan, then two controllers with their driver:
# without an operator's side all comes alive, and nothing moves.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh

nodes="10 11 12 20 21 22 23 24 25 30 31 32 38 40"
seen() { grep -c -e " $2" "$result/$1.candump.log"; }
at_least() { [ "$(seen "$1" "$3")" -ge "$2" ]; }
never() { [ "$(seen "$1" "$2")" -eq 0 ]; }
heartbeats() { for node in $nodes; do at_least "$1" 20 "7$node#05" || return 1; done; }
# Pressures and lengths with every SYNC, tilt with every second one, valves with every fourth.
values() {
  for node in 20 21 22 23 24 25 30 31 32; do at_least "$1" 392 "$(printf '%X' $((0x180 + 0x$node)))#" || return 1; done
  at_least "$1" 196 '1B8#' || return 1
  for node in 10 11 12; do at_least "$1" 98 "$(printf '%X' $((0x180 + 0x$node)))#" || return 1; done
}
json() { says "$result/$1.json" "$2"; }

# machine_alone NAME SLAVES_INTERFACE NODES_INTERFACE
machine_alone() {
  record "$1" "$2"
  start "$1.node" knuckle node --can "$3" --json "$result/$1.node.json"
  start "$1.slave" knuckle slave --machine solar015 --can "$2" --listen 127.0.0.1:5683 --insecure --json "$result/$1.json"
  within 3 holds "$result/$1.slave.log" 'ready'
  cansend "$2" 610#40EFBE0000000000  # reads object 0xBEEF, which no valve has
  sleep 2
  check "$1: the slave still runs" runs "$1.slave"
  stop "$1.slave"
  check "$1: ... and ends in order: valves disabled, pilot pressure off" json "$1" '.stop.confirmed'
  sleep 0.2
  stop "$1.node"
  stop recorder
  check "$1: within a second all nodes are set up and all sensors alive" json "$1" '.modes[] | select(.mode == "ready") | .at_s < 1'
  check "$1: engaging is impossible without an operator's side" json "$1" '.modes | map(.mode) == ["self_test", "ready", "off"]'
  check "$1: ... and the slave says why" holds "$result/$1.slave.log" 'ready, link_lost: no new packet over the link'
  check "$1: no fault" json "$1" '.faults == []'
  check "$1: SYNC comes 200 times a second" at_least "$1" 392 '080#'
  check "$1: all 14 nodes are operational" heartbeats "$1"
  check "$1: ... and send their values with SYNC" values "$1"
  check "$1: an object that no node has is refused with its code" at_least "$1" 1 '590#80EFBE0000000206'
  check "$1: no other SDO was refused" test "$(seen "$1" '5[89A-F][0-9A-F]#80')" -eq 1
  check "$1: no valve was ever told to move" never "$1" '21[012]#....[0-9A-F]*[1-9A-F]'
  check "$1: pilot pressure was never asked for" never "$1" '240#0*[1-9A-F]'
  check "$1: no frame was lost or refused" json "$1" '.can_counters | [.queue_full, .overflows, .not_sendable, .error_frames] | add == 0'
}

vcan_up vcan0
machine_alone vcan vcan0 vcan0
sja1000_up can0
sja1000_up can1
machine_alone sja1000 can0 can1
check "sja1000: neither controller saw an error" sh -c '! ip -details link show | grep -e "can state" | grep -v ERROR-ACTIVE'
plan
