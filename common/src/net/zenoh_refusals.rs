//! What Zenoh refuses at a hub: handshakes, and messages that the access control denies.
//!
//! Zenoh only logs it: a layer of `tracing` reads these logs, whatever is printed of them, and counts. The texts are Zenoh's:
//! `deploy/it/certs` fails where a new version has others.

use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// Where Zenoh says that a handshake has failed.
const HANDSHAKES: &str = "zenoh_link_tls::unicast";
/// Where it says that a message does not go on.
const INTERCEPTED: &str = "zenoh::net::routing::interceptor";
/// Where it says, before that, who was denied what.
const ACCESS_CONTROL: &str = "zenoh::net::routing::interceptor::access_control";

/// Kinds of denied messages that are counted apart, and sessions whose names are known, at most.
const MAX_KINDS: usize = 64;
/// Of them of one session's name.
const MAX_KINDS_OF_ONE: usize = 8;
const MAX_SESSIONS: usize = 1024;
/// Longest key that is kept, bytes.
const MAX_KEY: usize = 160;

/// What Zenoh has refused since this process started.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ZenohRefusals {
    /// TLS handshakes, by cause.
    pub handshakes: BTreeMap<String, u64>,
    /// Messages that the access control denied.
    pub messages: u64,
    /// Of these at most 64 kinds, who wanted what, of one name at most 8: those that matter most, and of them the newest.
    pub denied: Vec<Denied>,
}

/// Denied messages of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Denied {
    /// Common name of the certificate, or what else Zenoh knows of the session.
    pub who: String,
    /// What it wanted, such as `Put`.
    pub action: String,
    /// On which key.
    pub key: String,
    /// How often.
    pub count: u64,
}

impl ZenohRefusals {
    /// All refused handshakes.
    pub fn handshakes_total(&self) -> u64 {
        self.handshakes.values().sum()
    }

    /// One line of text; `None` where nothing was refused.
    pub fn in_words(&self) -> Option<String> {
        let mut parts = Vec::new();
        if self.handshakes_total() > 0 {
            let causes: Vec<_> =
                self.handshakes.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
            parts.push(format!("TLS handshakes refused: {}", causes.join(", ")));
        }
        if self.messages > 0 {
            parts.push(format!("messages denied by the access control: {}", self.messages));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

impl Denied {
    fn is_same(&self, other: &Self) -> bool {
        (&self.who, &self.action, &self.key) == (&other.who, &other.action, &other.key)
    }

    /// What would have been taken in as somebody's is worth more than what would have been sent, and that more than what would
    /// have been read.
    fn weight(&self) -> u8 {
        let is_of_somebody = || ["/agent/", "/hub/"].iter().any(|role| self.key.contains(role));
        match self.action.as_str() {
            "Put" if is_of_somebody() => 3,
            "Put" => 2,
            "Delete" | "Reply" | "Liveliness Token" => 1,
            _ => 0,
        }
    }
}

impl ZenohRefusals {
    /// Counts a denied message. Where there is no room for another kind, the one that matters least gives way, if it matters
    /// no more: nobody fills the list with what is harmless, and none fills it for others.
    fn note(&mut self, denied: Denied) {
        self.messages += 1;
        if let Some(kind) = self.denied.iter_mut().find(|kind| kind.is_same(&denied)) {
            kind.count += 1;
            return;
        }
        let of_same = |kind: &Denied| kind.who == denied.who;
        let is_full_of_same = self.denied.iter().filter(|kind| of_same(kind)).count() >= MAX_KINDS_OF_ONE;
        if is_full_of_same || self.denied.len() >= MAX_KINDS {
            let mine = self.denied.iter().enumerate().filter(|(_, kind)| !is_full_of_same || of_same(kind));
            // The first of several: the oldest.
            let least = mine.min_by_key(|(_, kind)| kind.weight());
            let Some((place, _)) = least.filter(|(_, kind)| kind.weight() <= denied.weight()) else { return };
            self.denied.remove(place);
        }
        self.denied.push(denied);
    }
}

#[derive(Debug, Default)]
struct State {
    refusals: ZenohRefusals,
    /// Names of sessions by Zenoh's id.
    names: BTreeMap<String, String>,
}

static STATE: Mutex<Option<State>> = Mutex::new(None);

fn with_state<T>(change: impl FnOnce(&mut State) -> T) -> T {
    // The counts are consistent between any two statements: a poisoned lock is safe to use.
    let mut state: MutexGuard<'_, Option<State>> = STATE.lock().unwrap_or_else(PoisonError::into_inner);
    change(state.get_or_insert_default())
}

/// What was refused since this process started, where [`super::logging::init`] was called.
pub fn zenoh_refusals() -> ZenohRefusals {
    with_state(|state| state.refusals.clone())
}

/// The layer that counts.
pub(super) fn layer<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
    let targets = Targets::new()
        .with_target(HANDSHAKES, LevelFilter::WARN)
        .with_target(INTERCEPTED, LevelFilter::TRACE);
    Counting.with_filter(targets)
}

struct Counting;

impl<S: Subscriber> Layer<S> for Counting {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        match event.metadata().target() {
            HANDSHAKES => note_handshake(&Message::of(event).0),
            ACCESS_CONTROL => note_decision(&Message::of(event).0),
            INTERCEPTED => note_intercepted(&Message::of(event).0),
            _ => {}
        }
    }
}

/// The text of an event.
#[derive(Default)]
struct Message(String);

impl Message {
    fn of(event: &Event<'_>) -> Self {
        let mut message = Self::default();
        event.record(&mut message);
        message
    }
}

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            // Writing to a string does not fail.
            let _ = write!(self.0, "{value:?}");
        }
    }
}

fn note_handshake(message: &str) {
    // Zenoh adds it to every failure to accept.
    let Some((error, _)) = message.split_once(". Hint: ") else { return };
    let cause = cause_of(error);
    with_state(|state| *state.refusals.handshakes.entry(cause.to_owned()).or_default() += 1);
}

/// The cause in a word or two; the texts are rustls's.
fn cause_of(error: &str) -> &'static str {
    const CAUSES: [(&str, &str); 9] = [
        ("peer sent no certificates", "no certificate"),
        ("UnknownIssuer", "wrong authority"),
        ("BadSignature", "wrong authority"),
        ("certificate expired", "expired"),
        ("Expired", "expired"),
        ("not valid yet", "not valid yet"),
        ("received fatal alert", "refused by the client"),
        ("corrupt message", "no TLS"),
        ("Timeout", "no answer"),
    ];
    CAUSES.iter().find(|(text, _)| error.contains(text)).map_or("other", |(_, cause)| *cause)
}

/// Who was denied what.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Denial<'a> {
    session: &'a str,
    /// Where the message holds it.
    name: Option<&'a str>,
    action: &'a str,
    key: &'a str,
}

impl<'a> Denial<'a> {
    /// Of `{session} on {name} is unauthorized to {action} on {key}`; ` on {name}` is missing where Zenoh remembers a
    /// decision.
    fn read(message: &'a str) -> Option<Self> {
        let message = message.strip_prefix("Using cached result: ").unwrap_or(message);
        let (who, what) = message.split_once(" is unauthorized to ")?;
        // A key may hold anything, an action holds no " on ".
        let (action, key) = what.split_once(" on ")?;
        let (session, name) = match who.split_once(" on ") {
            Some((session, names)) => (session, Some(common_name(names))),
            None => (who, None),
        };
        Some(Self { session, name, action, key })
    }
}

/// Zenoh joins all that it knows of a session by `+`, such as
/// `Interface(lo)+CertCommonName(agent:ego)+Transport(Tls)+a1b2`.
fn common_name(names: &str) -> &str {
    let of_certificate = names.split_once("CertCommonName(").and_then(|(_, rest)| rest.split_once(')'));
    of_certificate.map_or(names, |(name, _)| name)
}

/// A text of a peer for logs and terminals: without control characters, and not long.
pub(super) fn printable(text: &str) -> String {
    let shown = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    text.chars().take(MAX_KEY).map(shown).collect()
}

thread_local! {
    /// The newest denial on this thread: session, action and key. The message that it concerns is stopped on the same one.
    static NEWEST: RefCell<Option<(String, String, String)>> = const { RefCell::new(None) };
}

fn note_decision(message: &str) {
    let Some(denial) = Denial::read(message) else {
        // Allowed, perhaps by another rule than the one before.
        return NEWEST.with_borrow_mut(|newest| *newest = None);
    };
    if let Some(name) = denial.name {
        with_state(|state| {
            // Clients choose their ids: the newest certificate counts.
            if state.names.len() >= MAX_SESSIONS && !state.names.contains_key(denial.session) {
                state.names.pop_first();
            }
            state.names.insert(denial.session.to_owned(), printable(name));
        });
    }
    // What the hub does not send to a client that may not receive it is no refusal.
    let newest = denial
        .action
        .strip_suffix(" (ingress)")
        .map(|action| (denial.session.to_owned(), action.to_owned(), printable(denial.key)));
    NEWEST.with_borrow_mut(|place| *place = newest);
}

fn note_intercepted(message: &str) {
    if message != "Msg intercepted!" {
        return;
    }
    let Some((session, action, key)) = NEWEST.take() else { return };
    with_state(|State { refusals, names }| {
        let who = names.get(&session).map_or(session.as_str(), String::as_str);
        refusals.note(Denied { who: who.to_owned(), action, key, count: 1 });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_acl_denial_is_read_with_and_without_the_name_of_the_session() {
        let message = concat!(
            "a1b2 on Interface(lo)+CertCommonName(agent:ego)+Transport(Tls)+a1b2",
            " is unauthorized to Put (ingress) on v2x/demo/agent/rsu/detections"
        );
        let denial = Denial::read(message).unwrap();
        assert_eq!((denial.session, denial.name), ("a1b2", Some("agent:ego")));
        assert_eq!((denial.action, denial.key), ("Put (ingress)", "v2x/demo/agent/rsu/detections"));
        let message = "Using cached result: a1b2 is unauthorized to Declare Subscriber (ingress) on v2x/**";
        let denial = Denial::read(message).unwrap();
        assert_eq!((denial.session, denial.name), ("a1b2", None));
        assert_eq!((denial.action, denial.key), ("Declare Subscriber (ingress)", "v2x/**"));
        assert_eq!(Denial::read("a1b2 on lo is authorized to Put (ingress) on v2x/a"), None);
        let denial = Denial::read("a1b2 is unauthorized to Put (ingress) on v2x/a on b/c").unwrap();
        assert_eq!((denial.action, denial.key), ("Put (ingress)", "v2x/a on b/c"));
    }

    #[test]
    fn a_flood_by_one_peer_fills_no_list_and_what_it_writes_reaches_no_terminal_as_it_is() {
        assert_eq!(printable("v2x/\u{1b}[2J\n/x"), "v2x/\u{fffd}[2J\u{fffd}/x");
        for k in 0..1000 {
            note_decision(&format!(
                "77 on CertCommonName(agent:flood)+77 is unauthorized to Put (ingress) on v2x/{k}"
            ));
            note_intercepted("Msg intercepted!");
        }
        let refusals = zenoh_refusals();
        let of_flood = refusals.denied.iter().filter(|kind| kind.who == "agent:flood");
        assert_eq!(of_flood.count(), MAX_KINDS_OF_ONE);
    }

    #[test]
    fn what_is_harmless_hides_no_spoof_of_another_agent_from_the_acls_findings() {
        let kind = |action: &str, key: &str| Denied {
            who: "agent:eve".to_owned(),
            action: action.to_owned(),
            key: key.to_owned(),
            count: 1,
        };
        let spoof = kind("Put", "v2x/demo/agent/ego/detections");
        let mut refusals = ZenohRefusals::default();
        (0..8).for_each(|k| refusals.note(kind("Declare Subscriber", &format!("v2x/{k}"))));
        refusals.note(spoof.clone());
        for k in 0..100 {
            refusals.note(kind("Declare Subscriber", &format!("v2x/more/{k}")));
            refusals.note(kind("Put", &format!("elsewhere/{k}")));
        }
        refusals.note(spoof.clone());
        let found = refusals.denied.iter().find(|kind| kind.is_same(&spoof));
        assert_eq!(found.map(|kind| kind.count), Some(2), "{:?}", refusals.denied);
        assert_eq!((refusals.denied.len(), refusals.messages), (MAX_KINDS_OF_ONE, 210));
        // Of what matters as much the newest is kept.
        (0..20).for_each(|k| refusals.note(kind("Put", &format!("v2x/demo/agent/a{k}/detections"))));
        assert!(refusals.denied.last().is_some_and(|kind| kind.key.contains("/a19/")));
    }

    #[test]
    fn a_message_that_the_acl_denies_is_counted_with_its_name_when_it_is_stopped() {
        let on = "v2x/t/agent/rsu/detections";
        let who = "9c on Interface(lo)+CertCommonName(agent:eve)+Transport(Tls)+9c";
        note_decision(&format!("{who} is unauthorized to Put (ingress) on {on}"));
        for _ in 0..2 {
            note_decision(&format!("Using cached result: 9c is unauthorized to Put (ingress) on {on}"));
            note_intercepted("Msg intercepted!");
        }
        // The hub's own declarations that a client may not know.
        note_decision(&format!("{who} is unauthorized to Declare Queryable (egress) on v2x/t/hub/h/status"));
        note_intercepted("Msg intercepted!");
        let refusals = zenoh_refusals();
        let of_eve: Vec<_> = refusals.denied.iter().filter(|kind| kind.who == "agent:eve").collect();
        assert_eq!(of_eve.len(), 1);
        assert_eq!((of_eve[0].action.as_str(), of_eve[0].key.as_str(), of_eve[0].count), ("Put", on, 2));
    }

    #[test]
    fn the_cause_of_a_tls_handshake_is_a_word_or_two() {
        for (error, cause) in [
            ("peer sent no certificates", "no certificate"),
            ("invalid peer certificate: UnknownIssuer", "wrong authority"),
            ("invalid peer certificate: certificate expired: verification time 1 (UNIX)", "expired"),
            ("received fatal alert: UnknownCA", "refused by the client"),
            ("received corrupt message of type InvalidContentType", "no TLS"),
            ("Too many open files (os error 24)", "other"),
        ] {
            assert_eq!(cause_of(error), cause, "{error}");
        }
    }
}
