# Who else speaks on the machine's bus: a second controller that starts is refused, one foreign frame ends the motion with a
# reason that says what it was, reading is allowed, and a node id that two devices use is named.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/faults.sh

# ended_with CODE NAME: the program ended by itself so.
ended_with() {
  local code=0
  exit_code_of "$2" || code=$?
  [ "$code" -eq "$1" ]
}
another='another controller is on the bus: heard SYNC 0x080, set-point 0x210, set-point 0x211, set-point 0x212, set-point 0x240, heartbeat 0x701'

# Two devices with one id, on a bus that nobody leads. (Without an operator's side, whose USB device costs the lab most of its
# time.)
vcan_up vcan2
start twins.node knuckle node --can vcan2 --fault node_id_twice:tilt@0
start twins.doctor knuckle doctor --machine solar015 --can vcan2
check "doctor: a node id that stands twice is a fault" ended_with 1 twins.doctor
check "doctor: ... and is named" holds "$result/twins.doctor.log" 'node 0x38 tilt: two devices have this node id'
stop twins.node

faults_set_up

# Beside an engaged machine: two that would command it, and one that reads.
start_machine led vcan0 vcan1 /lab/sweep.toml
within 20 holds "$result/led.slave.log" ' engaged'
start second.slave knuckle slave --machine solar015 --can vcan1 --listen 127.0.0.1:5700 --insecure
check "second slave: ends with exit code 2" ended_with 2 second.slave
check "second slave: ... and says what it heard" holds "$result/second.slave.log" "vcan1: $another"
start second.commission knuckle commission --machine solar015 --can vcan1 --out /tmp/second.toml --record /tmp
check "second commission: ends with exit code 2" ended_with 2 second.commission
check "second commission: ... and says what it heard" holds "$result/second.commission.log" "vcan1: $another"
start led.doctor knuckle doctor --machine solar015 --can vcan1
within 60 not runs led.doctor
# Pilot pressure is on, which the doctor does not like: exit code 1.
grep '^FAULT' "$result/led.doctor.log" | grep -v 'pilot pressure is on\|its spool is at' > /tmp/wrong
check "doctor: finds nothing else wrong with a machine that is led" test ! -s /tmp/wrong || sed 's/^/# /' /tmp/wrong
check "doctor: the machine's side says that somebody reads" holds "$result/led.slave.log" 'another program reads objects of the nodes over SDO'
stop_machine led
check "the machine that was led: no fault, and still engaged at the end" of led.slave \
  '.faults == [] and (.modes | map(.mode) | (index("engaged") != null) and .[-2] == "engaged")'

# One frame each, by somebody else.
fault foreign_sync other_controller 'cansend vcan1 080#' :
fault foreign_nmt other_controller 'cansend vcan1 000#0138' :
fault foreign_heartbeat other_controller 'cansend vcan1 701#05' :
fault foreign_set_point foreign_sender 'cansend vcan1 211#07000000' :
fault foreign_enable foreign_sender 'cansend vcan1 240#01' :
fault foreign_write foreign_sender 'cansend vcan1 622#2B17100032000000' :
check "foreign_write: the node is named" holds /tmp/fault.json 'arm_head_pressure (node 0x22): another sender on the bus commands this node'

# A second device joins.
fault node_id_twice node_id_twice 'signal "$name.node" USR1' : node_id_twice:arm_head_pressure@usr1+1
check "node_id_twice: the id is named" holds /tmp/fault.json 'arm_head_pressure (node 0x22): two devices send under this node id'

# Two from the start: the machine never moves.
start_machine twins vcan0 vcan1 /lab/sweep.toml --fault node_id_twice:tilt@0
within 5 holds "$result/twins.slave.log" 'node_id_twice'
check "slave: two devices with one id are found before anything moves" holds "$result/twins.slave.log" \
  'node_id_twice: tilt (node 0x38): two devices send under this node id'
sleep 2
stop_machine twins
check "slave: ... and the machine was never engaged" of twins.slave '.modes | map(.mode) | index("engaged") | not'
plan
