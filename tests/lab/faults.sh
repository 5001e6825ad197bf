# What fails in a session: on the machine's bus, by whoever does not belong there, and at the session's ends. Each fault ends
# in neutral, is named, and nothing moves again by itself. Between them what changes on the bus while the machine's side
# runs, or before it can.
# shellcheck shell=dash disable=SC2154,SC2034,SC2016,SC2086
. /lab/lib/faults.sh

# An interface that is not there when the machine's side starts, as at boot.
alone="knuckle slave --machine solar015 --can late0 --listen 127.0.0.1:5683 --insecure --no-log"
start refused $alone
exit_code_of refused
check "by hand, a missing interface is refused with exit code 2" test $? -eq 2
check "... and named" holds "$result/refused.log" '"late0": no such interface'
start late $alone --wait-for-can --json "$result/late.json"
sleep 11
waits() { [ "$(grep -c "$2" "$result/$1.log")" -eq "$3" ]; }
check "told to wait, it says at once what for" waits late 'slave: waiting for CAN interface late0: no such interface' 1
check "... and once more after 10 s" waits late 'still waiting for CAN interface late0: no such interface' 1
ip link add dev late0 type vcan
sleep 10
check "an interface that is down is waited for, too" waits late 'still waiting for CAN interface late0: is down' 1
ip link set late0 txqueuelen 1000 up
start late.node knuckle node --can late0
check "once it is up, the machine's side goes on by itself" within 5 holds "$result/late.log" 'late0 is up'
check "... and sets the nodes up" within 5 holds "$result/late.log" ' ready'
stop late
stop late.node
check "... and ends in order" says "$result/late.json" '.stop.confirmed'

faults_set_up

# -- the bus
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nothing from the slave arrives, no SYNC either
fault bus_cut sensor_stale 'cangw -F' gateway_up
fault can_down bus_down 'ip link set vcan0 down' 'ip link set vcan0 up'
# What a controller says of itself, as error frames: QEMU's makes none. Restarted, it is well again.
fault bus_off bus_off 'cansend vcan0 20000040#0000000000000000' 'cansend vcan0 20000100#0000000000000000'
unset COMMAND_MS SPOOL_MS WITNESS
fault no_acknowledge bus_passive 'cansend vcan0 20000024#0020000000008000' 'cansend vcan0 20000004#0040000000000000'

# Not the node of the machine file: nobody can engage the machine, however often the operator tries.
record wrong_identity vcan1 marks
mark $breaking
mark $broken
start_machine wrong_identity vcan0 vcan1 /lab/sweep.toml --fault wrong_identity:boom_valve@0
sleep 3
mark $mended
stop_machine wrong_identity
mark $over
stop recorder
keep_result wrong_identity node_identity "never engaged"
cat /tmp/fault.json >> "$result/faults.jsonl"
check "wrong_identity: the machine is never engaged, nothing moves, and the node is named" \
  says /tmp/fault.json '(.reason // "" | startswith("boom_valve (node 0x10)")) and .code == .expected and .resumed == 0'
check "wrong_identity: never engaged" of wrong_identity.slave '.modes | map(.mode) | index("engaged") | not'

# Frames of the highest priority until the bus is 95 % full: the kernel keeps them from the slave, and work goes on.
start_machine babble vcan0 vcan1 /lab/sweep.toml --fault babble@usr1+1
within 20 holds "$result/babble.slave.log" ' engaged'
record babble vcan1 marks
sleep 1.3
mark $breaking
signal babble.node USR1
mark $broken
sleep 1
mark $mended
sleep 0.3
mark $over
stop_machine babble
stop recorder
keep_result babble none "goes on working, no frame lost"
cat /tmp/fault.json >> "$result/faults.jsonl"
check "babble: more than 1000 frames in a second" test "$(grep -c ' 001#' "$result/babble.candump.log")" -gt 1000
check "babble: no fault, no frame lost, the machine goes on moving" of babble.slave \
  '.faults == [] and (.can_counters | [.queue_full, .overflows] | add == 0)'
check "babble: ... and was moving" says /tmp/fault.json .moved

# -- what changes on the bus
# engaged_times NAME TIMES: how often it has been engaged.
engaged_times() { [ "$(cat "$result/$1.slave.log" 2> /dev/null | grep -c ' engaged')" -ge "$2" ]; }

# The adapter: its interface goes, and comes back under the same name as another one.
start_machine pulled vcan0 vcan1 /lab/sweep.toml
within 20 engaged_times pulled 1
record pulled vcan1 marks
sleep 1.3
begin "pulling the adapter"
mark $breaking
ip link del vcan0
mark $broken
check "pulled: the machine stops, and the reason is the interface" within 2 holds "$result/pulled.slave.log" 'fault bus_down'
sleep 1
check "pulled: the machine's side goes on running" runs pulled.slave
vcan_up vcan0
cangw -F
gateway_up
mark $mended
sleep 0.7
mark $over
check "pulled: plugged in again, it is found" within 2 holds "$result/pulled.slave.log" 'vcan0 is there again'
check "pulled: the operator leads again" within 30 engaged_times pulled 2
sleep 0.5
stop recorder
stop_machine pulled
check "pulled: one fault, and it stayed until then" of pulled.slave '.faults | length == 1 and .[0].code == "bus_down"'
check "pulled: it ends in order, over the new interface" of pulled.slave '.stop.confirmed'
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nothing from the slave arrives
keep_result pulled bus_down
unset COMMAND_MS SPOOL_MS WITNESS
check "pulled: $(cat /tmp/fault.words)" fault_is passed true || sed 's/^/# /' /tmp/fault.json
cat /tmp/fault.json >> "$result/faults.jsonl"

# The gateway as a node whose firmware does not keep to its mapping: the frames of the arm's encoder get another length.
relay() { cangw -A -s vcan1 -d vcan0 -e -f 1B1:7FF "$@"; }
relay_off() { cangw -D -s vcan1 -d vcan0 -e -f 1B1:7FF "$@"; }
cangw -F
cangw -A -s vcan0 -d vcan1 -e
cangw -A -s vcan1 -d vcan0 -e -f 1B1~7FF
relay
short() { relay -m SET:L:000.4.0000000000000000 && relay_off; }
long() { relay -m SET:L:000.8.0000000000000000 && relay_off; }
whole() { relay && relay_off -m "$1"; }
fault short_frames frame_short short 'whole SET:L:000.4.0000000000000000'
check "short_frames: the operator reads how many bytes came" \
  holds /tmp/fault.json 'arm_encoder (node 0x31): .*frame has 4 bytes, 6 are mapped'

# A service tool that sets a node to pre-operational.
fault pre_operational node_fault 'cansend vcan1 000#8022' 'cansend vcan1 000#0122'
check "pre_operational: the operator reads which node, and what it is" \
  holds /tmp/fault.json 'arm_head_pressure (node 0x22): .*it is pre-operational'

start_machine long_frames vcan0 vcan1 /lab/sweep.toml
within 20 engaged_times long_frames 1
record long_frames vcan0
long
sleep 1
check "long_frames: frames of 8 bytes came" test "$(grep -c ' 1B1#[0-9A-F]\{16\}$' "$result/long_frames.candump.log")" -gt 100
stop recorder
stop_machine long_frames
whole SET:L:000.8.0000000000000000
check "long_frames: their first bytes were used" of long_frames.slave '.faults == []'

# -- device, cable, programs, network
cangw -F
gateway_up
fault usb_unplugged device_lost gadget_unplug gadget_plug
fault device_stalled device_stale 'signal all.device STOP' 'signal all.device CONT'
fault reports_wrong_crc device_report 'bad_reports 64' 'signal all.device CONT'
COMMAND_MS=210 SPOOL_MS=330  # datagrams on the way arrive 10 ms after the cut
fault link_cut link_lost link_cut link_mend
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nobody sends SYNC
fault slave_killed none 'signal "$name.slave" KILL' :
plan
