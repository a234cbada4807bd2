#!/usr/bin/env bash
# Makes the configurations of a Zenoh router between agents and a hub, with TLS and access control, of a folder of `v2x certs`:
#
#   v2x certs init --name router --host router.example   the router takes the place of the hub in the certificates
#   v2x certs agent ego ...
#   v2x certs viewer hub-link                            by this certificate the hub joins the router
#   deploy/zenoh/router.sh certs router hub-link north
#
# It writes certs/hub/router/router.json5, for `zenohd -c router.json5` in that folder, and certs/viewer/hub-link/hub.json5,
# for `v2x hub --id north --zenoh-config certs/viewer/hub-link/hub.json5`. zenohd reads its configuration once: after
# `v2x certs agent`, `viewer` or `revoke` run this again, copy the router's folder and restart zenohd.
set -euo pipefail

if [ "$#" -lt 3 ] || [ "$#" -gt 4 ]; then
  echo "usage: $0 CERTS ROUTER LINK [HUB]: the folder of v2x certs, the names of the router's and of the hub's certificate, and the hub's id (default: hub)" >&2
  exit 2
fi
certs=$1 router=$2 link=$3 hub=${4:-hub}
of_router=$certs/hub/$router of_hub=$certs/viewer/$link
for file in "$of_router/zenoh.json5" "$of_hub/zenoh.json5"; do
  [ -r "$file" ] || { echo "$0: cannot read $file: make it by v2x certs" >&2; exit 1; }
done
command -v jq >/dev/null || { echo "$0: needs jq" >&2; exit 1; }
umask 077

# What v2x certs writes is JSON behind a line of comment.
json() { sed '/^\/\//d' "$1"; }

# The common name stands in the register: a certificate that was made again after a revocation has another one.
name=$(jq -r --arg link "$link" '[.holders[] | select(.role == "viewer" and .name == $link and (.revoked | not))][0]
  | if . == null then empty elif .generation > 1 then "viewer:\(.name)/\(.generation)" else "viewer:\(.name)" end' "$certs/register.json")
[ -n "$name" ] || { echo "$0: no viewer $link in $certs, or it is revoked: v2x certs viewer $link" >&2; exit 1; }

# The holder of the hub's certificate publishes as this hub and answers questions; Zenoh judges an answer by the key that was asked.
# One that stands by for it has the same certificate, and answers under the hub's name with its own lineage behind a `~`.
json "$of_router/zenoh.json5" | jq --arg hub "$hub" --arg name "$name" '
  .access_control.rules += [
    { id: "the hub publishes", permission: "allow", flows: ["ingress"],
      messages: ["put", "declare_queryable", "liveliness_token"], key_exprs: ["v2x/*/hub/\($hub)/**", "v2x/*/hub/\($hub)~$*/status"] },
    { id: "the hub answers", permission: "allow", flows: ["ingress"], messages: ["reply"], key_exprs: ["v2x/*/hub/**"] },
    { id: "the hub is asked", permission: "allow", flows: ["egress"], messages: ["query"], key_exprs: ["v2x/*/hub/**"] }
  ]
  | .access_control.subjects += [{ id: "the hub", cert_common_names: [$name] }]
  | .access_control.policies += [{ rules: ["the hub publishes", "the hub answers", "the hub is asked"], subjects: ["the hub"] }]
  | .adminspace.permissions = { read: false, write: false }
' >"$of_router/router.json5.new"

# The hub listens nowhere, and waits for the router for ever.
json "$of_hub/zenoh.json5" | jq '.listen.endpoints = [] | .connect.timeout_ms = -1' >"$of_hub/hub.json5.new"

mv "$of_router/router.json5.new" "$of_router/router.json5"
mv "$of_hub/hub.json5.new" "$of_hub/hub.json5"
echo "$of_router/router.json5: for zenohd -c router.json5, in its folder"
echo "$of_hub/hub.json5: for v2x hub --id $hub --zenoh-config $of_hub/hub.json5"
