# The operator approaches a wall, presses, holds, lets go, on the kernel's interfaces through hidraw. In virtual time contacts
# are in every run of the tests; here, of the deep ones.
# shellcheck shell=dash disable=SC2154
. /lab/lib/common.sh
. /lab/lib/session.sh

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
plan
