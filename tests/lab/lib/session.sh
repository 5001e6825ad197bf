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
