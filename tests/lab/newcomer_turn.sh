# A newcomer behind NAT: the section "Step by step" of docs/network.md, its commands word for word. Two computers are paired in
# one network, go behind symmetric NATs, and work through a TURN server.
#
#   host "machine" - "nat1" - this host: rendezvous and TURN server - "nat2" - host "operator"
# shellcheck shell=dash disable=SC2154
. /lab/lib/common.sh

awk '/^## / { here = $0 == "## Step by step" } /^ *```/ { code = !code; next } here && code' /lab/network.md |
  sed 's/^ *//' > /tmp/section
grep -e ' ' /tmp/section > /tmp/commands
# The section's one command of this kind.
command_like() { grep -e "$1" /tmp/commands; }
check "the section has the six commands that are tried here" test "$(wc -l < /tmp/commands)" -eq 6

# What a reader has: the machine's CAN bus, a device on USB, the machine file, names of servers, and coturn on one of them
# (the host's programs, read only).
mkdir -p /usr /etc
mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288,cache=loose,ro usr /usr || echo "Bail out! no /usr"
PATH=$PATH:/usr/bin:/usr/sbin
export PATH
echo '198.51.100.10 rendezvous.example.org relay.example.org' > /etc/hosts
echo 'hosts: files' > /etc/nsswitch.conf
cp /config/machines/solar015.toml found.toml
for host in machine operator nat1 nat2; do
  ip netns add $host
  ip -n $host link set lo up
  mkdir "/home_of_$host"
done
at() {
  local host=$1
  shift
  ip netns exec "$host" env HOME="/home_of_$host" "$@"
}
on_machine="ip netns exec machine env HOME=/home_of_machine"
on_operator="ip netns exec operator env HOME=/home_of_operator"
ip -n machine link add dev can0 type vcan
ip -n machine link set can0 txqueuelen 1000 up
gadget_make
gadget_plug
within 5 test -c /dev/hidraw0

# In one network.
ip -n machine link add lan type veth peer name lan netns operator
ip -n machine addr add 192.0.2.7/24 dev lan
ip -n operator addr add 192.0.2.8/24 dev lan
ip -n machine link set lan up
ip -n operator link set lan up
start pair_machine $on_machine sh -c "echo yes | $(command_like 'pair --listen')"
start pair_operator $on_operator sh -c "echo yes | $(command_like 'pair --connect')"
check "pair: the machine's computer" exit_code_of pair_machine
check "pair: the operator's computer" exit_code_of pair_operator
code_of() { grep -e '^code: ' "$result/$1.log"; }
check "... both show the same code" test -n "$(code_of pair_machine)" -a "$(code_of pair_machine)" = "$(code_of pair_operator)"
ip -n machine link del lan

# nat NAME OUTSIDE HOST NETWORK: the host is NETWORK.2 behind a router that gives each flow a random port and lets nobody in.
nat() {
  ip link add "to_$1" type veth peer name outside netns "$1"
  ip addr add 198.51.100.10/32 dev "to_$1"
  ip link set "to_$1" up
  ip route add "$2/32" dev "to_$1" src 198.51.100.10
  ip -n "$1" addr add "$2/32" dev outside
  ip -n "$1" link set outside up
  ip -n "$1" route add 198.51.100.10/32 dev outside
  ip -n "$1" route add default via 198.51.100.10
  ip -n "$1" link add inside type veth peer name eth netns "$3"
  ip -n "$1" addr add "$4.1/24" dev inside
  ip -n "$1" link set inside up
  ip -n "$3" addr add "$4.2/24" dev eth
  ip -n "$3" link set eth up
  ip -n "$3" route add default via "$4.1"
  tc qdisc add dev "to_$1" root netem delay 5ms
  tc -n "$1" qdisc add dev outside root netem delay 5ms
  at "$1" sh -c 'echo 1 > /proc/sys/net/ipv4/ip_forward'
  at "$1" nft 'table ip nat { chain out { type nat hook postrouting priority 100; oifname "outside" masquerade random,fully-random; }; }
    table ip filter {
      chain forward { type filter hook forward priority 0; policy drop; ct state established,related accept; iifname "inside" accept; }
      chain input { type filter hook input priority 0; policy drop; ct state established,related accept; }
    }'
}
check "the machine goes behind a symmetric NAT" nat nat1 198.51.100.1 machine 10.1.0
check "the operator behind another" nat nat2 198.51.100.2 operator 10.2.0
echo 1 > /proc/sys/net/ipv4/ip_forward
ip route add default via 198.51.100.254 dev to_nat1 onlink  # of the server: nobody is there
check "the server is reached from behind" at machine ping -c 1 -W 2 rendezvous.example.org
check "... and nobody behind a NAT from elsewhere" not at operator ping -c 1 -W 1 198.51.100.1

grep -v -e ' ' /tmp/section > /etc/turnserver.conf
mkdir -p /var/lib/turn /var/log
start turn turnserver -c /etc/turnserver.conf --log-file stdout --pidfile /run/turn.pid
start rendezvous sh -c "exec $(command_like 'knuckle rendezvous')"
check "the rendezvous is there" within 10 holds "$result/rendezvous.log" 'listening on 0.0.0.0:5684'
check "the relay as well" within 60 sh -c 'netstat -lnu | grep -q 198.51.100.10:3478'
at machine sh -c "$(command_like turn.toml)"
at operator sh -c "$(command_like turn.toml)"

# Work. The one thing added: a picture for the simulated operator, who sees what --mirror shows.
start recorder ip netns exec machine candump -r 4000000 -L can0,210:7FC
start node ip netns exec machine knuckle node --can can0 --scenario /lab/sweep.toml --json "$result/node.json"
start slave $on_machine sh -c "exec $(command_like 'knuckle slave')"
start device $on_operator knuckle device --gadget /dev/hidg0 --scenario /lab/sweep.toml --screen 127.0.0.1:5690 --json "$result/device.json"
start master $on_operator sh -c "exec $(command_like 'knuckle master') --mirror 127.0.0.1:5690"
check "slave and master: a path through the relay" within 60 holds "$result/slave.log" 'path to desk: in use: relay, '
check "... said on both sides" within 10 holds "$result/master.log" 'path to machine: in use: relay, '
check "... and no other" not holds "$result/slave.log" 'in use: \(host\|srflx\)'
check "the operator engages the machine" within 60 holds "$result/slave.log" ' engaged'
check "... leads it, and lets go" exit_code_of device
check "... having moved its valves over CAN" holds "$result/recorder.log" ' 21[012]#.[7F]00.*[1-9A-F]'
signal master TERM
check "SIGTERM ends the master in order" exit_code_of master
signal slave TERM
check "... and the slave" exit_code_of slave
check "... and no fault before the device had gone" not holds "$result/slave.log" 'fault \(node\|sensor\|bus\|safety\)'
check "the audit trail says who had control" at machine sh -c "knuckle audit ~/.config/knuckle/audit | grep -q 'control_taken.*desk'"
for name in recorder node turn rendezvous; do stop $name; done
plan
