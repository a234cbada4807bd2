//! The hub's list by what changes: a key frame once a second, and delta frames between.

use super::encoding::encode_list;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::lists::{DeltaSource, ListUpdate, Tolerance};
use v2x_common::wire::{self, WireError};

/// Makes the messages of one stream.
#[derive(Debug)]
pub(super) struct DeltaStream {
    source: DeltaSource,
    buffer: Vec<u8>,
}

impl Default for DeltaStream {
    fn default() -> Self {
        Self { source: DeltaSource::new(Tolerance::HUB), buffer: Vec::new() }
    }
}

impl DeltaStream {
    /// The next message, of a list without contributors.
    pub(super) fn next(&mut self, list: &FusedFrame) -> Result<ListUpdate, WireError> {
        if let Some(delta) = self.source.delta(list) {
            return Ok(ListUpdate::Delta(delta));
        }
        self.source.forget();
        encode_list(list, &mut self.buffer)?;
        let key = wire::fused::decode(&self.buffer)?;
        self.source.set_key(key.clone());
        Ok(ListUpdate::Key(key))
    }

    /// Nobody subscribes: whoever comes next begins with a key frame.
    pub(super) fn forget(&mut self) {
        self.source.forget();
    }
}

/// The list alone: without contributors, agents and inclusions.
pub(super) fn plain(frame: &FusedFrame) -> FusedFrame {
    let objects = frame.objects.iter().map(FusedObject::without_contributors).collect();
    FusedFrame { objects, ..frame.without_lists() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{HubId, TrackId};
    use v2x_common::lists::DeltaFollower;
    use v2x_common::time::{Span, Timestamp};

    /// Objects in a row, at these distances east of their places.
    fn list(sequence: u64, shifts: &[f64]) -> FusedFrame {
        let object = |(number, shift): (u32, &f64)| {
            let bev = BevBox { x: 10.0 * f64::from(number) + shift, y: 1.23456, w: 1.8, d: 4.5, yaw: 0.1 };
            FusedObject::from_box(TrackId::new(1, number), Class::Car, bev)
        };
        FusedFrame {
            hub: HubId::new("hub").unwrap(),
            lineage: 1,
            sequence,
            fused_at: Timestamp::EPOCH + Span::from_millis(100 * i64::try_from(sequence).unwrap()),
            map_frame: None,
            objects: (0..).zip(shifts).map(object).collect(),
            agents: Vec::new(),
            includes: Vec::new(),
        }
    }

    fn is_key(update: &ListUpdate) -> bool {
        matches!(update, ListUpdate::Key(_))
    }

    #[test]
    fn there_is_a_key_frame_each_second_and_one_for_who_comes_first() {
        let mut stream = DeltaStream::default();
        let keys = (0..25).filter(|sequence| is_key(&stream.next(&list(*sequence, &[0.0; 4])).unwrap()));
        assert_eq!(keys.collect::<Vec<_>>(), [0, 10, 20]);
        stream.forget();
        assert!(is_key(&stream.next(&list(25, &[0.0; 4])).unwrap()));
    }

    #[test]
    fn where_most_has_changed_or_the_lineage_or_time_is_another_a_key_frame_comes_early() {
        let second = |list: FusedFrame| {
            let mut stream = DeltaStream::default();
            stream.next(&self::list(5, &[0.0; 4])).unwrap();
            is_key(&stream.next(&list).unwrap())
        };
        assert!(!second(list(6, &[1.0, 1.0, 0.0, 0.0])) && second(list(6, &[1.0, 1.0, 1.0, 0.0])));
        assert!(second(list(6, &[0.0])), "three are gone");
        assert!(second(list(4, &[0.0; 4])), "time went back");
        assert!(second(FusedFrame { lineage: 2, ..list(6, &[0.0; 4]) }));
    }

    /// Against its own key frame a hub would let pass what is beyond the tolerance of the consumer's, which is rounded.
    #[test]
    fn changes_are_relative_to_what_consumers_have_of_the_key_frame() {
        let (mut stream, mut follower) = (DeltaStream::default(), DeltaFollower::default());
        for (sequence, shift) in [(0, 0.0004), (1, 0.2002)] {
            let update = stream.next(&list(sequence, &[shift, 0.0])).unwrap();
            if let (ListUpdate::Delta(delta), true) = (&update, sequence == 1) {
                assert_eq!(delta.changed.len(), 1, "0.2002 m from a place that was rounded to 0");
            }
            let followed = follower.handle(update).unwrap();
            assert!((followed.objects[0].bev.x - shift).abs() <= 0.2 + 1e-9);
        }
    }

    #[test]
    fn an_object_that_the_wire_cannot_hold_is_left_out_of_the_key_frame() {
        let mut stream = DeltaStream::default();
        let absurd = FusedFrame { sequence: 0, ..list(0, &[f64::NAN]) };
        let ListUpdate::Key(key) = stream.next(&absurd).unwrap() else { panic!("no key frame") };
        assert!(key.objects.is_empty());
        assert!(!is_key(&stream.next(&FusedFrame { sequence: 1, ..list(0, &[]) }).unwrap()));
    }
}
