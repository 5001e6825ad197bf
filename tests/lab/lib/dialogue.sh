# Sourced by tests that answer a program's questions as a person at a terminal does: each one once it is asked.
# shellcheck shell=dash disable=SC2154
trap '' PIPE  # an answer that nobody reads any more is no reason to die

# talk_to NAME COMMAND: starts it; what it says in $result/NAME.log. One at a time.
talk_to() {
  talking=$1
  unanswered=
  mkfifo "/tmp/$1.answers"
  start "$1" sh -c "exec $2 < /tmp/$1.answers"
  exec 3> "/tmp/$1.answers"
}
# Whether the last thing said, but for the prompt, is this question.
asks() { tail -n 2 "$result/$talking.log" | awk -v asked="$1" '$0 != "> " { last = $0 } END { exit !(last ~ asked) }'; }
# asked QUESTION: waits for it; false where the program ended instead, at once from then on. Looks four times a second:
# every look costs more than the machine's motion.
asked() {
  local tries=400
  begin "waiting for the question '$1'"
  until [ -n "$unanswered" ] || asks "$1"; do
    tries=$((tries - 1))
    [ "$tries" -gt 0 ] && runs "$talking" || unanswered=$1
    sleep 0.25
  done
  [ -z "$unanswered" ]
}
# answer QUESTION WORD: false where it was not asked.
answer() { asked "$1" && echo "$2" >&3; }
# Once the program has ended: its exit code.
end_of_talk() {
  exec 3>&-
  exit_code_of "$talking"
}
