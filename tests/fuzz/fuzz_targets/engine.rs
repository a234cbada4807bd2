//! Any frames in any order: the engine keeps its invariants.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../../fusion-hub/it/abuse.rs"]
mod abuse;

fuzz_target!(|bytes: &[u8]| {
    abuse::run(bytes);
});
