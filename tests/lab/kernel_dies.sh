# The lab itself: a machine whose kernel dies must fail its test at once, with the kernel's words (tests/CMakeLists.txt
# expects just that).
# shellcheck shell=dash
. /lab/lib/common.sh

check "the machine is there" test -e /proc/sysrq-trigger
begin "the end of this kernel"
echo c > /proc/sysrq-trigger
plan
