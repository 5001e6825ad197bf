# What a kernel does to a session whose CAN interface or USB device is not there yet, goes down, goes bus-off, is pulled, and
# comes back. Each fault ends in neutral, is named, and nothing moves again by itself. What else can fail has twins in
# virtual time in every run of the tests; here it is in node_faults.sh and program_faults.sh, of the deep ones.
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
fault can_down bus_down 'ip link set vcan0 down' 'ip link set vcan0 up'
# What a controller says of itself, as error frames: QEMU's makes none. Restarted, it is well again.
fault bus_off bus_off 'cansend vcan0 20000040#0000000000000000' 'cansend vcan0 20000100#0000000000000000'
unset COMMAND_MS SPOOL_MS WITNESS

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

fault usb_unplugged device_lost gadget_unplug gadget_plug
plan
