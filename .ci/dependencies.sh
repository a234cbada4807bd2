#!/usr/bin/env bash
# Licences, bans, sources and advisories of all dependencies, also of the Python package, and what is claimed about two advisories.
set -euo pipefail
cd "$(dirname "$0")/.."
# Where everything must be checked (NOTHING_SKIPPED=1: releases, and the weekly look at advisories), what is not is a failure.
not_checked() {
  printf 'NOT CHECKED: %s\n' "$*"
  [ -z "${NOTHING_SKIPPED:-}" ] || exit 1
}

# RUSTSEC-2026-0041 is ignored because lz4_flex's code is left out: zenoh-transport calls it with this feature only.
if cargo tree --locked --workspace --all-features --target all -e features -i zenoh-transport | grep -q transport_compression; then
  echo "zenoh's feature transport_compression is on: RUSTSEC-2026-0041 (lz4_flex 0.10) is reachable, .cargo/deny.toml ignores it" >&2
  exit 1
fi
# RUSTSEC-2024-0436 is ignored because paste runs while we compile, and never in a program.
if ! cargo tree --locked --workspace --all-features -e normal -i paste | head -1 | grep -q '(proc-macro)'; then
  echo "paste is no procedural macro: look at RUSTSEC-2024-0436 again" >&2
  exit 1
fi

if ! command -v cargo-deny >/dev/null; then
  not_checked "licences, bans, sources and advisories of dependencies: cargo-deny is not installed"
  exit 0
fi
for manifest in Cargo.toml deploy/python/Cargo.toml; do
  # Its own search ends at .cargo/deny.toml, for both; the option to name it has another place from version to version.
  deny() { cargo deny --locked --all-features --manifest-path "$manifest" check --hide-inclusion-graph "$@"; }
  deny bans licenses sources
  if ! deny advisories; then
    # Without a network the database of advisories cannot be fetched: that is no fault of a dependency.
    cargo deny fetch db >/dev/null 2>&1 && exit 1
    not_checked "advisories of $manifest: their database cannot be reached"
  fi
done
