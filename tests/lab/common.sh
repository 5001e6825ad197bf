# Sourced by the tests inside the virtual machine: TAP lines, waiting, CAN interfaces, the USB gadget.
# shellcheck shell=sh
KNUCKLE_CONFIG_DIR=/config
export KNUCKLE_CONFIG_DIR
count=0

# check WHAT COMMAND...: one TAP line, ok where the command succeeds.
check() {
  what=$1
  shift
  count=$((count + 1))
  if "$@"; then echo "ok $count - $what"; else echo "not ok $count - $what"; fi
}

# Last line of every test: how many there were, so that none can be missing.
plan() { echo "1..$count"; }

# within SECONDS COMMAND...: tries every 20 ms; fails where it never succeeded.
within() {
  tries=$(($1 * 50))
  shift
  until "$@"; do
    tries=$((tries - 1))
    [ "$tries" -gt 0 ] || return 1
    usleep 20000
  done
}

holds() { grep -q -e "$2" "$1"; }
holds_not() { ! grep -q -e "$2" "$1"; }

# start NAME COMMAND...: in the background, what it says in /out/NAME.log, its process in /run/NAME.pid.
start() {
  name=$1
  shift
  "$@" > "/out/$name.log" 2>&1 &
  echo $! > "/run/$name.pid"
}
signal() { kill "-$2" "$(cat "/run/$1.pid")"; }
runs() { kill -0 "$(cat "/run/$1.pid")" 2> /dev/null; }
# A program asked to end, and gone.
stop() {
  signal "$1" TERM 2> /dev/null
  within 5 not runs "$1" || signal "$1" KILL
}
not() { ! "$@"; }

vcan_up() {
  ip link add dev "$1" type vcan
  ip link set "$1" txqueuelen 1000 up
}
sja1000_up() { ip link set "$1" type can bitrate 500000 && ip link set "$1" txqueuelen 1000 up; }

# Records every frame of the interfaces; in memory first, a file of the host's is too slow for a full bus.
record() {
  candump -r 4000000 -L "$@" > /tmp/candump.log &
  echo $! > /run/candump.pid
  sleep 0.1
}
# record_end NAME: into /out/NAME.candump.log.
record_end() {
  stop candump
  mv /tmp/candump.log "/out/$1.candump.log"
}

gadget=/sys/kernel/config/usb_gadget/haptic
# The haptic device as USB sees it: vendor page 0xFF00, 64-byte numbered reports, 1 and 3 in, 2 and 4 out.
gadget_make() {
  mkdir "$gadget"
  echo 0x1209 > "$gadget/idVendor"
  echo 0x0001 > "$gadget/idProduct"
  echo 0x0200 > "$gadget/bcdUSB"
  mkdir "$gadget/strings/0x409" "$gadget/configs/c.1" "$gadget/functions/hid.usb0"
  echo 0001 > "$gadget/strings/0x409/serialnumber"
  echo Knuckle > "$gadget/strings/0x409/manufacturer"
  echo "Knuckle 1" > "$gadget/strings/0x409/product"
  echo 0 > "$gadget/functions/hid.usb0/protocol"
  echo 0 > "$gadget/functions/hid.usb0/subclass"
  echo 64 > "$gadget/functions/hid.usb0/report_length"
  printf '\006\000\377\011\001\241\001\025\000\046\377\000\165\010\225\077' > /tmp/descriptor
  for report in '\001\011\001\201\002' '\003\011\003\201\002' '\002\011\002\221\002' '\004\011\004\221\002'; do
    printf "\\205$report" >> /tmp/descriptor
  done
  printf '\300' >> /tmp/descriptor
  cat /tmp/descriptor > "$gadget/functions/hid.usb0/report_desc"
  ln -s "$gadget/functions/hid.usb0" "$gadget/configs/c.1"
}
gadget_plug() { echo dummy_udc.0 > "$gadget/UDC"; }
gadget_unplug() { echo > "$gadget/UDC"; }
