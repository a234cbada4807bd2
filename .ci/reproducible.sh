#!/usr/bin/env bash
# Builds this commit's release twice, in clones at two places with names of different lengths, and compares the programs.
# Some ten minutes each on two cores; the results stay in OUT (default: a temporary folder, which is removed).
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
out=${1:-$work/out}
mkdir -p "$out"
# Changes that are not committed are in no clone: what is compared is the commit.
git diff --quiet HEAD || echo "note: changes that are not committed are left out"

first=$work/a second=$work/a-folder-of-another-name/b
for place in "$first" "$second"; do
  git clone --quiet --no-hardlinks "$root" "$place"
  git -C "$place" checkout --quiet --detach "$(git rev-parse HEAD)"
  (cd "$place" && env -u CARGO_TARGET_DIR bash .ci/release.sh)
done
if grep -q --binary-files=text -F -e "$work" "$first/target/release/v2x"; then
  echo "the program holds the path where it was built" >&2
  exit 1
fi
if ! cmp "$first/target/release/v2x" "$second/target/release/v2x"; then
  cp "$first/target/release/v2x" "$out/v2x.first" && cp "$second/target/release/v2x" "$out/v2x.second"
  echo "two builds of one commit differ; with diffoscope: $out/v2x.first $out/v2x.second" >&2
  exit 1
fi
install -m 755 "$first/target/release/v2x" "$out/v2x"
(cd "$out" && sha256sum v2x | tee SHA256SUMS)
echo "two builds in two places have the same bytes"
