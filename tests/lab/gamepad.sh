# A gamepad as the kernel shows one, made through uinput, and the console in a window: the pad leads the simulated machine,
# its B stops it, and pulled out and plugged in again with the bumper held it does not lead on.
# shellcheck shell=dash disable=SC2154
. /lab/lib/common.sh

# The host's programs and libraries for windows, read only. Nothing is drawn: Mesa throws away what the window asks for (in
# one thread, else it crashes at that), where an emulated processor would take a second for each picture.
mkdir -p /usr
mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288,cache=loose,ro usr /usr || echo "Bail out! no /usr"
PATH=$PATH:/usr/bin DISPLAY=:0 LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_NOOP=1 GALLIUM_THREAD=0
export PATH DISPLAY LIBGL_ALWAYS_SOFTWARE GALLIUM_NOOP GALLIUM_THREAD

plug() {
  start pad evemu-device /lab/lib/xbox360.pad
  within 600 holds "$result/pad.log" /dev/input/event
}
unplug() { stop pad; }
reports() { evemu-event "$(sed 's/.*: //' "$result/pad.log")" --sync --type "$1" --code "$2" --value "$3"; }
bumper() { reports EV_KEY BTN_TR "$1"; }
button_b() { reports EV_KEY BTN_EAST "$1"; }
left_stick() { reports EV_ABS ABS_Y "$1"; }
forward=-32768 back=32767 middle=0

wire=$result/candump.log
judged=/tmp/judged.log  # the frames of it that count here
now() { tail -n 2 "$wire" | sed -n '1s/^(\(.*\)).*/\1/p'; }
# Time of the first event that says so.
told_at() { grep -m 1 -e "$1" "$result/events.csv" | cut -d, -f3; }
# Where the arm's cylinder was: steps of its encoder.
arm_at() {
  printf '%d\n' "$(awk -v t="$1" 'substr($1, 2) + 0 >= t && $3 ~ /^1B1#/ { print substr($3, 5, 8); exit }' "$judged" |
    sed 's/\(..\)\(..\)\(..\)\(..\)/0x\4\3\2\1/')"
}
moved() { echo $(($(arm_at "$2") - $(arm_at "$1"))); }
# Valve commands other than neutral in this time, beginning so many seconds later: commands FROM UNTIL [LATER_S]
commands() {
  awk -v from="$1" -v until="$2" -v later="${3:-0}" '
    { t = substr($1, 2) + 0 }
    t >= from + later && t < until && $3 ~ /^21[012]#.[7F]/ && $3 !~ /^21[012]#....0000/ { ++n }
    END { print n + 0 }' "$judged"
}

# Until all is read from the host, the virtual machine's time runs on as fast as it can: long limits cost nothing.
start x Xvfb :0 -screen 0 1280x720x24 -nolisten tcp
plug
within 600 test -S /tmp/.X11-unix/X0
start candump knuckle console --simulate --device gamepad --scenario free_motion --size 1280x720 --screen events \
  --candump - --json "$result/window.json"
sleep 3  # every look takes the console's time
check "the console takes the gamepad, and its machine is alive" within 100 holds "$wire" ' 1B1#' || exit
sleep 0.5
bumper 1
sleep 0.3
left_stick $forward
sleep 1
unplug
sleep 0.6
plug
bumper 1
left_stick $back
sleep 1
held_until=$(now)
left_stick $middle
bumper 0
sleep 0.3
pressed=$(now)
bumper 1
sleep 0.5
left_stick $back
sleep 1
button_b 1
button_b 0
sleep 0.6
over=$(now)
xdotool mousemove 947 140 click 1  # "Export CSV"
within 60 test -s knuckle-events.csv
stop candump
cp knuckle-events.csv "$result/events.csv"
grep -e ' 21[012]#' -e ' 1B1#' "$wire" > "$judged"

engaged=$(told_at 'machine: engaged') gone=$(told_at 'gamepad disconnected') again=$(told_at 'gamepad connected again')
stopped=$(told_at 'Stop pressed')
out=$(moved "$engaged" "$gone") in=$(moved "$pressed" "$stopped")
check "bumper held, left stick forward: the arm goes out, $out steps" test "$out" -lt -200
check "pulled out: told" test "$gone"
check "... and neutral within 0.2 s, to stay so" test "$(commands "$gone" "$again" 0.2)" -eq 0
check "... after it had led the valves" test "$(commands "$engaged" "$gone")" -gt 100
check "plugged in again: told" test "$again"
check "... with the bumper held: nothing leads" test "$(commands "$again" "$held_until")" -eq 0
check "let go of and pressed, stick back: the arm comes in, $in steps" test "$in" -gt 200
check "a tap of B: told" test "$stopped"
check "... and neutral within 0.2 s, whatever is held" test "$(commands "$stopped" "$over" 0.2)" -eq 0
check "... by the machine's side" holds "$result/events.csv" 'alarm,operator_stop,"machine: fault'
check "the console ends in order" says "$result/window.json" '.mode == "fault"'
plan
