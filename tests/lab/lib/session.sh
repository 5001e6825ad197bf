# Sourced by tests with an operator's and a machine's side: who runs where, and how they are reached.
#
#   host "operator": knuckle device (hand and firmware) = USB = knuckle master
#                                                          | UDP over a slow link
#   this host, the machine's:                           knuckle slave = CAN = knuckle node
# shellcheck shell=dash disable=SC2154
on_operators_host="ip netns exec operator"

# hosts_up ONE_WAY_MS
hosts_up() {
  ip netns add operator
  ip -n operator link set lo up
  ip link add to_operator type veth peer name to_machine netns operator
  ip addr add 10.0.0.1/24 dev to_operator
  ip -n operator addr add 10.0.0.2/24 dev to_machine
  ip link set to_operator up
  ip -n operator link set to_machine up
  tc qdisc add dev to_operator root netem delay "$1ms"
  tc -n operator qdisc add dev to_machine root netem delay "$1ms"
}
# What the machine hears is cut last.
link_cut() { tc qdisc replace dev to_operator root netem loss 100% && tc -n operator qdisc replace dev to_machine root netem loss 100%; }
link_mend() { tc qdisc replace dev to_operator root netem delay 10ms && tc -n operator qdisc replace dev to_machine root netem delay 10ms; }

# start_operator NAME BACK_END SCENARIO
start_operator() {
  start "$1.device" $on_operators_host knuckle device --gadget /dev/hidg0 --scenario "$3" --screen 127.0.0.1:5690 \
    --json "$result/$1.device.json"
  start_master "$1" "$2"
}
start_master() {
  start "$1.master" $on_operators_host knuckle master --machine solar015 --device "$2" --connect 10.0.0.1:5683 --insecure --insecure \
    --mirror 127.0.0.1:5690 --json "$result/$1.master.json"
}
# start_machine NAME SLAVES_INTERFACE NODES_INTERFACE SCENARIO [NODE_OPTION...]
start_machine() {
  local machine=$1 slaves=$2 nodes=$3 scenario=$4
  shift 4
  start "$machine.node" knuckle node --can "$nodes" --scenario "$scenario" --json "$result/$machine.node.json" "$@"
  start_slave "$machine" "$slaves"
}
start_slave() {
  start "$1.slave" knuckle slave --machine solar015 --can "$2" --listen 10.0.0.1:5683 --insecure --insecure --json "$result/$1.slave.json"
}
stop_machine() {
  stop "$1.slave"
  stop "$1.node"
}

# of NAME.PROGRAM EXPRESSION: true of the result of that program.
of() { says "$result/$1.json" "$2"; }

replays() { knuckle replay "$1" > "$result/replay.txt" 2>&1; }

# session NAME BACK_END SCENARIO LONGEST_S: both sides on one CAN bus, to the end of the scenario.
session() {
  export KNUCKLE_RECORDINGS=/tmp/recordings.$1
  record "$1" vcan0
  start_machine "$1" vcan0 vcan0 "$3"
  start_operator "$1" "$2" "$3"
  check "$1: the operator gets to the end of the scenario" within "$4" not runs "$1.device"
  stop "$1.master"
  stop_machine "$1"
  stop recorder
  check "$1: ... with no phase given up" of "$1.device" '.finished and (.phases | map(.timed_out) | any | not)'
  check "$1: the machine was led for as long as the operator was there" of "$1.slave" \
    '(.modes | map(.mode) | index("engaged")) and (.faults == [] or (.faults | map(.code)) == ["device_stale"])'
  check "$1: valves were moved over CAN" holds "$result/$1.candump.log" ' 21[012]#.[7F]00.*[1-9A-F]'
  check "$1: the firmware never had to take the torque away" of "$1.device" '.latches | map(select(.at_s > 1)) == []'
  check "$1: no CAN frame was lost" of "$1.slave" '.can_counters | [.queue_full, .overflows, .not_sendable, .error_frames] | add == 0'
  check "$1: the machine's side ends in order" of "$1.slave" '.stop.confirmed'
  check "$1: both sides were recorded without a gap" of "$1.slave" '.recording | .steps_lost == 0 and .problem == null and .bytes > 100000'
  check "$1: ... the machine's side runs again bit by bit" replays "$KNUCKLE_RECORDINGS"/*_slave_part001.mcap
  check "$1: ... and so does the operator's" replays "$KNUCKLE_RECORDINGS"/*_master_part001.mcap
}
