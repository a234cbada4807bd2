//! In steady state the codec allocates nothing. A program of its own: it replaces the allocator.

#[cfg(test)]
#[path = "../it/fixture.rs"]
#[expect(dead_code, reason = "only the frames are needed")]
mod fixture;

#[cfg(test)]
mod tests {
    use crate::fixture;
    use allocation_counter::measure;
    use v2x_common::detection::DetectionFrame;
    use v2x_common::time::Timestamp;
    use v2x_common::wire::{detections, fused};

    const N_DETECTIONS: usize = 100;

    fn detection_frame() -> DetectionFrame {
        let mut frame = fixture::detection_frame();
        frame.detections = frame.detections.iter().copied().cycle().take(N_DETECTIONS).collect();
        frame
    }

    #[test]
    fn the_counter_counts() {
        assert_eq!(measure(|| drop(std::hint::black_box(vec![0; N_DETECTIONS]))).count_total, 1);
    }

    #[test]
    fn encoding_into_a_buffer_that_has_grown_allocates_nothing() {
        let (detection_frame, fused_frame) = (detection_frame(), fixture::fused_frame());
        let mut buffer = Vec::new();
        detections::encode(&detection_frame, &mut buffer).unwrap();
        let encoding = measure(|| {
            buffer.clear();
            detections::encode(&detection_frame, &mut buffer).unwrap();
            buffer.clear();
            fused::encode(&fused_frame, &mut buffer).unwrap();
        });
        assert_eq!(encoding.count_total, 0);
    }

    #[test]
    fn decoding_into_a_frame_that_has_held_as_many_detections_allocates_nothing() {
        let sent = detection_frame();
        let mut bytes = Vec::new();
        detections::encode(&sent, &mut bytes).unwrap();
        let mut frame = DetectionFrame::empty(sent.id, Timestamp::EPOCH);
        detections::decode_into(&bytes, &mut frame).unwrap();
        let decoding = measure(|| detections::decode_into(&bytes, &mut frame).unwrap());
        assert_eq!(decoding.count_total, 0);
        assert_eq!(frame, detections::decode(&bytes).unwrap());
    }
}
