//! Any bytes: what is decoded is valid, and encoding it keeps its meaning.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../checks/codec.rs"]
mod codec;

fuzz_target!(|bytes: &[u8]| {
    codec::run(bytes);
});
