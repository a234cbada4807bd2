#!/usr/bin/env bash
# The list of everything that is in the program v2x, as CycloneDX JSON: v2x.cdx.json in OUT (default: target). By cargo-cyclonedx, the
# plugin of CycloneDX itself: `cargo install cargo-cyclonedx --locked`.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-target}
if ! command -v cargo-cyclonedx >/dev/null; then
  echo "NOT CHECKED: the list of the program's parts (SBOM): cargo-cyclonedx is not installed"
  exit "${NOTHING_SKIPPED:-0}"
fi
mkdir -p "$out"
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
# It writes a file beside each manifest of the workspace. Only what is linked: no tools of the build.
cargo cyclonedx --format json --describe binaries --target x86_64-unknown-linux-gnu --no-build-deps --quiet
mv deploy/v2x_bin.cdx.json "$out/v2x.cdx.json"
git ls-files --others --exclude-standard -- '*.cdx.json' | xargs -r rm --
python3 - "$out/v2x.cdx.json" <<'PY'
import json, sys

parts = {(part["name"], part["version"]) for part in json.load(open(sys.argv[1]))["components"]}
missing = {"zenoh", "rustls", "ring", "tokio"} - {name for name, _ in parts}
assert not missing, f"the list does not have {missing}"
print(f"{sys.argv[1]}: {len(parts)} parts")
PY
