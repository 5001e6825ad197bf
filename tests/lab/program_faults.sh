# More that fails at the ends of a session: programs that are stopped or killed, and short reports. To the other side they
# look like what faults.sh tries; each fault ends in neutral, is named, and nothing moves again by itself.
# shellcheck shell=dash disable=SC2154,SC2016,SC2034
. /lab/lib/faults.sh
faults_set_up

fault reports_truncated device_stale 'bad_reports 20' 'signal all.device CONT'
COMMAND_MS=210 SPOOL_MS=330  # datagrams on the way arrive 10 ms after their sender was stopped
fault master_stopped link_lost 'signal all.master STOP' 'signal all.master CONT'
fault master_killed link_lost 'signal all.master KILL' 'start_master all hid'
COMMAND_MS=null SPOOL_MS=320 WITNESS=pilot  # nobody sends SYNC
fault slave_stopped loop_overrun 'signal "$name.slave" STOP' 'signal "$name.slave" CONT'
plan
