use super::*;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, FrameId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::ENCODING_POSTCARD;
use v2x_common::wire::journal::{self, Body, Call, Item, Start};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::{Core, HubSettings, encode_list};

/// A hub that journals, and what its recorder gets.
struct Hub {
    core: Core,
    next: u64,
    entries: Vec<Entry>,
}

fn keys() -> Keys {
    Keys::new(NetworkId::new("demo").unwrap())
}

fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(1_000_000 + ms)
}

impl Hub {
    fn new() -> Self {
        let settings = HubSettings::default();
        Self { core: Core::new(settings, Engine::new), next: 0, entries: Vec::new() }
    }

    fn batch(&mut self, items: &[Item<'_>]) {
        let mut payload = Vec::new();
        journal::begin(1, self.next, &mut payload).unwrap();
        items.iter().for_each(|item| journal::push(item, &mut payload).unwrap());
        self.next += items.len() as u64;
        let hub = self.core.settings().engine.hub;
        self.push(keys().journal(&hub), payload);
    }

    fn push(&mut self, key: String, payload: Vec<u8>) {
        let received_at = at(0);
        self.entries.push(Entry { received_at, key, encoding: ENCODING_POSTCARD.into(), payload });
    }

    fn start(&mut self) {
        let settings = serde_json::to_string(self.core.settings()).unwrap();
        let state = self.core.save().unwrap();
        let start = Start {
            settings: &settings,
            version: "1",
            commit: "c",
            state: Some(&state),
            not_repeatable: None,
        };
        self.batch(&[Item::Start(start)]);
    }

    /// A frame of one car, and then a list.
    fn step(&mut self, sequence: u64) {
        let ms = i64::try_from(sequence).unwrap() * 100;
        let agent = AgentId::new("ego").unwrap();
        let mut frame = DetectionFrame::empty(FrameId { agent, epoch: 1, sequence }, at(ms));
        let json = format!(
            r#"{{"captured_at":{},"sequence":{sequence},"epoch":1,"detections":[{{"class":"car","x":{},"y":2}}]}}"#,
            frame.captured_at.as_micros(),
            sequence
        );
        frame.detections.clear();
        let calls = [
            Call::Frame { agent, received_at: at(ms + 20), body: Body::Json(json.as_bytes()) },
            Call::Fused { now: at(ms + 30) },
        ];
        for call in &calls {
            let mut payload = Vec::new();
            if let Some(list) = self.core.repeat(call) {
                let hub = list.hub;
                encode_list(list, &mut payload).unwrap();
                self.push(keys().fused(&hub), payload);
            }
        }
        self.batch(&calls.map(Item::Call));
    }
}

fn retrack(entries: &[Entry]) -> Journalled {
    let mut retracker = Retracker::default();
    entries.iter().for_each(|entry| retracker.handle(entry).unwrap());
    retracker.end().into_values().next().unwrap()
}

fn is_journal(entry: &Entry) -> bool {
    matches!(Topic::of(&entry.key), Some(Topic::Journal(_)))
}

/// Five steps, a start, and ten steps.
fn joined_in_the_middle() -> Vec<Entry> {
    let mut hub = Hub::new();
    (0..5).for_each(|sequence| hub.step(sequence));
    // A recorder that joins now gets no earlier batch.
    hub.entries.retain(|entry| !is_journal(entry));
    hub.start();
    (5..15).for_each(|sequence| hub.step(sequence));
    hub.entries
}

#[test]
fn a_hub_that_was_joined_in_the_middle_is_computed_again_to_the_same_bits() {
    let found = retrack(&joined_in_the_middle());
    assert_eq!((found.identical, found.different), (10, None));
    assert_eq!((found.not_journalled, found.not_recorded, found.calls), (5, 0, 20));
}

#[test]
fn lists_may_arrive_after_their_journal() {
    let mut entries = joined_in_the_middle();
    entries.sort_by_key(|entry| !is_journal(entry));
    assert_eq!(retrack(&entries).identical, 10);
}

#[test]
fn the_first_list_that_differs_is_named_by_its_number_and_value() {
    let mut entries = joined_in_the_middle();
    let lists: Vec<_> = (0..entries.len()).filter(|place| !is_journal(&entries[*place])).collect();
    for place in [lists[8], lists[11]] {
        let mut frame = wire::fused::decode(&entries[place].payload).unwrap();
        frame.objects[0].bev.x += 0.5;
        entries[place].payload.clear();
        wire::fused::encode(&frame, &mut entries[place].payload).unwrap();
    }
    let found = retrack(&entries);
    let difference = found.different.unwrap().to_string();
    assert!(difference.starts_with("list 8: x of object "), "{difference}");
    assert_eq!(found.identical, 8);
}

#[test]
fn a_missing_batch_is_a_gap_until_the_next_start() {
    let mut hub = Hub::new();
    hub.start();
    (0..5).for_each(|sequence| hub.step(sequence));
    let lost = hub.entries.iter().rposition(is_journal).unwrap();
    hub.entries.remove(lost);
    hub.step(5);
    hub.start();
    hub.step(6);
    let found = retrack(&hub.entries);
    assert_eq!((found.gaps, found.identical, found.not_journalled), (1, 5, 2), "{found:?}");
    assert_eq!(found.different, None);
}

#[test]
fn a_start_of_another_build_is_unusable_and_says_so() {
    let mut hub = Hub::new();
    hub.batch(&[Item::Start(Start {
        settings: &serde_json::to_string(&HubSettings::default()).unwrap(),
        version: "9",
        commit: "f",
        state: Some(&[1, 2, 3]),
        not_repeatable: None,
    })]);
    hub.step(0);
    let found = retrack(&hub.entries);
    assert_eq!((found.identical, found.calls), (0, 0));
    assert!(found.unusable.unwrap().contains("another build"));
}
