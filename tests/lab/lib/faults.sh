# Sourced by the fault tests: a session is led into motion, something is broken, and what the wire then shows is judged.
#
#   vcan0, the slave's interface == gateway == vcan1, the machine's bus with its nodes, where the frames are recorded
# shellcheck shell=dash disable=SC2154
. /lab/lib/common.sh
. /lab/lib/session.sh

# Marks in the frame log, on an interface of their own: before something is broken, when it is, when it is mended, when
# judging ends.
mark() { cansend marks "7F0#$1"; }
breaking=01 broken=02 mended=03 over=04

gateway_up() { cangw -A -s vcan0 -d vcan1 -e && cangw -A -s vcan1 -d vcan0 -e; }

faults_set_up() {
  hosts_up 10
  vcan_up vcan0
  vcan_up vcan1
  vcan_up marks
  gateway_up
  gadget_make
  gadget_plug
  within 5 test -c /dev/hidraw0
  # The operator leads the machine again and again.
  sed '/^\[\[phase/,$d' /lab/sweep.toml > /tmp/faults.toml
  sed -i 's/^duration_s.*/duration_s = 3000/' /tmp/faults.toml
  for _ in $(seq 40); do sed -n '/^\[\[phase/,$p' /lab/sweep.toml >> /tmp/faults.toml; done
  start_operator all hid /tmp/faults.toml
}

# bad_reports BYTES_EACH: for a second, reports by somebody else, of ones, which is no CRC of that; meanwhile the device's own
# program is stopped.
bad_reports() {
  head -c 128000 /dev/zero | tr '\000' '\001' > /tmp/ones
  signal all.device STOP
  timeout 0.9 dd if=/tmp/ones of=/dev/hidg0 bs="$1" 2> /dev/null &
}

# Reads a candump log; prints JSON: moving before; ms that the breaking took; ms from its begin until all valves that were
# not neutral had been seen to be told to stand still, their spools to be in the dead band, and pilot pressure to be off,
# null where that was not seen; frames that ask for motion after the mending.
judge_frames() {
  grep -E ' marks | (21[012]|19[012]|1C0)#' "$1" | awk '
    function hex(text, at, n,  i, value) {
      for (i = 0; i < n; ++i) value = 16 * value + index("0123456789ABCDEF", substr(text, at + i, 1)) - 1
      return value
    }
    function i16(text, at,  value) {
      value = hex(text, at, 2) + 256 * hex(text, at + 2, 2)
      return value > 32767 ? value - 65536 : value
    }
    # Since when a frame identifier keeps to the rule it broke; -1 while it does not.
    function watch(kind, id, breaks) {
      if (breaks) since[kind, id] = -1
      else if (since[kind, id] == -1) since[kind, id] = t
    }
    function worst(kind,  key, parts, all) {
      all = t0
      for (key in since) {
        split(key, parts, SUBSEP)
        if (parts[1] != kind) continue
        if (since[key] == -1) return "null"
        if (since[key] > all) all = since[key]
      }
      return sprintf("%.1f", 1000 * (all - t0))
    }
    { t = substr($1, 2) + 0; split($3, frame, "#"); id = frame[1]; data = frame[2] }
    $2 == "marks" { phase = hex(data, 1, 2); if (phase == 1) t0 = t; if (phase == 2) broken = t; next }
    phase == 4 { next }
    id ~ /^21[012]$/ { moves = hex(data, 2, 1) % 8 == 7 && i16(data, 5) != 0 }
    id ~ /^21[012]$/ && !phase && moves { moved_at = t }
    id ~ /^21[012]$/ { watch("command", id, moves); resumed += phase == 3 && moves }
    id ~ /^19[012]$/ { spool = i16(data, 5); watch("spool", id, spool > 1802 || spool < -1802) }
    id == "1C0" { watch("pilot", id, int(hex(data, 2, 1) / 2) % 2) }
    END {
      printf "{\"moved\":%s,\"breaking_ms\":%.1f,\"command_neutral_ms\":%s,\"spool_neutral_ms\":%s,\"pilot_off_ms\":%s,\"resumed\":%d}\n",
        (moved_at > t0 - 0.1 ? "true" : "false"), 1000 * (broken - t0), worst("command"), worst("spool"), worst("pilot"), resumed
    }'
}

# keep_result NAME EXPECTED_CODE [NOTE]: what frames and slave say, as one line of JSON in /tmp/fault.json, and in words in
# /tmp/fault.words. By one run of jq, which takes longer to start here than a fault takes to be judged.
keep_result() {
  judge_frames "$result/$1.candump.log" > /tmp/judged.json
  local told=$result/$1.slave.json
  [ -s "$told" ] || echo null > "$told"
  jq -r --arg name "$1" --arg code "$2" --arg note "$3" --slurpfile slave "$told" \
    --argjson command "${COMMAND_MS:-200}" --argjson spool "${SPOOL_MS:-320}" --arg witness "${WITNESS:-spool}" '
    ($slave[0].faults // [] | .[0]) as $fault
    | {name: $name, expected: $code, code: ($fault.code // "none"), reason: $fault.reason,
       note: (if $note == "" then null else $note end),
       mode: (($slave[0].modes // []) | map(.mode | select(. == "fault" or . == "e_stop")) | .[0]),
       command_bound_ms: $command, spool_bound_ms: $spool, witness: $witness} + .
    | .passed = (.code == .expected and .resumed == 0
        and (.command_bound_ms == null or (.command_neutral_ms // 1e9) - .breaking_ms <= .command_bound_ms)
        and ((if .witness == "pilot" then .pilot_off_ms else .spool_neutral_ms end) // 1e9) - .breaking_ms <= .spool_bound_ms)
    | "\(.code), ms until neutral: command \(.command_neutral_ms), spools \(.spool_neutral_ms), pilot pressure \(.pilot_off_ms)",
      tojson' /tmp/judged.json > /tmp/fault.result
  sed -n 1p /tmp/fault.result > /tmp/fault.words
  sed -n 2p /tmp/fault.result > /tmp/fault.json
}
# fault_is KEY VALUE: what the last result says.
fault_is() { holds /tmp/fault.json "\"$1\":$2[,}]"; }

# fault NAME EXPECTED_CODE BREAK MEND [NODE_FAULT]: BREAK and MEND are shell commands; NODE_FAULT is what the nodes break
# at SIGUSR1. A code of "none": the slave cannot say anything. COMMAND_MS, SPOOL_MS: other bounds than the usual ones,
# from when BREAK has returned (the last good input came in before that); a COMMAND_MS of "null": nobody is there to send
# a neutral command, the nodes stop by themselves. WITNESS=pilot: valves do not tell their positions, so pilot pressure must
# be off; else every spool must be told to be in its dead band. BROKEN_S: for longer than a second.
fault() {
  local name=$1 tries=3
  until try_fault "$@"; do
    tries=$((tries - 1))
    if [ $tries = 0 ]; then
      check "$name: could be tried on a machine in motion" false
      return
    fi
    echo "# $name: the machine was not in motion, so nothing was learned: once more"
  done
  check "$name: $(cat /tmp/fault.words)" fault_is passed true || sed 's/^/# /' /tmp/fault.json
  cat /tmp/fault.json >> "$result/faults.jsonl"
}

# Result in /tmp/fault.json. @return false where the machine was not engaged and in motion just before.
try_fault() {
  local name=$1 code=$2 break=$3 mend=$4
  start_machine "$name" vcan0 vcan1 /lab/sweep.toml ${5:+--fault "$5"}
  if ! within 20 holds "$result/$name.slave.log" ' engaged'; then
    stop_machine "$name"
    return 1
  fi
  record "$name" vcan1 marks
  sleep 1.3
  begin "breaking: $name"
  mark $breaking
  eval "$break"
  mark $broken
  sleep "${BROKEN_S:-1}"
  eval "$mend"
  mark $mended
  sleep 0.7
  mark $over
  stop "$name.slave"
  stop recorder
  stop "$name.node"
  keep_result "$name" "$code"
  fault_is moved true
}
