# A whole session on the kernel's interfaces: an operator at a USB haptic device leads a machine on a CAN bus over UDP,
# approaches a wall, presses, holds, lets go. First through hidraw; then a short one through libusb.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh
. /lab/lib/session.sh

replays() { knuckle replay "$1" > "$result/replay.txt" 2>&1; }

# session NAME BACK_END SCENARIO LONGEST_S
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

hosts_up 10
vcan_up vcan0
gadget_make
gadget_plug
within 5 test -c /dev/hidraw0

# Free motion before the wall is shorter than the scenario's: seconds are dear here, and the estimate needs no more.
sed '/^name = "warm_up"/,/^duration_s/s/^duration_s.*/duration_s = 8/' /config/scenarios/wall_contact.toml > /tmp/wall_contact.toml
session hid hid /tmp/wall_contact.toml 120
check "hid: the bucket met the wall" of hid.node '(.events | map(.what) | index("contact")) and .peak_tip_force_N > 1000'
check "hid: ... and it was felt in the hand" of hid.device '.felt_peak_N > 1.5 and .felt_peak_N < 6'
check "hid: ... without energy from nowhere" of hid.device '.energy_to_hand_J < 0.05'

session usb usb /lab/sweep.toml 40
plan
