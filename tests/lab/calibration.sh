# The haptic device is calibrated as docs/haptic-device.md has it: by a person who leads it to its stops, one after the other.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh
. /lab/lib/session.sh
. /lab/lib/dialogue.sh

all_well() { [ "$2" -eq 0 ] && holds "$1" '^nothing wrong' && not holds "$1" '^FAULT'; }
hosts_up 10
gadget_make
gadget_plug
within 5 test -c /dev/hidraw0

# Calibration: the device's own file is to be found again from one that knows neither signs nor zeros.
device_file=/config/devices/knuckle1.toml
sed -e '/^counts_rise/s/=.*/= "clockwise"/' -e '/^zero_counts/s/=.*/= 0/' $device_file > unknown.toml
reports_come() { timeout 1 head -c 1 /dev/hidraw0 > /dev/null; }
# led_to END: the hand has led all joints to their lower (min_rad) or upper (max_rad) stops.
led_to() {
  pose=$(awk -v key="$1_rad" '$1 == key { printf "%s%.6f", comma, $3 * 180 / 3.14159265359 + (key == "min_rad" ? 1e-5 : -1e-5); comma = ", " }' $device_file)
  { sed -n '1,/^\[operator/p' /lab/sweep.toml | sed "s/^hand_deg.*/hand_deg = [$pose]/"; echo 'limb = "normal"
reaction_ms = 200
[[phase]]
name = "stay"
kind = "wait"
timeout_s = 3600
duration_s = 3600'; } > "/tmp/$1.toml"
  [ ! -e /run/hand.pid ] || stop hand
  start hand $on_operators_host knuckle device --gadget /dev/hidg0 --scenario "/tmp/$1.toml" --screen 127.0.0.1:5690
  within 10 holds "$result/hand.log" 'operator: stay'
  within 10 reports_come
}
led_to min
talk_to calibrate "$on_operators_host knuckle calibrate-device --device hid --device-file unknown.toml --out my_device.toml"
for request in 'Lower the forearm' 'Raise the forearm' 'Fold the wrist in' 'Stretch the wrist out' 'Curl the finger in' 'Stretch the finger out'; do
  asked "$request" || break
  case $request in Lower* | Fold* | Curl*) led_to min ;; *) led_to max ;; esac
  answer "$request" ''
done
check "calibrate-device: comes to its end" end_of_talk
check "... having asked for all six stops ($unanswered)" test -z "$unanswered"
cp my_device.toml "$result"
# Signs exactly, zeros to the last few counts.
same_as_file() {
  awk '{ sub(/ *#.*/, "") } $1 == "counts_rise" || $1 == "zero_counts" { of[FILENAME, $1, ++n[FILENAME, $1]] = $3 }
    END {
      for (i = 1; i <= 3; ++i) {
        off = of[ARGV[1], "zero_counts", i] - of[ARGV[2], "zero_counts", i]
        wrong += off > 20 || off < -20 || of[ARGV[1], "counts_rise", i] != of[ARGV[2], "counts_rise", i]
      }
      exit n[ARGV[1], "zero_counts"] != 3 || wrong
    }' my_device.toml $device_file
}
check "... with signs and zeros that are the device's" same_as_file
$on_operators_host knuckle doctor --device hid --device-file my_device.toml > "$result/doctor_calibrated.log" 2>&1
check "doctor takes the calibrated file, and shows the stop's angle at its stop" eval \
  'all_well $result/doctor_calibrated.log $? && holds $result/doctor_calibrated.log "forearm: .* = 62[.][56] deg"'
$on_operators_host knuckle master --machine solar015 --device hid --device-file my_device.toml --connect 10.0.0.1:5683 \
  --insecure --insecure --duration 2 --json "$result/calibrated.json" > "$result/calibrated.log" 2>&1
check "master takes the device by its calibrated file" of calibrated '.device_states | map(.ready) | any'
stop hand
plan
