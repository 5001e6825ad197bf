# What all tests stand on: CAN, USB HID and the network of a stock kernel do here what they do on a machine. Then the machine's
# side against simulated nodes on the kernel's CAN, first vcan, then two controllers with their driver: without an
# operator's side all comes alive, and nothing moves.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh

vcan_up vcan0
candump -L vcan0,0:0,#FFFFFFFF > /tmp/vcan.log &
sleep 0.2
cansend vcan0 181#0F00E803
cansend vcan0 20000004#0004000000000000  # an error frame, as a controller that has gone passive makes it
check "frames and error frames pass a virtual CAN interface" within 5 holds /tmp/vcan.log '20000004#0004'
check "... in order" holds /tmp/vcan.log '181#0F00E803'

sja1000_up can0
sja1000_up can1
candump -L can1 > /tmp/sja.log &
candump -L can0 > /tmp/sja_back.log &
sleep 0.2
cansend can0 123#1122334455667788
check "one SJA1000 hears the other" within 5 holds /tmp/sja.log '123#1122334455667788'
cansend can1 701#05
check "... and the other way round" within 5 holds /tmp/sja_back.log '701#05'
check "both are error active" sh -c 'ip -details link show can0 | grep -q ERROR-ACTIVE'

gadget_make
gadget_plug
check "the gadget is a hidraw device" within 5 test -c /dev/hidraw0
check "... with the vendor and product of the haptic device" holds /sys/class/hidraw/hidraw0/device/uevent 'HID_ID=0003:00001209:00000001'
check "... and its end of the cable" test -c /dev/hidg0
head -c 64 /dev/zero | tr '\000' '\001' > /tmp/report
dd if=/dev/hidraw0 of=/tmp/read bs=64 count=1 2> /dev/null &
reader=$!
sleep 0.1
timeout 5 dd if=/tmp/report of=/dev/hidg0 bs=64 2> /dev/null
wait $reader
check "a report passes from the device to its driver" cmp /tmp/report /tmp/read
gadget_unplug
check "unplugged, it is gone" within 5 not test -e /dev/hidraw0

ip netns add operator
ip link add to_operator type veth peer name to_machine netns operator
ip addr add 10.0.0.1/24 dev to_operator
ip -n operator addr add 10.0.0.2/24 dev to_machine
ip link set to_operator up
ip -n operator link set to_machine up
tc qdisc add dev to_operator root netem delay 20ms
check "two hosts with a slow link between them" ping -c 1 -W 2 10.0.0.2
tc qdisc replace dev to_operator root netem loss 100%
check "... which can be cut" not ping -c 1 -W 1 10.0.0.2
killall candump

# -- the machine's side alone
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

machine_alone vcan vcan0 vcan0
machine_alone sja1000 can0 can1
check "sja1000: neither controller saw an error" sh -c '! ip -details link show | grep -e "can state" | grep -v ERROR-ACTIVE'

# A machine without nodes, led through its own controller: identifiers of 29 bits pass the filters, nobody sends SYNC.
record own vcan0
start own.node knuckle node --machine standard200 --can vcan0
start own.slave knuckle slave --machine standard200 --can vcan0 --listen 127.0.0.1:5683 --insecure --json "$result/own.json"
check "own: all sensors come by themselves" within 3 holds "$result/own.slave.log" 'ready'
sleep 2
stop own.slave
check "own: it ends in order" json own '.stop.confirmed'
stop own.node
stop recorder
check "own: no fault" json own '.faults == []'
check "own: the machine is told 100 times a second ..." at_least own 196 '18FF0105#'
neutral_only() { ! grep -e ' 18FF0105#' "$result/own.candump.log" | grep -qv -e '#007D007D007D007D$'; }
check "own: ... and never to move" neutral_only
check "own: nobody leads it" never own '18FF0205#...[^0]'
check "own: no SYNC, no heartbeat, no NMT" never own '\(080\|000\|701\)#'

# The same with its commands on one bus and what it sends on another, of which the cable's adapter is pulled.
awk '/^\[bus\]/ { print "[[bus]]\nname = \"commands\""; next }
  /^\[\[bus.broadcast/ && !n++ { print "[[bus]]\nname = \"sensors\"\nbit_rate_kbps = 250" } { print }' \
  /config/machines/standard200.toml > /tmp/two_buses.toml
vcan_up vcan1
record two vcan0 vcan1
start two.node knuckle node --machine /tmp/two_buses.toml --can sensors=vcan1 --can commands=vcan0
start two.slave knuckle slave --machine /tmp/two_buses.toml --can commands=vcan0 --can sensors=vcan1 --listen 127.0.0.1:5683 --insecure \
  --json "$result/two.json"
check "two: all sensors come over the second bus" within 3 holds "$result/two.slave.log" 'ready'
sleep 2 # the recorder ends with the first bus that goes
ip link set vcan1 down
check "two: its loss is a fault by its name" within 2 holds "$result/two.slave.log" 'fault bus_down: bus sensors'
sleep 0.5
stop two.slave
stop two.node
stop recorder
check "two: the other bus went on" json two '.can_counters | .commands.downs == 0 and .sensors.downs == 1'
check "two: commands are on the first bus alone ..." at_least two 100 'vcan0 18FF0105#'
check "two: ... and sensors on the second" never two '\(vcan1 18FF0105\|vcan0 18FF1021\)#'
plan
