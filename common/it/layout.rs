//! The layout as plain serde structs: postcard reads from the codec's bytes what the frame holds, and writes
//! the same bytes again.

use crate::{fixture, strategy};
use proptest::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{self, Covariance2};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::Inclusion;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId, MAX_NAME_LEN, MapFrame, MeasurementId, TrackId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{VERSION, delta, detections, fused};

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct DetectionsHead {
    agent: String,
    epoch: u64,
    sequence: u64,
    captured_at_ns: i64,
    sensor_revision: u32,
    flags: u8,
    count: u32,
}

/// mm, mm, 0.1 mrad.
type SensorPose = (i64, i64, i16);

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Detection {
    flags: u8,
    class: u8,
    score: u8,
    x: i64,
    y: i64,
    w: u16,
    d: u16,
    yaw: i16,
    position: (u8, u8, i8),
    sw: u8,
    sd: u8,
    st: u8,
}

type Velocity = (i32, i32, (u8, u8, i8));

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct FusedHead {
    hub: String,
    lineage: u32,
    sequence: u64,
    fused_at_ns: i64,
    map_frame: Option<String>,
    origin_m: (i32, i32),
    agents: u32,
    objects: u32,
    includes: u32,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Agent {
    agent: String,
    epoch: u64,
    newest_before_fused_ns: i64,
    accepted: u64,
    refused: u64,
    out_of_sequence: u64,
}

/// In fused frames the number of contributors follows.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Object {
    lineage_xor: u32,
    counter: u32,
    x: i64,
    y: i64,
    vx: i32,
    vy: i32,
    w: u16,
    d: u16,
    yaw: i16,
    kinematic: ([u8; 4], [i8; 6]),
    sw: u8,
    sd: u8,
    st: u8,
    existence: u8,
    age_ns: i64,
    measured_before_fused_ns: i64,
    classes: u32,
}

/// Agent by its place in the list, epoch relative to the agent's newest, sequence.
type WireFrameId = (u32, u64, u64);
type Contributor = (WireFrameId, u16);
/// Captured and received, both as ns before `fused_at`.
type WireInclusion = (WireFrameId, i64, i64);

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct DeltaHead {
    hub: String,
    lineage: u32,
    sequence: u64,
    fused_at_ns: i64,
    map_frame: Option<String>,
    origin_m: (i32, i32),
    from_key: u64,
    changed: u32,
    gone: u32,
}

/// Lineage relative to the hub's, counter.
type Gone = (u32, u32);

/// Reads by serde, and keeps what it writes of the same.
struct Rewriter<'a> {
    rest: &'a [u8],
    written: Vec<u8>,
}

impl<'a> Rewriter<'a> {
    fn new(bytes: &'a [u8], kind: u8) -> Self {
        assert_eq!(bytes[..2], [VERSION, kind]);
        Self { rest: &bytes[2..], written: bytes[..2].to_vec() }
    }

    fn next<T: Serialize + DeserializeOwned>(&mut self) -> T {
        let (value, rest) = postcard::take_from_bytes(self.rest).unwrap();
        self.rest = rest;
        self.written.extend(postcard::to_stdvec(&value).unwrap());
        value
    }
}

/// The encoder reserves room for the longest numbers.
#[test]
fn the_longest_names_and_numbers_have_room() {
    let text = "n".repeat(MAX_NAME_LEN);
    let (earliest, latest) = (Timestamp::MIN, Timestamp::MAX);
    let id = FrameId { agent: AgentId::new(&text).unwrap(), epoch: u64::MAX, sequence: u64::MAX };
    let mut frame = DetectionFrame { id, captured_at: earliest, ..fixture::detection_frame() };
    frame.sensor_revision = u32::MAX;
    frame.sensor_pose = Some(Pose { x: -1e8, y: -1e8, yaw: PI });
    frame.map_frame = Some(MapFrame::new(&text).unwrap());
    frame.detections.truncate(1);
    let detection = &mut frame.detections[0];
    detection.bev = BevBox { x: -1e8 - 1e4, y: -1e8 - 1e4, w: 65.0, d: 65.0, yaw: PI };
    detection.velocity =
        Some(covariance::Velocity { x: -150.0, y: -150.0, covariance: Covariance2::isotropic(1.0) });
    detection.source_track = Some(u64::MAX);
    let mut bytes = Vec::new();
    detections::encode(&frame, &mut bytes).unwrap();
    assert_eq!(detections::decode(&bytes).unwrap().id, id);

    let mut frame = fixture::fused_frame();
    (frame.hub, frame.map_frame) = (HubId::new(&text).unwrap(), MapFrame::new(&text).ok());
    (frame.lineage, frame.sequence, frame.fused_at) = (u32::MAX, u64::MAX, latest);
    let mut health = frame.agents[0];
    (health.agent, health.epoch, health.newest_captured_at) = (id.agent, 0, earliest);
    (health.accepted, health.refused, health.out_of_sequence) = (u64::MAX, u64::MAX, u64::MAX);
    frame.agents = vec![health];
    frame.objects.truncate(1);
    let object = &mut frame.objects[0];
    object.track = TrackId(u64::from(u32::MAX));
    object.bev = BevBox { x: -2e9, y: 2e9, w: 65.0, d: 65.0, yaw: PI };
    object.velocity = (-2e6, 2e6);
    (object.age, object.last_measured_at) = (Span::from_nanos(i64::MIN), earliest);
    object.class_probabilities = Class::ALL.map(|class| (class, 1.0)).to_vec();
    object.class_conflict = 1.0;
    object.contributors = vec![MeasurementId { frame: id, index: u16::MAX }; 4096];
    frame.includes = vec![Inclusion { frame: id, captured_at: earliest, received_at: earliest }];
    bytes.clear();
    fused::encode(&frame, &mut bytes).unwrap();
    assert_eq!(fused::decode(&bytes).unwrap().objects[0].contributors, frame.objects[0].contributors);
}

proptest! {
    #[test]
    fn the_layout_of_detection_frames_is_that_of_plain_serde_structs(frame in strategy::detection_frame()) {
        let mut bytes = Vec::new();
        detections::encode(&frame, &mut bytes).unwrap();
        let mut rewriter = Rewriter::new(&bytes, b'D');
        let head: DetectionsHead = rewriter.next();
        prop_assert_eq!(head.agent, frame.id.agent.as_str());
        prop_assert_eq!((head.epoch, head.sequence), (frame.id.epoch, frame.id.sequence));
        prop_assert_eq!(head.captured_at_ns, frame.captured_at.as_nanos());
        prop_assert_eq!((head.sensor_revision, head.count as usize), (frame.sensor_revision, frame.detections.len()));
        let origin_mm = if head.flags & 1 != 0 { rewriter.next::<SensorPose>() } else { (0, 0, 0) };
        if head.flags & 2 != 0 {
            prop_assert_eq!(Some(rewriter.next::<String>()), frame.map_frame.map(|name| name.to_string()));
        }
        for (sent, got) in frame.detections.iter().zip(detections::decode(&bytes).unwrap().detections) {
            let detection: Detection = rewriter.next();
            prop_assert_eq!((detection.class, detection.flags & 1 != 0), (sent.class.byte(), sent.velocity.is_some()));
            prop_assert_eq!(got.bev.x, origin_mm.0 as f64 * 1e-3 + detection.x as f64 * 1e-3);
            prop_assert_eq!(got.bev.y, origin_mm.1 as f64 * 1e-3 + detection.y as f64 * 1e-3);
            prop_assert_eq!((got.bev.w, got.bev.d), (f64::from(detection.w) * 1e-3, f64::from(detection.d) * 1e-3));
            if detection.flags & 1 != 0 {
                let (x, y, _) = rewriter.next::<Velocity>();
                let got = got.velocity.unwrap();
                prop_assert_eq!((got.x, got.y), (f64::from(x) * 1e-3, f64::from(y) * 1e-3));
            }
            if detection.flags & 2 != 0 {
                prop_assert_eq!(Some(rewriter.next::<u64>()), sent.source_track);
            }
        }
        prop_assert_eq!((rewriter.rest, rewriter.written), (&[][..], bytes.clone()));
    }

    #[test]
    fn the_layout_of_fused_frames_is_that_of_plain_serde_structs(frame in strategy::fused_frame()) {
        let mut bytes = Vec::new();
        fused::encode(&frame, &mut bytes).unwrap();
        let mut rewriter = Rewriter::new(&bytes, b'F');
        let head: FusedHead = rewriter.next();
        prop_assert_eq!((head.hub, head.lineage, head.sequence), (frame.hub.to_string(), frame.lineage, frame.sequence));
        prop_assert_eq!(head.map_frame, frame.map_frame.map(|name| name.to_string()));
        prop_assert_eq!(head.fused_at_ns, frame.fused_at.as_nanos());
        for health in &frame.agents {
            let agent: Agent = rewriter.next();
            prop_assert_eq!((agent.agent, agent.epoch), (health.agent.to_string(), health.epoch));
            prop_assert_eq!([agent.accepted, agent.refused], [health.accepted, health.refused]);
            prop_assert_eq!(agent.out_of_sequence, health.out_of_sequence);
        }
        for (sent, got) in frame.objects.iter().zip(fused::decode(&bytes).unwrap().objects) {
            let object: Object = rewriter.next();
            prop_assert_eq!(rewriter.next::<u32>() as usize, sent.contributors.len());
            prop_assert_eq!((object.lineage_xor ^ head.lineage, object.counter), (sent.track.lineage(), sent.track.counter()));
            prop_assert_eq!(object.age_ns, sent.age.as_nanos());
            prop_assert_eq!(got.bev.x, (object.x + 1000 * i64::from(head.origin_m.0)) as f64 * 1e-3);
            prop_assert_eq!(got.bev.y, (object.y + 1000 * i64::from(head.origin_m.1)) as f64 * 1e-3);
            prop_assert_eq!(got.velocity, (f64::from(object.vx) * 1e-3, f64::from(object.vy) * 1e-3));
            for (class, _) in &sent.class_probabilities {
                prop_assert_eq!(rewriter.next::<(u8, u8)>().0, class.byte());
            }
            if got.class_conflict > 0.0 {
                let conflict = f64::from(rewriter.next::<u8>()) / 255.0;
                prop_assert!((conflict - sent.class_conflict).abs() <= 0.5 / 255.0 + 1e-12);
            }
            for contributor in &sent.contributors {
                let ((place, epoch_xor, sequence), index) = rewriter.next::<Contributor>();
                let health = &frame.agents[place as usize];
                prop_assert_eq!((health.agent, index), (contributor.frame.agent, contributor.index));
                prop_assert_eq!((epoch_xor ^ health.epoch, sequence), (contributor.frame.epoch, contributor.frame.sequence));
            }
        }
        for inclusion in &frame.includes {
            let ((place, _, sequence), _, _) = rewriter.next::<WireInclusion>();
            let health = &frame.agents[place as usize];
            prop_assert_eq!((health.agent, sequence), (inclusion.frame.agent, inclusion.frame.sequence));
        }
        prop_assert_eq!((rewriter.rest, rewriter.written), (&[][..], bytes.clone()));
    }

    #[test]
    fn the_layout_of_delta_frames_is_that_of_plain_serde_structs(frame in strategy::delta_frame()) {
        let mut bytes = Vec::new();
        delta::encode(&frame, &mut bytes).unwrap();
        let mut rewriter = Rewriter::new(&bytes, b'C');
        let head: DeltaHead = rewriter.next();
        prop_assert_eq!((head.hub, head.lineage, head.sequence), (frame.hub.to_string(), frame.lineage, frame.sequence));
        prop_assert_eq!(head.map_frame, frame.map_frame.map(|name| name.to_string()));
        prop_assert_eq!(head.fused_at_ns, frame.fused_at.as_nanos());
        prop_assert_eq!(frame.key_sequence, frame.sequence.wrapping_sub(head.from_key));
        prop_assert_eq!((head.changed as usize, head.gone as usize), (frame.changed.len(), frame.gone.len()));
        for sent in &frame.changed {
            let object: Object = rewriter.next();
            prop_assert_eq!((object.lineage_xor ^ head.lineage, object.counter), (sent.track.lineage(), sent.track.counter()));
            for (class, _) in &sent.class_probabilities {
                prop_assert_eq!(rewriter.next::<(u8, u8)>().0, class.byte());
            }
            if object.classes >> 8 == 1 {
                rewriter.next::<u8>();
            }
        }
        for track in &frame.gone {
            let (lineage_xor, counter) = rewriter.next::<Gone>();
            prop_assert_eq!(*track, TrackId::new(lineage_xor ^ frame.lineage, counter));
        }
        prop_assert_eq!((rewriter.rest, rewriter.written), (&[][..], bytes.clone()));
    }
}
