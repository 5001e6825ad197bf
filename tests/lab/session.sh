# A whole session on the kernel's interfaces: an operator at a USB haptic device leads a machine on a CAN bus over UDP. Through
# libusb; newcomer.sh has one through hidraw, contact.sh one with a wall.
# shellcheck shell=dash disable=SC2154
. /lab/lib/common.sh
. /lab/lib/session.sh

hosts_up 10
vcan_up vcan0
gadget_make
gadget_plug
within 5 test -c /dev/hidraw0
session usb usb /lab/sweep.toml 40
plan
