#!/usr/bin/env bash
# Runs each command line as on a machine of its own: a network namespace with the address 10.78.0.N (N = 1, 2, … in the order
# of the commands), all on one switch. Needs ip (iproute2) and unshare; no root where user namespaces are allowed.
#
#   machines.sh 'v2x hub --listen tcp/0.0.0.0:7447' \
#               'v2x agent --scenario crossing.toml --id ego --connect tcp/10.78.0.1:7447' \
#               'v2x watch --connect tcp/10.78.0.1:7447 --count 20'
#
# It ends with the last command, with its exit code; the others are interrupted then, and so they are by Ctrl-C.
# MACHINES_START=2 starts each command two seconds after the one before [default: 1].
set -euo pipefail

die() { printf 'machines.sh: %s\n' "$*" >&2; exit 1; }

[ $# -gt 0 ] || { sed -n '2,12s/^# \{0,1\}//p' "$0" >&2; exit 2; }
command -v ip >/dev/null || die "needs ip: install iproute2"
command -v unshare >/dev/null || die "needs unshare: install util-linux"

if [ -z "${MACHINES_INSIDE:-}" ]; then
  unshare --user --map-root-user --net true 2>/dev/null || die "user namespaces are not allowed here"
  # Processes have a namespace, too: none outlives this script.
  exec env MACHINES_INSIDE=1 unshare --user --map-root-user --net --mount --pid --fork --kill-child "$0" "$@"
fi

mount -t tmpfs tmpfs /run
mkdir /run/netns
ip link add switch type bridge
ip link set switch up
n=0
for _ in "$@"; do
  n=$((n + 1))
  ip netns add "m$n"
  ip link add "port$n" type veth peer name eth0 netns "m$n"
  ip link set "port$n" master switch up
  ip -n "m$n" addr add "10.78.0.$n/24" dev eth0
  ip -n "m$n" link set eth0 up
  ip -n "m$n" link set lo up
done

others=()
end() {
  [ ${#others[@]} -eq 0 ] || kill -INT "${others[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
}
trap end EXIT
trap 'exit 130' INT TERM

n=0
for command in "$@"; do
  n=$((n + 1))
  if [ "$n" -eq $# ]; then
    # Not exec: the others are to be ended after it.
    code=0
    ip netns exec "m$n" bash -c "$command" || code=$?
    exit "$code"
  fi
  # A background job of a script would ignore SIGINT.
  ip netns exec "m$n" bash -c "trap - INT; exec $command" </dev/null &
  others+=($!)
  sleep "${MACHINES_START:-1}"
done
