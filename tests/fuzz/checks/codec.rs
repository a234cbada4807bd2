//! What holds of the codec for any bytes: for the fuzz target, and for the test that replays its corpus.

use v2x_common::wire;

/// Decodes the bytes as every kind of message. Panics where a decoded message is not valid, or where encoding it changes
/// its meaning.
pub(crate) fn run(bytes: &[u8]) {
    let (mut ours, mut again) = (Vec::new(), Vec::new());
    if let Ok(frame) = wire::detections::decode(bytes) {
        assert_eq!(frame.validate(), Ok(()));
        // Other encoders may write headings beyond half a turn. After one rounding nothing changes.
        wire::detections::encode(&frame, &mut ours).expect("what was decoded can be encoded");
        let frame = wire::detections::decode(&ours).expect("what was encoded can be decoded");
        wire::detections::encode(&frame, &mut again).expect("what was decoded can be encoded");
        assert_eq!(ours, again);
    }
    if let Ok(frame) = wire::detections::decode_as_sent(bytes) {
        assert_eq!(frame.validate_head(), Ok(()));
        assert_eq!(frame.validate().is_ok(), wire::detections::decode(bytes).is_ok());
    }
    ours.clear();
    if let Ok(frame) = wire::fused::decode(bytes)
        && wire::fused::encode(&frame, &mut ours).is_ok()
    {
        wire::fused::decode(&ours).expect("what was encoded can be decoded");
    }
    ours.clear();
    again.clear();
    if let Ok(delta) = wire::delta::decode(bytes)
        && wire::delta::encode(&delta, &mut ours).is_ok()
    {
        let delta = wire::delta::decode(&ours).expect("what was encoded can be decoded");
        wire::delta::encode(&delta, &mut again).expect("what was decoded can be encoded");
        assert_eq!(ours, again);
    }
    let _ = wire::sensor::decode(bytes);
}
