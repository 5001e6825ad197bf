# What fails on the machine's bus itself, and who does not belong there: each fault ends in neutral, is named, and nothing moves again by itself.
# shellcheck shell=dash disable=SC2154,SC2034,SC2016,SC2086
. /lab/lib/faults.sh
faults_set_up

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
  says /tmp/fault.json '(.reason // "" | startswith("node 0x10")) and .code == .expected and .resumed == 0'
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
plan
