//! Small objects, observers and times for the tests of this crate.

use crate::data::run_log::ReceivedFused;
use crate::data::truth::Observer;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::FieldOfView;
use v2x_common::time::{Span, Timestamp};

pub(crate) fn at_ms(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(ms)
}

pub(crate) fn agent(name: &str) -> AgentId {
    AgentId::new(name).unwrap()
}

pub(crate) fn observer(name: &str, range_max_m: f64, itself: Option<u32>) -> Observer {
    Observer {
        agent: agent(name),
        field_of_view: FieldOfView::omnidirectional(0.0, range_max_m),
        itself: itself.map(ObjectId),
    }
}

/// A car's box, heading east.
pub(crate) fn predicted(x: f64, y: f64) -> BevBox {
    BevBox { x, y, w: 2.0, d: 4.0, yaw: 0.0 }
}

/// A parked car, heading east.
pub(crate) fn parked(id: u32, x: f64, y: f64) -> TrueObject {
    TrueObject { id: ObjectId(id), class: Class::Car, bev: predicted(x, y), velocity: (0.0, 0.0) }
}

/// A fused frame without objects that includes frames captured at these times, ms.
pub(crate) fn fused(received_ms: i64, fused_ms: i64, captured_ms: &[i64]) -> ReceivedFused {
    let include = |(sequence, captured): (u64, &i64)| Inclusion {
        frame: FrameId { agent: agent("ego"), epoch: 1, sequence },
        captured_at: at_ms(*captured),
        received_at: at_ms(captured + 5),
    };
    let frame = FusedFrame {
        hub: HubId::new("hub").unwrap(),
        lineage: 1,
        sequence: 0,
        fused_at: at_ms(fused_ms),
        map_frame: None,
        objects: vec![],
        agents: vec![],
        includes: (0..).zip(captured_ms).map(include).collect(),
    };
    ReceivedFused { received_at: at_ms(received_ms), frame }
}
