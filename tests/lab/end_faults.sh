# What fails at the ends of a session: device, cable, programs, network. Each fault ends in neutral, is named, and
# nothing moves again by itself.
# shellcheck shell=dash disable=SC2154,SC2016,SC2034
. /lab/lib/faults.sh
faults_set_up

fault usb_unplugged device_lost gadget_unplug gadget_plug
fault device_stalled device_stale 'signal all.device STOP' 'signal all.device CONT'
fault reports_wrong_crc device_report 'bad_reports 64' 'signal all.device CONT'
COMMAND_MS=210 SPOOL_MS=330  # datagrams on the way arrive 10 ms after the cut
fault link_cut link_lost link_cut link_mend
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nobody sends SYNC
fault slave_killed none 'signal "$name.slave" KILL' :
plan
