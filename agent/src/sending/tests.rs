use super::*;
use crate::scenario::Scenario;
use std::collections::BTreeMap;
use std::sync::Arc;
use v2x_common::id::AgentId;

const CROSSING: &str = include_str!("../../../deploy/scenarios/crossing.toml");
const LINK: &str = "link = { delay_ms = 80, jitter_ms = 30, loss = 0.01 }\n";
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);

/// The agents `ego` and `rsu` with these lines instead of their links.
fn agent(id: &str, lines: &str, seed: u64) -> Sender {
    sender_of(&CROSSING.replace(LINK, &format!("{lines}\n")), id, seed)
}

fn sender_of(text: &str, id: &str, seed: u64) -> Sender {
    let scenario = Scenario::from_toml(text).unwrap();
    let index = scenario.agent_index(&AgentId::new(id).unwrap()).unwrap();
    let boot = Boot { seed, epoch: 9, start: START };
    scenario.agents[index].sender(Arc::new(scenario.world(seed)), boot).unwrap()
}

/// From capture to arrival, ms; `None` for frames that do not arrive.
fn ages_ms(agent: &Sender, n: u64) -> Vec<Option<f64>> {
    let mut sender = agent.clone();
    let mut age = |sequence| match sender.send(sequence) {
        Fate::Arrives { at, .. } => Some((at - agent.sensor().capture_time(sequence)).as_millis_f64()),
        Fate::Lost | Fate::Withheld => None,
    };
    (0..n).map(&mut age).collect()
}

#[test]
fn delays_of_sensing_waiting_and_link_add_up() {
    let lines = "link = { delay_ms = 7 }\nsensing_ms = 60\ntransmit = { period_ms = 100, phase_ms = 30 }";
    // The unit captures 50 ms after each tenth, is ready at 110, sends at 130, and arrives at 137.
    assert!(ages_ms(&agent("rsu", lines, 1), 20).iter().all(|age| *age == Some(87.0)));
    // The vehicle captures at each tenth, is ready at 60.
    assert!(ages_ms(&agent("ego", lines, 1), 20).iter().all(|age| *age == Some(137.0)));
}

#[test]
fn sensing_and_link_have_independent_draws() {
    let sensing = "sensing_ms = \"custom:delay=60ms,jitter=10ms\"";
    let alone = ages_ms(&agent("rsu", sensing, 1), 2000);
    let with_link = ages_ms(&agent("rsu", &format!("{sensing}\n{LINK}"), 1), 2000);
    let link_alone = ages_ms(&agent("rsu", LINK, 1), 2000);
    let n = alone.iter().flatten().count() as f64;
    let mean = alone.iter().flatten().sum::<f64>() / n;
    let sigma = (alone.iter().flatten().map(|age| (age - mean) * (age - mean)).sum::<f64>() / n).sqrt();
    // Standard errors 0.22 and 0.16 ms.
    assert!((mean - 60.0).abs() < 0.9 && (sigma - 10.0).abs() < 0.7, "{mean} {sigma}");
    for ((sensing, both), link) in alone.iter().zip(&with_link).zip(&link_alone) {
        let sum = sensing.zip(*link).map(|(sensing, link)| sensing + link);
        assert_eq!(sum.is_some(), both.is_some());
        // Rounded to nanoseconds twice.
        assert!(sum.zip(*both).is_none_or(|(sum, both)| (sum - both).abs() < 1e-5));
    }
}

#[test]
fn an_outage_loses_frames_that_are_sent_in_it_not_those_captured_in_it() {
    let lines = "link = \"custom:outage=500ms,outage-every=1s\"\nsensing_ms = 500";
    // Captured in the second half of a second, sent in the first half of the next.
    let arrives: Vec<bool> = ages_ms(&agent("ego", lines, 1), 20).iter().map(|age| age.is_some()).collect();
    assert_eq!(arrives, (0..20).map(|n| n % 10 >= 5).collect::<Vec<_>>());
}

#[test]
fn random_phases_are_uniform_over_the_period_and_constant_in_a_run() {
    let lines = "transmit = { period_ms = 100, phase_ms = \"random\" }";
    let waits: Vec<f64> = (0..200)
        .map(|seed| {
            let ages = ages_ms(&agent("ego", lines, seed), 3);
            assert!(ages.iter().all(|age| *age == ages[0]), "{ages:?}");
            ages[0].unwrap()
        })
        .collect();
    let mean = waits.iter().sum::<f64>() / 200.0;
    // Standard error 2 ms.
    assert!((mean - 50.0).abs() < 8.0, "{mean}");
    assert!(waits.iter().all(|wait| (0.0..100.0).contains(wait)));
    let other = ages_ms(&agent("rsu", lines, 1), 1)[0].unwrap() + 50.0;
    assert!((other.rem_euclid(100.0) - waits[1]).abs() > 1e-6, "agents have phases of their own");
}

#[test]
fn without_rules_frames_are_sent_complete() {
    let mut sender = agent("ego", "", 1);
    for sequence in 0..20 {
        let at = sender.sensor().capture_time(sequence);
        let observation = sender.sensor().observe(sequence);
        assert_eq!(sender.send(sequence), Fate::Arrives { at, observation });
    }
}

/// What an agent without clutter and misses sends by ETSI's rules in a minute, by number.
fn sent_by_rule(id: &str) -> (Sensor, BTreeMap<u64, Observation>) {
    let text = CROSSING.replace("clutter_per_frame = 0.5", "clutter_per_frame = 0");
    let text = text.replace("detection_probability = 0.95", "detection_probability = 1");
    let mut sender = sender_of(&text.replace(LINK, "send = \"etsi\"\n"), id, 1);
    let mut sent = BTreeMap::new();
    for sequence in 0..600 {
        if let Fate::Arrives { observation, .. } = sender.send(sequence) {
            sent.insert(sequence, observation);
        }
    }
    (sender.sensor().clone(), sent)
}

#[test]
fn by_the_etsi_rules_every_object_in_view_is_sent_each_second_and_most_detections_are_left_out() {
    for id in ["ego", "rsu"] {
        let (sensor, sent) = sent_by_rule(id);
        let (mut newest, mut n_all, mut n_sent) = (BTreeMap::new(), 0, 0);
        for sequence in 0..600 {
            let whole = sensor.observe(sequence);
            let included = sent.get(&sequence).map_or(&[][..], |observation| &observation.identities.objects);
            for object in &whole.identities.objects {
                n_all += 1;
                n_sent += usize::from(included.contains(object));
                let since = if included.contains(object) { sequence } else { newest[object] };
                assert!(sequence - since < 10, "{object:?} of {id} is silent since {since} at {sequence}");
                newest.insert(*object, since);
            }
        }
        let share = n_sent as f64 / f64::from(n_all);
        assert!((0.1..0.5).contains(&share), "{share} of the detections are sent");
    }
}

#[test]
fn by_the_etsi_rules_the_detections_that_are_sent_keep_their_identities() {
    let (sensor, sent) = sent_by_rule("rsu");
    for (sequence, observation) in sent {
        let whole = sensor.observe(sequence);
        assert_eq!(observation.frame.detections.len(), observation.identities.objects.len());
        for (object, detection) in observation.identities.objects.iter().zip(&observation.frame.detections) {
            let place = whole.identities.objects.iter().position(|one| one == object).unwrap();
            assert_eq!(*detection, whole.frame.detections[place]);
        }
    }
}

#[test]
fn by_the_etsi_rules_an_agent_declares_the_share_of_frames_that_the_rules_guarantee() {
    let probability = |lines: &str| agent("rsu", lines, 1).description().detection_probability;
    assert_eq!(probability(""), 0.95);
    assert!((probability("send = \"etsi\"") - 0.095).abs() < 1e-12);
    let slow = CROSSING.replace("rate_hz = 10", "rate_hz = 0.5").replace(LINK, "send = \"etsi\"\n");
    let slow = sender_of(&slow, "rsu", 1);
    assert_eq!(slow.description().detection_probability, 0.95);
}
