# Parts that are sold: how they get their node ids; valves with control words of their own, without a heartbeat consumer and with defaults that map
# something else; an inclinometer whose COB-ID nobody may write. From their vendors' files into the machine file, and
# from nodes that boot for 3 s to valves that are active, without a word about how.
# shellcheck shell=dash disable=SC2154,SC2016
. /lab/lib/common.sh

# object INDEX[subN] TYPE ACCESS VALUE
object() { printf '[%s]\nParameterName=%s\nObjectType=7\nDataType=%s\nAccessType=%s\nDefaultValue=%s\n' "$1" "$1" "$2" "$3" "$4"; }
device() {  # TYPE VENDOR PRODUCT
  printf '[DeviceInfo]\nVendorName=Lab\nProductName=Part\nBaudRate_500=1\n'
  object 1000 7 ro "$1"
  object 1001 5 ro 0
  object 1017 6 rw 0
  object 1018sub1 7 ro "$2"
  object 1018sub2 7 ro "$3"
}
{
  device 0x198 0x01000019 0x53373235
  object 1400sub1 7 rw '$NODEID+0x200'
  object 1400sub2 5 rw 255
  object 1400sub5 6 rw 0
  object 1600sub0 5 rw 2
  object 1600sub1 7 rw 0x00030010
  object 1600sub2 7 rw 0x63000110
  object 1800sub1 7 rw '$NODEID+0x180'
  object 1800sub2 5 rw 255
  object 1A00sub0 5 rw 2
  object 1A00sub1 7 rw 0x60410010
  object 1A00sub2 7 rw 0x63010110
  object 6040 6 rw 0
  object 6041 6 ro 0
  object 6042 2 rw 1
  object 6300sub1 3 rw 0
  object 6301sub1 3 ro 0
} > /tmp/valve.eds
{
  device 0x0008019A 0x93 0x64
  object 1800sub1 7 ro '$NODEID+0x180'
  object 1800sub2 5 rw 0xFE
  object 1800sub5 6 rw 100
  object 1A00sub0 5 rw 2
  object 1A00sub1 7 rw 0x60100010
  object 1A00sub2 7 rw 0x60200010
  object 6000 6 rw 50
  object 6010 3 ro 0
  object 6020 3 ro 0
} > /tmp/tilt.eds

machine=/tmp/sold.toml
sed -e 's/^controller_id = 1$/controller_id = 1\nboot_timeout_ms = 4000/' -e 's/^tilt_step_deg = 0.1/tilt_step_deg = 0.05/' \
  /config/machines/solar015.toml > $machine
add() { knuckle bus add "$1" --id "$2" --as "$3" --machine $machine; }
check "a valve's file is put into the machine file" add /tmp/valve.eds 0x10 boom_valve
check "... twice more, for the others" add /tmp/valve.eds 0x11 arm_valve
add /tmp/valve.eds 0x12 bucket_valve
check "an inclinometer's as well" add /tmp/tilt.eds 0x38 tilt
check "... with the words that the valves want" holds $machine 'profile = "cia408/pved"'

vcan_up vcan0
record ids vcan0
start ids.node knuckle node --machine $machine --can vcan0 --nodes boom_valve,arm_valve --boot-time 1 \
  --node-id boom_valve=none --serial boom_valve=4711 --node-id arm_valve=0x7F --serial arm_valve=4712
within 5 sh -c "grep -q ' 77F#00' $result/ids.candump.log"
assign() { knuckle bus assign-id --can vcan0 --machine $machine "$@" > /tmp/assigned 2>&1; }
check "of two valves that answer LSS none gets an id" not assign --id 0x10
check "... both are named" holds /tmp/assigned '2 devices answer LSS, with the serials 4711, 4712'
check "... one of them by its serial gets its id" assign --id 0x10 --serial 4711
check "... and says so under it" holds /tmp/assigned 'serial 4711: had no node id, is node 0x10, boom_valve in'
check "the other by the id that it has" assign --id 0x11 --from 0x7F
check "... no id a second time" not assign --id 0x11 --serial 4711
check "... which is in use" holds /tmp/assigned 'node id 0x11 is in use: .*serial 4712'
stop ids.node
stop recorder
record sold vcan0
start sold.node knuckle node --machine $machine --can vcan0 --boot-time 3 --eds boom_valve=/tmp/valve.eds \
  --eds arm_valve=/tmp/valve.eds --eds bucket_valve=/tmp/valve.eds --eds tilt=/tmp/tilt.eds
start sold.slave knuckle slave --machine $machine --can vcan0 --listen 127.0.0.1:5683 --insecure --json "$result/sold.json"
for node in 190 191 192; do
  check "valve 0x$node is active, in neutral" within 20 sh -c "grep -q ' $node#0F00' $result/sold.candump.log"
done
check "the inclinometer sends four bytes, as it can" within 5 sh -c "grep -q ' 1B8#........\$' $result/sold.candump.log"
check "nobody was reset" not grep -q -e ' 000#81' "$result/sold.candump.log"
stop sold.slave
check "all ends in order" says "$result/sold.json" '.stop.confirmed'
stop sold.node
stop recorder
plan
