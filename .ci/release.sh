#!/usr/bin/env bash
# The release build of v2x: target/release/v2x with the same bytes wherever this commit is built by the same compiler and linker.
# Paths of the machine are no part of it; its version is the commit, so that the sources must be a clone, without changes.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo_home=${CARGO_HOME:-$HOME/.cargo}
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
# What Rust's compiler writes, and what the C compiler writes for ring.
RUSTFLAGS="--remap-path-prefix=$PWD=/v2x --remap-path-prefix=$cargo_home=/cargo"
CFLAGS="-ffile-prefix-map=$PWD=/v2x -ffile-prefix-map=$cargo_home=/cargo"
export SOURCE_DATE_EPOCH RUSTFLAGS CFLAGS CARGO_INCREMENTAL=0
cargo build --locked --release --package v2x --bin v2x
sha256sum target/release/v2x
