# A newcomer's path: README's section "With a real machine", its commands word for word, from the first look to a session.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh
. /lab/lib/session.sh
. /lab/lib/dialogue.sh

awk '/^## / { here = $0 == "## With a real machine" } /^```/ { code = !code; next } here && code' /lab/README.md > /tmp/commands
# The section's one command of this kind.
command_like() { grep -e "$1" /tmp/commands; }
# read_me NAME HOST COMMAND: as a person types it; its exit code.
read_me() { $2 sh -c "$3" > "$result/$1.log" 2>&1; }

# What a reader has: the folder they have cloned and built, can0, a device on USB, and a network in which the machine's
# side is 192.0.2.7.
mkdir -p build/release
ln -s /bin/knuckle build/release/knuckle
ln -s /config config
ip link set can0 name spare0  # QEMU's own controllers are not needed here
vcan_up can0
hosts_up 10
ip addr add 192.0.2.7/32 dev lo
ip -n operator route add 192.0.2.7/32 via 10.0.0.1
gadget_make
gadget_plug
within 5 test -c /dev/hidraw0

# The machine: a documented one, not as its file says. The tape, the spirit level and the eyes of the person who
# commissions it are what is truly so. It stands at an edge, so that the boom gets down to its stop.
{ cat /config/scenarios/free_motion.toml; printf '\n[ground]\nheight_m = -3\n'; } > /tmp/at_an_edge.toml
truth_file=/config/truth/example.toml
mkfifo /tmp/truth
cat /tmp/truth > /tmp/truth.csv &
start node knuckle node --can can0 --scenario /tmp/at_an_edge.toml --truth $truth_file --fault e_stop@usr1+2 --csv /tmp/truth --json "$result/node.json"
within 10 holds "$result/node.log" 'loop runs'

# Waits for what is so now: of what is written, up to 8 KB are still on their way.
written() { stat -c %s /tmp/truth.csv; }
has_written() { [ "$(written)" -ge "$1" ]; }
look() { within 10 has_written $(($(written) + 16384)); }
# true_length JOINT: pin to pin, in mm, as seen in the last look.
true_length() {
  tail -n 2 /tmp/truth.csv | awk -F, -v joint="$1" -v names="$(head -n 1 /tmp/truth.csv)" '
    NR == 1 { n = split(names, name); while (n > 1 && name[n] != joint "_cylinder_m") --n; printf "%.1f\n", 1000 * $n }'
}
# stood_still BYTES: since so much was written no cylinder has moved by 0.2 mm, and no spool at all.
stood_still() {
  look
  { head -n 1 /tmp/truth.csv && tail -c "+$1" /tmp/truth.csv | sed -e 1d -e '$d'; } | awk -F, '
    NR == 1 { for (i = 1; i <= NF; ++i) { length_m[i] = $i ~ /_cylinder_m$/; spool[i] = $i ~ /_spool$/ } next }
    NR == 2 { split($0, start) }
    { for (i = 1; i <= NF; ++i) {
      way = $i - start[i]
      moved += length_m[i] && (way > 2e-4 || way < -2e-4) || spool[i] && ($i > 0.01 || $i < -0.01)
    } }
    END { exit !(NR > 400 && moved == 0) }'
}

nodes="boom_valve arm_valve bucket_valve boom_head_pressure boom_rod_pressure arm_head_pressure arm_rod_pressure
  bucket_head_pressure bucket_rod_pressure boom_encoder arm_encoder bucket_encoder tilt enable"
lists_all_nodes() {
  for node in $nodes; do grep -q -e "^0x.. *$node  *[a-z -]*  *4[01][0-9] " "$1" && grep -q -e "^ok .*$node: as the machine file" "$1" || return 1; done
}
all_well() { [ "$2" -eq 0 ] && holds "$1" '^nothing wrong' && not holds "$1" '^FAULT'; }
# all_well_or_told LOG EXIT_CODE: or 1, and a FAULT that says what is missing.
all_well_or_told() { all_well "$1" "$2" || { [ "$2" -eq 1 ] && holds "$1" '^something is wrong' && holds "$1" '^FAULT'; }; }
# Uploads and their answers, the question whether a device has no node id, boot-ups and heartbeats of nodes: no NMT, no
# SYNC, no process data, no download.
only_reads() {
  holds "$1" ' 6..#40' && not grep -q -v -E ' (6[0-9A-F]{2}#40[0-9A-F]{14}|7E5#4C0{14}|5[89A-F][0-9A-F]#.*|7[0-9A-F]{2}#(00|7F))$' "$1"
}

check "README's section has the nine commands that are tried here" test "$(wc -l < /tmp/commands)" -eq 9
check "the machine file is copied" sh -c "$(command_like '^cp ')"

read_me doctor "" "$(command_like 'doctor$')"
check "doctor of this computer: all is well, or each fault is told" all_well_or_told "$result/doctor.log" $?
check "... and it names the interface to look at next" holds "$result/doctor.log" '^ok .*SocketCAN: .*can0.*knuckle doctor --can can0'

look
before=$(written)
record doctor can0
read_me doctor_can "" "$(command_like 'doctor --can')"
check "doctor of the bus: nothing wrong" all_well "$result/doctor_can.log" $?
stop recorder
check "... with a line for each of the 14 nodes" lists_all_nodes "$result/doctor_can.log"
check "... which has only read" only_reads "$result/doctor.candump.log"
check "... and nothing has moved" stood_still "$before"

# First motions. What the cylinder did is what was seen; lengths are what the tape shows.
talk_to commission "$(command_like 'knuckle commission')"
answer 'hand on the machine' ready
answer 'nodes are configured and started' configure
asked "Press the machine's E-stop" && signal node USR1 && within 5 holds "$result/node.log" 'fault injected: e_stop'
answer "Press the machine's E-stop" pressed
asked 'Release the E-stop' && within 10 holds "$result/node.log" 'fault ended: e_stop'
answer 'Release the E-stop' released
answer 'slope by a spirit level' "$(awk '/^hull_pitch_deg/ { print $3 }' $truth_file)"
answer 'pilot pressure on for two seconds' pilot
answer 'what stops the machine without this computer' guards
answer 'one cylinder at a time' move
for joint in boom arm bucket; do
  for way in extends retracts; do
    asked "$joint cylinder $way" && look && was=$(true_length $joint)
    answer "$joint cylinder $way" go
    asked 'What did that cylinder do' && look && is=$(true_length $joint)
    answer 'What did that cylinder do' "$(awk "BEGIN { way = $is - $was; print (way > 5 ? \"longer\" : way < -5 ? \"shorter\" : \"still\") }")"
  done
done
# Where there is no room, ends are skipped.
for joint in boom arm bucket; do
  room=$([ $joint = boom ] && echo go || echo skip)
  answer "$joint: extends to its stop" "$room"
  answer "$joint: retracts to its stop" "$room"
  [ "$room" = skip ] || answer "$joint: moves back to the middle" go
  asked "$joint: the cylinder's length" && look
  answer "$joint: the cylinder's length" "$(true_length $joint)"
  answer "$joint: the encoder reads" preset
done
# One joint stands for all: tests/bringup has all three, in virtual time.
for joint in boom arm bucket; do answer "$joint: slow ramps" "$([ $joint = boom ] && echo go || echo skip)"; done
answer 'Motion of all joints' finish
check "commission: comes to its end" end_of_talk
check "... having asked what its guide says, in that order ($unanswered)" test -z "$unanswered"
check "... and says what is next" holds "$result/commission.log" '^written: found.toml'
cp found.toml "$result"
check "... and all guards are proved" test "$(grep -c '^proved = true' found.toml)" -eq 4

# of_axis JOINT KEY EXPECTED TOLERANCE: what was found.
of_axis() {
  awk -v table="[commissioning.axes.$1]" -v key="$2" -v expected="$3" -v tolerance="$4" '
    /^\[/ { here = $0 == table } here && $1 == key { off = $3 - expected; good = off <= tolerance && off >= -tolerance }
    END { exit !good }' found.toml
}
# The dead bands to 1.5 % of stroke, zeros to a step of the encoder and its noise, as config/truth/example.toml has them.
check "... boom: dead bands and zero found" eval 'of_axis boom dead_band_extend 0.115 0.015 &&
  of_axis boom dead_band_retract 0.104 0.015 && of_axis boom encoder_offset_mm 0.3 0.25'
check "... arm: zero found" of_axis arm encoder_offset_mm -0.2 0.25
check "... bucket: zero found" of_axis bucket encoder_offset_mm 0.4 0.25
check "... the way between the boom's stops" of_axis boom stroke_mm 355 25
check "... all encoders preset" test "$(grep -c '^encoder_preset = true' found.toml)" -eq 3

read_me doctor_found "" "$(command_like 'doctor --can' | sed 's/my_machine/found/')"
check "commission leaves a bus as found.toml says, without a fault" all_well "$result/doctor_found.log" $?
check "... all 14 nodes" lists_all_nodes "$result/doctor_found.log"

start device $on_operators_host knuckle device --gadget /dev/hidg0
within 10 holds "$result/device.log" 'loop runs'
read_me doctor_device "$on_operators_host" "$(command_like 'doctor --device')"
check "doctor of the device: nothing wrong" all_well "$result/doctor_device.log" $?
check "... it describes itself" holds "$result/doctor_device.log" '^ok .*describes itself, serial number 1'
check "... and reports a thousand times a second" holds "$result/doctor_device.log" '^ok .*reports: \(9[89]\|10[012]\).* 0 damaged'
stop device

# Each computer has a home of its own, and a person who types yes.
mkdir /home_of_machine /home_of_operator
export HOME=/home_of_machine
operator="$on_operators_host env HOME=/home_of_operator"
start pair_machine sh -c "echo yes | $(command_like 'pair --listen')"
start pair_operator $operator sh -c "echo yes | $(command_like 'pair --connect')"
check "pair: the machine's computer" exit_code_of pair_machine
check "pair: the operator's computer" exit_code_of pair_operator
code_of() { grep -e '^code: ' "$result/$1.log"; }
check "... both show the same code" test -n "$(code_of pair_machine)" -a "$(code_of pair_machine)" = "$(code_of pair_operator)"

# Work. The one thing added: a picture for the simulated operator, who sees what --mirror shows.
record session can0,210:7FC
start slave sh -c "exec $(command_like 'knuckle slave')"
start device $on_operators_host knuckle device --gadget /dev/hidg0 --scenario /lab/sweep.toml --screen 127.0.0.1:5690 \
  --json "$result/device.json"
start master $operator sh -c "exec $(command_like 'knuckle master') --mirror 127.0.0.1:5690"
check "slave and master: the operator engages the machine" within 60 holds "$result/slave.log" ' engaged'
check "... leads it, and lets go" exit_code_of device
check "... having moved its valves over CAN" holds "$result/session.candump.log" ' 21[012]#.[7F]00.*[1-9A-F]'
signal master TERM
check "SIGTERM ends the master in order" exit_code_of master
check "... letting go of machine and device" holds "$result/master.log" 'stopped: machine and device released'
signal slave TERM
check "SIGTERM ends the slave in order" exit_code_of slave
check "... with valves disabled and pilot pressure off" holds "$result/slave.log" 'stopped: valves disabled, pilot pressure off'
check "... and the audit trail says who had control" sh -c "knuckle audit /home_of_machine/.config/knuckle/audit | grep -q control_taken"
check "... and no fault before the device had gone" not holds "$result/slave.log" 'fault \(node\|sensor\|bus\|safety\)'
stop recorder
stop node
plan
