# What fails at the ends of a session: device, cable, programs, network. Each fault ends in neutral, is named, and
# nothing moves again by itself.
# shellcheck shell=dash disable=SC2154,SC2016,SC2034
. /lab/lib/faults.sh
faults_set_up

# For a second, reports by somebody else while the device's own program is stopped: bad_reports FILE BYTES_EACH
bad_reports() {
  signal all.device STOP
  timeout 0.9 dd if="$1" of=/dev/hidg0 bs="$2" 2> /dev/null &
}
head -c 128000 /dev/zero | tr '\000' '\001' > /tmp/wrong_crc  # report 1 of ones: no CRC of that

fault usb_unplugged device_lost gadget_unplug gadget_plug
fault device_stalled device_stale 'signal all.device STOP' 'signal all.device CONT'
fault reports_wrong_crc device_report 'bad_reports /tmp/wrong_crc 64' 'signal all.device CONT'
fault reports_truncated device_stale 'bad_reports /tmp/wrong_crc 20' 'signal all.device CONT'
COMMAND_MS=210 SPOOL_MS=330  # datagrams on the way arrive 10 ms after the cut, or after their sender was stopped
fault link_cut link_lost link_cut link_mend
fault master_stopped link_lost 'signal all.master STOP' 'signal all.master CONT'
fault master_killed link_lost 'signal all.master KILL' 'start_master all hid'
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nobody sends SYNC
fault slave_stopped loop_overrun 'signal "$name.slave" STOP' 'signal "$name.slave" CONT'
fault slave_killed none 'signal "$name.slave" KILL' :
plan
