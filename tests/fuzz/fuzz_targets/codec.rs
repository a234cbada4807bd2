//! Whatever bytes come: what is decoded is valid, and comes back as the same bytes' meaning.
#![no_main]

use libfuzzer_sys::fuzz_target;
use v2x_common::wire;

fuzz_target!(|bytes: &[u8]| {
    let mut again = Vec::new();
    if let Ok(frame) = wire::detections::decode(bytes) {
        assert_eq!(frame.validate(), Ok(()));
        wire::detections::encode(&frame, &mut again).expect("what was decoded can be encoded");
        assert_eq!(wire::detections::decode(&again).as_ref(), Ok(&frame));
    }
    again.clear();
    if let Ok(frame) = wire::fused::decode(bytes)
        && wire::fused::encode(&frame, &mut again).is_ok()
    {
        wire::fused::decode(&again).expect("what was encoded can be decoded");
    }
    let _ = wire::sensor::decode(bytes);
});
