# What the other tests stand on: CAN, USB HID and the network of a stock kernel do here what they do on a machine.
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
plan
