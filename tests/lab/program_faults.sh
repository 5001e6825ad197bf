# What fails at the ends of a session: devices and programs that are stopped or killed, bad reports, the cable between them.
# Each fault ends in neutral, is named, and nothing moves again by itself. In virtual time the same faults are in every run of
# the tests; here, of the deep ones.
# shellcheck shell=dash disable=SC2154,SC2016,SC2034
. /lab/lib/faults.sh
faults_set_up

fault device_stalled device_stale 'signal all.device STOP' 'signal all.device CONT'
fault reports_wrong_crc device_report 'bad_reports 64' 'signal all.device CONT'
fault reports_truncated device_stale 'bad_reports 20' 'signal all.device CONT'
COMMAND_MS=210 SPOOL_MS=330  # datagrams on the way arrive 10 ms after their sender was stopped, or the cable cut
fault link_cut link_lost link_cut link_mend
fault master_stopped link_lost 'signal all.master STOP' 'signal all.master CONT'
fault master_killed link_lost 'signal all.master KILL' 'start_master all hid'
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nobody sends SYNC
fault slave_stopped loop_overrun 'signal "$name.slave" STOP' 'signal "$name.slave" CONT'
fault slave_killed none 'signal "$name.slave" KILL' :
plan
