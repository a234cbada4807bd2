//! In what two lists differ, in words.

use std::fmt;
use v2x_common::fused::{FusedFrame, FusedObject};

/// The first difference of two lists of one number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    /// The number of the list.
    pub(crate) sequence: u64,
    /// What differs.
    pub(crate) what: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "list {}: {}", self.sequence, self.what)
    }
}

impl Difference {
    pub(super) fn of(recorded: &[u8], computed: &[u8]) -> Self {
        let decode = |bytes| v2x_common::wire::fused::decode(bytes).ok();
        match (decode(recorded), decode(computed)) {
            (Some(recorded), Some(computed)) => {
                Self { sequence: recorded.sequence, what: between(&recorded, &computed) }
            }
            _ => Self { sequence: 0, what: "one of the two cannot be read".into() },
        }
    }
}

fn between(recorded: &FusedFrame, computed: &FusedFrame) -> String {
    let head = |frame: &FusedFrame| (frame.fused_at, frame.map_frame, frame.lineage);
    if head(recorded) != head(computed) {
        return format!("recorded for {}, computed for {}", recorded.fused_at, computed.fused_at);
    }
    if recorded.agents != computed.agents {
        return "the counts of the agents".into();
    }
    if recorded.includes != computed.includes {
        let counts = [recorded, computed].map(|frame| frame.includes.len());
        return format!("the frames that are new in it: {} recorded, {} computed", counts[0], counts[1]);
    }
    if recorded.objects.len() != computed.objects.len() {
        let counts = [recorded, computed].map(|frame| frame.objects.len());
        return format!("{} objects recorded, {} computed", counts[0], counts[1]);
    }
    let mut pairs = recorded.objects.iter().zip(&computed.objects);
    match pairs.find(|(one, other)| one != other) {
        Some((one, other)) => between_objects(one, other),
        None => "nothing but the bytes".into(),
    }
}

fn between_objects(recorded: &FusedObject, computed: &FusedObject) -> String {
    if recorded.track != computed.track {
        return format!("object {} recorded, {} computed", recorded.track, computed.track);
    }
    let numbers = |object: &FusedObject| {
        let (vx, vy) = object.velocity;
        [
            ("x", object.bev.x),
            ("y", object.bev.y),
            ("vx", vx),
            ("vy", vy),
            ("w", object.bev.w),
            ("d", object.bev.d),
            ("yaw", object.bev.yaw),
            ("existence", object.existence),
        ]
    };
    let mut pairs = numbers(recorded).into_iter().zip(numbers(computed));
    #[expect(clippy::float_cmp, reason = "the same bits are asked for")]
    let differing = pairs.find(|((_, one), (_, other))| one != other);
    match differing {
        Some(((name, one), (_, other))) => {
            format!("{name} of object {} is {one} recorded, {other} computed", recorded.track)
        }
        None => format!("classes, covariances or contributors of object {}", recorded.track),
    }
}
