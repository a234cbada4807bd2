//! When what arrives at a hub, and what happens to it.

use super::agents::{Object, Payload, Process};
use super::dice::Dice;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

pub(super) const BEGIN: Timestamp = Timestamp::from_nanos(1_790_000_000_000_000_000);
/// How long agents send.
pub(super) const LENGTH: Span = Span::from_millis(4_000);

/// What happens to a hub.
#[derive(Clone)]
pub(super) enum Event {
    Frame(AgentId, Payload),
    Description(AgentId, Payload),
    /// Frames of an agent were dropped from its queue.
    QueueFull(AgentId, u64),
    /// Somebody set the system's clock, which is now so far off.
    ClockStep(Span),
    /// It did not run for so long: everything later waited.
    HeldUp(Span),
    /// It goes on from its saved state, in a process of its own.
    Restored,
}

pub(super) struct Schedule {
    pub(super) begin: Timestamp,
    /// In the order of arrival.
    pub(super) events: Vec<(Timestamp, Event)>,
}

/// How the link of one agent behaves.
struct Link {
    delay: Span,
    jitter_ms: f64,
    loss: f64,
    repeats: f64,
    /// Nothing passes; what was sent comes afterwards, at once.
    outage: Option<(Span, Span)>,
}

impl Link {
    fn drawn(dice: &mut Dice) -> Self {
        let begins = dice.span_ms(0.0, 3_000.0);
        Self {
            delay: dice.span_ms(0.0, 150.0),
            jitter_ms: if dice.happens(0.5) { dice.between(0.0, 400.0) } else { 0.0 },
            loss: if dice.happens(0.5) { dice.between(0.0, 0.4) } else { 0.0 },
            repeats: if dice.happens(0.3) { 0.2 } else { 0.0 },
            outage: dice.happens(0.3).then(|| (begins, begins + dice.span_ms(50.0, 2_000.0))),
        }
    }

    /// When what is sent `since` the beginning arrives: never, once, or twice.
    fn arrivals(&self, since: Span, dice: &mut Dice) -> Vec<Span> {
        let passes = match self.outage {
            Some((begins, ends)) if since >= begins && since < ends => ends,
            _ => since,
        };
        let copies = if dice.happens(self.loss) { 0 } else { 1 + usize::from(dice.happens(self.repeats)) };
        (0..copies).map(|_| passes + self.delay + dice.span_ms(0.0, self.jitter_ms + 0.001)).collect()
    }
}

/// What there is to be seen, since when.
struct Traffic {
    begin: Timestamp,
    objects: Vec<Object>,
}

impl Schedule {
    pub(super) fn drawn(begin: Timestamp, dice: &mut Dice) -> Self {
        let objects: Vec<_> = (0..2 + dice.below(8)).map(|_| Object::drawn(dice)).collect();
        let mut events = Vec::new();
        let traffic = Traffic { begin, objects };
        for name in &["ego", "rsu", "van", "cam", "bus"][..1 + dice.below(5)] {
            let agent = AgentId::new(name).expect("a legal name");
            life(agent, &traffic, &mut events, dice);
            if dice.happens(0.1) {
                // A second process of this name.
                life(agent, &traffic, &mut events, dice);
            }
        }
        of_hub(begin, &mut events, dice);
        // Stable: what arrives at one time comes in the order in which it was sent.
        events.sort_by_key(|(at, _)| *at);
        Self { begin, events }
    }
}

/// The life of one process of an agent, and perhaps of the next one.
fn life(agent: AgentId, traffic: &Traffic, events: &mut Vec<(Timestamp, Event)>, dice: &mut Dice) {
    let Traffic { begin, objects } = traffic;
    let begin = *begin;
    let link = Link::drawn(dice);
    let mut process = Process {
        agent,
        epoch: dice.number() >> dice.below(64),
        sequence: 0,
        clock_offset: if dice.happens(0.2) { dice.span_ms(-800.0, 800.0) } else { Span::ZERO },
        sigma_m: dice.between(0.05, 1.0),
        is_json: dice.happens(0.3),
    };
    let period = dice.span_ms(50.0, 200.0);
    let describes = dice.happens(0.7);
    let dies = dice.happens(0.3).then(|| dice.span_ms(300.0, 3_000.0));
    let freezes = dice.happens(0.2).then(|| dice.span_ms(300.0, 3_000.0));
    let steps = dice.happens(0.15).then(|| (dice.span_ms(300.0, 3_000.0), dice.span_ms(-3e6, 3e6)));
    let mut since = dice.span_ms(0.0, 500.0);
    let mut is_new = true;
    let mut was = Span::ZERO;
    while since < LENGTH {
        let reached = since;
        let passed = |moment: Option<Span>| moment.is_some_and(|moment| was < moment && moment <= reached);
        if passed(dies) {
            // Another process, with an epoch of its own, or, where it counts anew, with the old one.
            if dice.happens(0.7) {
                process.epoch = dice.number();
            }
            process.sequence = 0;
            is_new = true;
            since = since + dice.span_ms(0.0, 1_500.0);
        }
        if let Some((moment, by)) = steps
            && passed(Some(moment))
        {
            process.clock_offset = process.clock_offset + by;
        }
        // A frozen process captures, and sends it when it runs again.
        let thaws = if passed(freezes) { dice.span_ms(100.0, 1_800.0) } else { Span::ZERO };
        if is_new && describes {
            let arrives = begin + since + link.delay;
            events.push((arrives, Event::Description(agent, process.description(dice))));
        }
        is_new = false;
        let payload = process.frame(objects, (begin + since, since), dice);
        for arrives in link.arrivals(since + thaws, dice) {
            events.push((begin + arrives, Event::Frame(agent, payload.clone())));
        }
        was = since;
        since = since + period + thaws;
    }
    if dice.happens(0.1) {
        let count = 1 + dice.below(50) as u64;
        events.push((begin + dice.span_ms(0.0, 3_000.0), Event::QueueFull(agent, count)));
    }
}

/// What happens to the hub itself.
fn of_hub(begin: Timestamp, events: &mut Vec<(Timestamp, Event)>, dice: &mut Dice) {
    let mut add = |probability: f64, event: &dyn Fn(&mut Dice) -> Event| {
        if dice.happens(probability) {
            let at = begin + dice.span_ms(100.0, 3_500.0);
            let event = event(dice);
            events.push((at, event));
        }
    };
    add(0.15, &|dice| Event::ClockStep(dice.span_ms(-3.6e6, 3.6e6)));
    add(0.05, &|dice| Event::ClockStep(dice.span_ms(-100.0, 100.0)));
    add(0.15, &|dice| Event::HeldUp(dice.span_ms(2_000.0, 8_000.0)));
    add(0.2, &|_| Event::Restored);
}
