# Sourced by the tests inside the virtual machine: TAP lines, waiting, CAN interfaces, the USB gadget.
# shellcheck shell=dash
KNUCKLE_CONFIG_DIR=/config
export KNUCKLE_CONFIG_DIR
count=0  # of TAP lines

# check WHAT COMMAND...: one TAP line, ok where the command succeeds; that is what it returns, too.
check() {
  local what=$1
  shift
  count=$((count + 1))
  if "$@"; then
    echo "ok $count - $what"
  else
    echo "not ok $count - $what"
    return 1
  fi
}

# Last line of every test: how many there were, so that none can be missing.
plan() { echo "1..$count"; }

# What the test does now: one line for who looks at a test that came to no end.
begin() { echo ": $*"; }

# within SECONDS COMMAND...: tries every 50 ms; fails where it never succeeded.
within() {
  local tries=$(($1 * 20))
  shift
  until "$@"; do
    tries=$((tries - 1))
    [ "$tries" -gt 0 ] || return 1
    usleep 50000
  done
}

# holds FILE EXPRESSION: a line of it fits; a file that is not there yet has none.
holds() { grep -qs -e "$2" "$1"; }
# says FILE EXPRESSION: jq's answer of the JSON file is true.
says() { jq -e "$2" "$1" > /dev/null; }

# Results go into memory and to the host at the end: /out is a folder of the host's, and while it lets a program wait, the
# virtual machine's time runs on as fast as it can.
result=/result

# start NAME COMMAND...: in the background, what it says in $result/NAME.log, its process in /run/NAME.pid.
start() {
  local name=$1
  shift
  begin "program $name"
  "$@" > "$result/$name.log" 2>&1 &
  echo $! > "/run/$name.pid"
}
signal() { kill "-$2" "$(cat "/run/$1.pid")"; }
runs() { kill -0 "$(cat "/run/$1.pid")" 2> /dev/null; }
# A program asked to end, and gone.
stop() {
  signal "$1" TERM 2> /dev/null
  within 5 not runs "$1" || signal "$1" KILL
}
# Exit code of a program that was started, once it has ended by itself.
exit_code_of() {
  within 60 not runs "$1" || signal "$1" KILL
  wait "$(cat "/run/$1.pid")"
}
not() { ! "$@"; }

vcan_up() {
  ip link add dev "$1" type vcan
  ip link set "$1" txqueuelen 1000 up
}
sja1000_up() { ip link set "$1" type can bitrate 500000 && ip link set "$1" txqueuelen 1000 up; }

# record NAME INTERFACE...: every frame of the interfaces into $result/NAME.candump.log, until `stop recorder`.
record() {
  local log=$result/$1.candump.log
  shift
  candump -r 4000000 -L "$@" > "$log" &
  echo $! > /run/recorder.pid
  sleep 0.1
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
  knuckle device --descriptor - > "$gadget/functions/hid.usb0/report_desc"
  ln -s "$gadget/functions/hid.usb0" "$gadget/configs/c.1"
}
gadget_plug() { echo dummy_udc.0 > "$gadget/UDC"; }
gadget_unplug() { echo > "$gadget/UDC"; }
