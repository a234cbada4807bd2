//! Whatever bytes come: what is decoded is valid, and what we encode means the same for ever after.
#![no_main]

use libfuzzer_sys::fuzz_target;
use v2x_common::wire;

fuzz_target!(|bytes: &[u8]| {
    let (mut ours, mut again) = (Vec::new(), Vec::new());
    if let Ok(frame) = wire::detections::decode(bytes) {
        assert_eq!(frame.validate(), Ok(()));
        // Foreign bytes may hold headings beyond half a turn; after one rounding nothing changes any more.
        wire::detections::encode(&frame, &mut ours).expect("what was decoded can be encoded");
        let frame = wire::detections::decode(&ours).expect("what was encoded can be decoded");
        wire::detections::encode(&frame, &mut again).expect("what was decoded can be encoded");
        assert_eq!(ours, again);
    }
    ours.clear();
    if let Ok(frame) = wire::fused::decode(bytes)
        && wire::fused::encode(&frame, &mut ours).is_ok()
    {
        wire::fused::decode(&ours).expect("what was encoded can be decoded");
    }
    let _ = wire::sensor::decode(bytes);
});
