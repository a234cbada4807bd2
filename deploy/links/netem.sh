#!/usr/bin/env bash
# Two network namespaces with a link between them that the kernel makes slow and lossy (tc netem).
# The hub runs in one, agents in the other. Needs root, ip and tc (iproute2), and the kernel module sch_netem.
#
#   netem.sh up NETEM...         make them; NETEM is what tc understands: delay 80ms 20ms loss 1% rate 2mbit
#   netem.sh change NETEM...     another link, while everything runs
#   netem.sh hub COMMAND...      run something in the hub's namespace; the hub listens on tcp/10.77.0.1:7447
#   netem.sh agent COMMAND...    run something in the agents' namespace
#   netem.sh status              the state of the link: what was sent, dropped and delayed
#   netem.sh down                remove them, and everything that runs in them
#   netem.sh with NETEM... -- COMMAND...   up, COMMAND in the agents' namespace, and down however that ends
#
# First argument --dry-run: print the commands and run none. Only the agents' way to the hub is made slow (its round
# trips too, therefore); V2X_BOTH=1 makes both.
set -euo pipefail

HUB_NS=v2x-hub HUB_IF=v2xhub0 HUB_IP=10.77.0.1
AGENT_NS=v2x-agent AGENT_IF=v2xagent0 AGENT_IP=10.77.0.2
DRY_RUN=

say() { printf '%s\n' "$*" >&2; }
die() { say "netem.sh: $*"; exit 1; }
do_it() {
  say "+ $*"
  [ -n "$DRY_RUN" ] || "$@"
}
usage() { sed -n '2,15s/^# \{0,1\}//p' "$0" >&2; exit 2; }

needs() {
  [ -n "$DRY_RUN" ] && return
  [ "$(id -u)" = 0 ] || die "needs root; --dry-run prints what it would do"
  command -v ip >/dev/null && command -v tc >/dev/null || die "needs ip and tc: install iproute2"
}
is_up() { [ -n "$DRY_RUN" ] || [ -e "/run/netns/$HUB_NS" ] || [ -e "/run/netns/$AGENT_NS" ]; }

shape() { # add or change
  local what=$1 ends=("$AGENT_NS $AGENT_IF") end
  shift
  [ -n "${V2X_BOTH:-}" ] && ends+=("$HUB_NS $HUB_IF")
  for end in "${ends[@]}"; do
    # shellcheck disable=SC2086 # two words
    set -- $end "$@"
    do_it ip netns exec "$1" tc qdisc "$what" dev "$2" root netem "${@:3}" || return
    shift 2
  done
}

wire() {
  do_it ip netns add "$HUB_NS" &&
    do_it ip netns add "$AGENT_NS" &&
    do_it ip link add "$HUB_IF" netns "$HUB_NS" type veth peer name "$AGENT_IF" netns "$AGENT_NS" &&
    do_it ip -n "$HUB_NS" addr add "$HUB_IP/30" dev "$HUB_IF" &&
    do_it ip -n "$AGENT_NS" addr add "$AGENT_IP/30" dev "$AGENT_IF" &&
    do_it ip -n "$HUB_NS" link set lo up &&
    do_it ip -n "$AGENT_NS" link set lo up &&
    do_it ip -n "$HUB_NS" link set "$HUB_IF" up &&
    do_it ip -n "$AGENT_NS" link set "$AGENT_IF" up
}

up() {
  [ $# -gt 0 ] || die "up: what link? for example: delay 80ms 20ms"
  [ -z "$DRY_RUN" ] && is_up && die "is up already; netem.sh down first"
  if ! { wire && shape add "$@"; }; then
    down
    die "not up: no such netem arguments, or this kernel has no sch_netem (modprobe sch_netem)"
  fi
  say "up: in the hub's namespace listen on tcp/$HUB_IP:7447, in the agents' connect to it"
}

down() {
  is_up || { say "is not up"; return; }
  local ns pids
  for ns in "$AGENT_NS" "$HUB_NS"; do
    [ -n "$DRY_RUN" ] || [ -e "/run/netns/$ns" ] || continue
    pids=
    [ -n "$DRY_RUN" ] || pids=$(ip netns pids "$ns")
    # shellcheck disable=SC2086 # several
    [ -z "$pids" ] || do_it kill $pids || true
    # The wire goes with the namespace of either of its ends.
    do_it ip netns del "$ns"
  done
}

status() {
  is_up || { say "is not up"; return; }
  do_it ip -n "$HUB_NS" -br addr
  do_it ip -n "$AGENT_NS" -br addr
  do_it ip netns exec "$HUB_NS" tc -s qdisc show dev "$HUB_IF"
  do_it ip netns exec "$AGENT_NS" tc -s qdisc show dev "$AGENT_IF"
}

with() {
  local link=()
  while [ $# -gt 0 ] && [ "$1" != -- ]; do link+=("$1") && shift; done
  [ $# -gt 1 ] || die "with: expected NETEM... -- COMMAND..."
  shift
  up "${link[@]}"
  trap down EXIT
  trap 'exit 130' INT TERM
  do_it ip netns exec "$AGENT_NS" "$@"
}

[ "${1:-}" != --dry-run ] || { DRY_RUN=1; shift; }
[ $# -gt 0 ] || usage
command=$1
shift
case $command in
  up | down | status | with) needs; "$command" "$@" ;;
  change) needs; shape change "$@" ;;
  hub) needs; do_it ip netns exec "$HUB_NS" "$@" ;;
  agent) needs; do_it ip netns exec "$AGENT_NS" "$@" ;;
  *) usage ;;
esac
