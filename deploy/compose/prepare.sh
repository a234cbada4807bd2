#!/usr/bin/env bash
# Makes the certificates and configurations of compose.yaml in deploy/compose/certs, by the program v2x (or $V2X). Run it again after
# `v2x certs agent`, `viewer` or `revoke`: what is there stays, and the router's configuration is written anew.
#
#   prepare.sh [ADDRESS ...]    further addresses or names by which others reach the router, such as 192.168.1.10
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
certs=$here/certs
v2x() { "${V2X:-v2x}" "$@"; }

if [ ! -e "$certs/register.json" ]; then
  # Within compose the router's name is router. Clients use the first address that is given.
  hosts=(--host router)
  for address in "$@"; do hosts+=(--host "$address"); done
  v2x certs --dir "$certs" init --name router "${hosts[@]}"
fi
# --truth: these agents are simulated, and may say what is true.
[ -e "$certs/agent/ego" ] || v2x certs --dir "$certs" agent ego --truth
[ -e "$certs/agent/rsu" ] || v2x certs --dir "$certs" agent rsu --truth
[ -e "$certs/viewer/screen" ] || v2x certs --dir "$certs" viewer screen
[ -e "$certs/viewer/hub-link" ] || v2x certs --dir "$certs" viewer hub-link
"$here/../zenoh/router.sh" "$certs" router hub-link hub

# Private keys are for their owner only, so that the containers run as that one; for root as the image's own user.
user=$(id -u):$(id -g)
if [ "$(id -u)" = 0 ]; then
  user=65532:65532
  chown -R "$user" "$certs/hub" "$certs/agent" "$certs/viewer"
fi
password=$(head -c 18 /dev/urandom | base64 | tr '+/' 'ab')
umask 077
[ -e "$here/.env" ] || printf 'V2X_USER=%s\nGRAFANA_PASSWORD=%s\n' "$user" "$password" >"$here/.env"
echo "$here/.env: the user of the containers, and the password of Grafana's user admin"
