# What fails in the machine's nodes and on their bus: each fault ends in neutral, is named, and nothing moves again by itself.
# In virtual time the same faults are in every run of the tests; here, of the deep ones.
# shellcheck shell=dash disable=SC2154,SC2034,SC2016,SC2086
. /lab/lib/faults.sh
faults_set_up

# -- the bus
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nothing from the slave arrives, no SYNC either
fault bus_cut sensor_stale 'cangw -F' gateway_up
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
within 20 holds "$result/long_frames.slave.log" ' engaged'
record long_frames vcan0
long
sleep 1
check "long_frames: frames of 8 bytes came" test "$(grep -c ' 1B1#[0-9A-F]\{16\}$' "$result/long_frames.candump.log")" -gt 100
stop recorder
stop_machine long_frames
whole SET:L:000.8.0000000000000000
check "long_frames: their first bytes were used" of long_frames.slave '.faults == []'

cangw -F
gateway_up

# -- the nodes
usr1='signal "$name.node" USR1'
fault node_silent_pressure sensor_stale "$usr1" : node_silent:arm_head_pressure@usr1+1
fault node_silent_encoder sensor_stale "$usr1" : node_silent:boom_encoder@usr1+1
fault sensor_invalid sensor_invalid "$usr1" : sensor_invalid:boom_head_pressure@usr1+1
fault encoder_broken sensor_invalid "$usr1" : encoder_broken:arm_encoder@usr1+1
fault node_emergency node_emergency "$usr1" : node_emergency:boom_valve@usr1+1
fault emcy_storm node_emergency "$usr1" : emcy_storm:arm_encoder@usr1+1
fault e_stop emergency_stop "$usr1" : e_stop@usr1+1
WITNESS=pilot  # a valve tells nothing: its node is silent, waits for its configuration, or hears no SYNC
fault node_silent_valve sensor_stale "$usr1" : node_silent:arm_valve@usr1+1
fault node_reset node_fault "$usr1" : node_reset:boom_valve@usr1+1
fault sync_dropped sensor_stale "$usr1" : sync_dropped@usr1+1
unset WITNESS
# Found once the valve is asked to be elsewhere, or by what the other sensors say: within the swing of the sweep.
BROKEN_S=2 COMMAND_MS=2000 SPOOL_MS=2100
fault valve_stuck node_emergency "$usr1" : valve_stuck:arm_valve@usr1+2
fault sensor_frozen sensor_implausible "$usr1" : sensor_frozen:boom_encoder@usr1+2
unset BROKEN_S
plan
