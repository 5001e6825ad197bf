# What fails in the machine's nodes: each fault ends in neutral, is named, and nothing moves again by itself. In virtual time
# the same faults are in every run of the tests; here, of the deep ones.
# shellcheck shell=dash disable=SC2034,SC2016
. /lab/lib/faults.sh
faults_set_up

usr1='signal "$name.node" USR1'
fault node_silent_pressure sensor_stale "$usr1" : node_silent:arm_head_pressure@usr1+1
fault node_silent_encoder sensor_stale "$usr1" : node_silent:boom_encoder@usr1+1
fault sensor_invalid sensor_invalid "$usr1" : sensor_invalid:boom_head_pressure@usr1+1
fault encoder_broken sensor_invalid "$usr1" : encoder_broken:arm_encoder@usr1+1
fault node_emergency node_emergency "$usr1" : node_emergency:boom_valve@usr1+1
fault emcy_storm node_emergency "$usr1" : emcy_storm:arm_encoder@usr1+1
fault e_stop emergency_stop "$usr1" : e_stop@usr1+1
WITNESS=pilot  # a valve tells nothing: its node is silent, waits for its configuration, or hears no SYNC
fault node_silent_valve sensor_stale "$usr1" : node_silent:arm_valve@usr1+1
fault node_reset node_fault "$usr1" : node_reset:boom_valve@usr1+1
fault sync_dropped sensor_stale "$usr1" : sync_dropped@usr1+1
unset WITNESS
# Found once the valve is asked to be elsewhere, or by what the other sensors say: within the swing of the sweep.
BROKEN_S=2 COMMAND_MS=2000 SPOOL_MS=2100
fault valve_stuck node_emergency "$usr1" : valve_stuck:arm_valve@usr1+2
fault sensor_frozen sensor_implausible "$usr1" : sensor_frozen:boom_encoder@usr1+2
unset BROKEN_S
plan
