//! Lists and detections as messages of Foxglove's schema `SceneUpdate`, so that its viewers show a recording as it is.
//!
//! The schema: <https://docs.foxglove.dev/docs/visualization/message-schemas/scene-update>.

use super::entry::Entry;
use crate::class::Class;
use crate::detection::DetectionFrame;
use crate::fused::{FusedFrame, FusedObject};
use crate::geometry::BevBox;
use crate::keys::Topic;
use crate::time::{Span, Timestamp};
use crate::wire::{self, WireError, Writings};
use serde_json::{Value, json};

/// What follows the key of a list or of detections in the name of their scene's topic.
pub const SCENE_SUFFIX: &str = "/scene";
/// The name of the schema of scenes; viewers know the fields by it.
pub const SCENE_SCHEMA_NAME: &str = "foxglove.SceneUpdate";
/// The schema of scenes, as JSON schema.
pub const SCENE_SCHEMA: &str = r#"{"title":"foxglove.SceneUpdate","type":"object","properties":{"deletions":{"type":"array","items":{"type":"object"}},"entities":{"type":"array","items":{"type":"object"}}}}"#;
/// The frame of all positions, where none is named.
const MAP: &str = "map";
/// An entity that is not renewed vanishes after this.
const LIFETIME: Span = Span::from_millis(500);
/// Height of all boxes: nothing is known of it, m.
const HEIGHT_M: f64 = 1.5;
/// The fused list.
const FUSED: Colour = Colour(0.8, 0.47, 0.65, 0.85);
/// The agents, in turn.
const AGENTS: [Colour; 5] = [
    Colour(0.84, 0.37, 0.0, 0.35),
    Colour(0.0, 0.62, 0.45, 0.35),
    Colour(0.9, 0.62, 0.0, 0.35),
    Colour(0.34, 0.71, 0.91, 0.35),
    Colour(0.65, 0.46, 0.11, 0.35),
];

/// Makes scenes of samples, of each topic not too many.
#[derive(Clone, Debug)]
pub struct Scenes {
    interval: Span,
    /// When each key had its last scene, in the order in which the keys came.
    last: Vec<(String, Timestamp)>,
    writings: Writings,
}

/// A message of Foxglove's schema `SceneUpdate`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scene {
    /// Its topic.
    pub topic: String,
    /// Its text.
    pub json: Vec<u8>,
}

impl Scenes {
    /// At least this time between two scenes of a topic.
    pub fn new(interval: Span) -> Self {
        Self { interval, last: Vec::new(), writings: Writings::default() }
    }

    /// From now on agents write so.
    pub fn read_by(&mut self, writings: Writings) {
        self.writings = writings;
    }

    /// The scene of a sample; `None` where it has none, where the last one was just before, and where the sample cannot be
    /// read.
    pub fn of(&mut self, entry: &Entry) -> Option<Scene> {
        let place = self.last.iter().position(|(key, _)| *key == entry.key);
        if place.is_some_and(|place| entry.received_at - self.last[place].1 < self.interval) {
            return None;
        }
        let json = scene_of(entry, place.unwrap_or(self.last.len()), &self.writings)?.ok()?;
        match place {
            Some(place) => self.last[place].1 = entry.received_at,
            None => self.last.push((entry.key.clone(), entry.received_at)),
        }
        Some(Scene { topic: format!("{}{SCENE_SUFFIX}", entry.key), json })
    }

    /// Every topic begins anew.
    pub(super) fn clear(&mut self) {
        self.last.clear();
    }
}

/// Red, green, blue and opacity, each from 0 to 1.
#[derive(Clone, Copy)]
struct Colour(f64, f64, f64, f64);

/// The scene of a sample, as JSON; `None` where it has none. `n_agent` is the agent's number, for its colour.
fn scene_of(entry: &Entry, n_agent: usize, writings: &Writings) -> Option<Result<Vec<u8>, WireError>> {
    let scene = match Topic::of(&entry.key)? {
        Topic::Fused(_) => wire::fused::decode(&entry.payload).map(|frame| of_list(&frame)),
        Topic::Detections(agent) => {
            let frame = writings.read(agent, &entry.encoding, &entry.payload);
            frame.map(|frame| of_detections(&frame, AGENTS[n_agent % AGENTS.len()]))
        }
        _ => return None,
    };
    Some(scene.map(|scene| scene.to_string().into_bytes()))
}

fn of_list(frame: &FusedFrame) -> Value {
    let map = frame.map_frame.map_or_else(|| MAP.to_owned(), |name| name.to_string());
    let entities = frame.objects.iter().map(|object| {
        let mut entity = entity(&object.track.to_string(), frame.fused_at, &map);
        entity["cubes"] = json!([cube(&object.bev, FUSED)]);
        entity["texts"] = json!([label(object)]);
        entity["metadata"] = json!([{ "key": "class", "value": object.class.name() }]);
        entity
    });
    json!({ "deletions": [], "entities": entities.collect::<Vec<_>>() })
}

fn of_detections(frame: &DetectionFrame, colour: Colour) -> Value {
    let map = frame.map_frame.map_or_else(|| MAP.to_owned(), |name| name.to_string());
    let mut entity = entity(frame.id.agent.as_str(), frame.captured_at, &map);
    let possible = frame.detections.iter().filter(|detection| detection.validate(None).is_ok());
    let cubes = possible.map(|detection| cube(&detection.bev, colour));
    entity["cubes"] = cubes.collect();
    json!({ "deletions": [], "entities": [entity] })
}

fn entity(id: &str, at: Timestamp, map: &str) -> Value {
    json!({
        "timestamp": seconds(at - Timestamp::EPOCH), "frame_id": map, "id": id, "lifetime": seconds(LIFETIME),
        "frame_locked": true, "metadata": [], "arrows": [], "cubes": [], "spheres": [], "cylinders": [],
        "lines": [], "triangles": [], "texts": [], "models": [],
    })
}

fn seconds(span: Span) -> Value {
    let nanos = span.as_nanos();
    json!({ "sec": nanos.div_euclid(1_000_000_000), "nsec": nanos.rem_euclid(1_000_000_000) })
}

fn cube(bev: &BevBox, Colour(r, g, b, a): Colour) -> Value {
    let (sin, cos) = libm::sincos(bev.yaw / 2.0);
    json!({
        "pose": {
            "position": { "x": rounded(bev.x), "y": rounded(bev.y), "z": HEIGHT_M / 2.0 },
            "orientation": { "x": 0, "y": 0, "z": rounded(sin), "w": rounded(cos) },
        },
        "size": { "x": rounded(bev.d), "y": rounded(bev.w), "z": HEIGHT_M },
        "color": { "r": r, "g": g, "b": b, "a": a },
    })
}

fn label(object: &FusedObject) -> Value {
    let BevBox { x, y, .. } = object.bev;
    json!({
        "pose": {
            "position": { "x": rounded(x), "y": rounded(y), "z": HEIGHT_M + 0.6 },
            "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 },
        },
        "billboard": true, "font_size": 0.8, "scale_invariant": false,
        "color": { "r": 1, "g": 1, "b": 1, "a": 1 },
        "text": format!("{} {}", short(object.class), object.track.counter()),
    })
}

/// The last part of a class's name.
fn short(class: Class) -> &'static str {
    class.name().rsplit('.').next().unwrap_or_default()
}

/// To a millimetre, or a thousandth.
fn rounded(value: f64) -> f64 {
    libm::round(value * 1e3) / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::{AgentId, FrameId, HubId, NetworkId, TrackId};
    use crate::keys::Keys;

    const KEYS: fn() -> Keys = || Keys::new(NetworkId::new("demo").unwrap());

    fn entry(key: String, payload: Vec<u8>) -> Entry {
        Entry { received_at: Timestamp::EPOCH, key, encoding: wire::ENCODING_POSTCARD.into(), payload }
    }

    #[test]
    fn every_object_of_a_list_is_an_entity_with_its_box_turned_by_its_heading() {
        let hub = HubId::new("hub").unwrap();
        let bev = BevBox { x: 3.0, y: -4.0, w: 1.8, d: 4.5, yaw: std::f64::consts::FRAC_PI_2 };
        let frame = FusedFrame {
            hub,
            lineage: 1,
            sequence: 0,
            fused_at: Timestamp::from_nanos(1_500_000_000),
            map_frame: None,
            objects: vec![FusedObject::from_box(TrackId::new(1, 7), Class::Car, bev)],
            agents: Vec::new(),
            includes: Vec::new(),
        };
        let mut payload = Vec::new();
        wire::fused::encode(&frame, &mut payload).unwrap();
        let scene = scene_of(&entry(KEYS().fused(&hub), payload), 0, &Writings::default()).unwrap().unwrap();
        let scene: Value = serde_json::from_slice(&scene).unwrap();
        let entity = &scene["entities"][0];
        assert_eq!(entity["id"], "00000001-7");
        assert_eq!(entity["timestamp"], json!({ "sec": 1, "nsec": 500_000_000 }));
        assert_eq!(entity["texts"][0]["text"], "car 7");
        let cube = &entity["cubes"][0];
        let number = |value: &Value| value.as_f64().unwrap();
        assert!((number(&cube["pose"]["orientation"]["z"]) - 0.707).abs() < 1e-3, "{cube}");
        assert!((number(&cube["size"]["x"]) - 4.5).abs() < 0.01, "along the heading: {cube}");
    }

    #[test]
    fn the_detections_of_an_agent_are_one_entity_and_other_samples_have_no_scene() {
        let agent = AgentId::new("ego").unwrap();
        let id = FrameId { agent, epoch: 1, sequence: 1 };
        let mut payload = Vec::new();
        wire::detections::encode(&DetectionFrame::empty(id, Timestamp::EPOCH), &mut payload).unwrap();
        let scene = scene_of(&entry(KEYS().detections(&agent), payload.clone()), 1, &Writings::default())
            .unwrap()
            .unwrap();
        let scene: Value = serde_json::from_slice(&scene).unwrap();
        assert_eq!(scene["entities"].as_array().map(Vec::len), Some(1));
        assert!(scene_of(&entry(KEYS().truth(&agent), payload.clone()), 0, &Writings::default()).is_none());
        assert!(
            scene_of(&entry(KEYS().detections(&agent), vec![1, 2]), 0, &Writings::default())
                .unwrap()
                .is_err()
        );
    }
}
