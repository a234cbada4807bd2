//! Whose message a thread of Zenoh works on, and who declares keys that are none.
//!
//! Zenoh says it in spans and events of `tracing`, and nowhere else: that is all by which a panic in its code can be laid to somebody's
//! door. Names and texts are Zenoh's: `deploy/it/by_hand.rs` fails where a new version has others.

use super::zenoh_peers::{self, Peer};
use super::{zenoh_breakers, zenoh_refusals};
use std::cell::RefCell;
use std::fmt::{self, Write};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing::{Event, Metadata, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;
use zenoh::key_expr::KeyExpr;

/// Where Zenoh handles the messages of a session, in a span that says whose they are.
const HANDLES: &str = "zenoh::net::primitives::demux";
/// Where it takes a key into its tables.
const REGISTERS: &str = "zenoh::net::routing::dispatcher::resource";
const REGISTERED: &str = "Register resource ";
/// Where it says that all places for sessions are taken.
const ADMITS: &str = "zenoh_transport::unicast::manager";
const IS_FULL: &str = "Max transports reached";

/// Longer keys have no room in Zenoh's messages, bytes.
const MAX_KEY: usize = u16::MAX as usize;

thread_local! {
    /// Of whom Zenoh handles a message on this thread; empty where it handles none.
    static SPEAKS: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Whose message this thread works on, as far as that is known.
pub(super) fn speaking() -> Option<Peer> {
    let short =
        SPEAKS.try_with(|speaks| speaks.try_borrow().ok().and_then(|src| session_of(&src))).ok()??;
    zenoh_peers::of_session(&short)
}

/// The short id of the session in `south:0:client/1a2b3c4d:7`, which is region, session and number of a face.
fn session_of(src: &str) -> Option<String> {
    let (_, of_session) = src.rsplit_once('/')?;
    Some(of_session.split_once(':')?.0.to_owned())
}

/// Whether Zenoh's code can handle what has this key.
fn is_sound(key: &str) -> bool {
    key.len() <= MAX_KEY && KeyExpr::new(key).is_ok()
}

/// The layer that reads it.
pub(super) fn layer<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
    let is_read = |metadata: &Metadata<'_>| match metadata.target() {
        // Zenoh asks first whether such a span would be read, by what is neither a span nor an event.
        HANDLES => !metadata.is_event(),
        REGISTERS | ADMITS => metadata.is_event(),
        _ => false,
    };
    Listening.with_filter(filter_fn(is_read).with_max_level_hint(LevelFilter::TRACE))
}

struct Listening;

impl<S: Subscriber> Layer<S> for Listening {
    fn on_new_span(&self, attributes: &Attributes<'_>, _: &Id, _: Context<'_, S>) {
        // It is entered where it is made.
        SPEAKS.with_borrow_mut(|speaks| {
            speaks.clear();
            attributes.record(&mut Text { field: "src", of: speaks });
        });
    }

    fn on_exit(&self, _: &Id, _: Context<'_, S>) {
        SPEAKS.with_borrow_mut(String::clear);
    }

    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = String::new();
        event.record(&mut Text { field: "message", of: &mut message });
        if event.metadata().target() == ADMITS {
            if message.starts_with(IS_FULL) {
                zenoh_peers::note_refused();
            }
        } else if let Some(key) = message.strip_prefix(REGISTERED)
            && !is_sound(key)
        {
            zenoh_breakers::note_declared(speaking(), &zenoh_refusals::printable(key));
        }
    }
}

/// Keeps the text of one field.
struct Text<'a> {
    field: &'static str,
    of: &'a mut String,
}

impl Visit for Text<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == self.field {
            // Writing to a string does not fail.
            let _ = write!(self.of, "{value:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_session_whose_message_is_a_fault_of_zenohs_code_is_read_from_its_span() {
        assert_eq!(session_of("south:0:client/1a2b3c4d:7").as_deref(), Some("1a2b3c4d"));
        assert_eq!(session_of("north/7:12").as_deref(), Some("7"));
        assert_eq!(session_of("nothing"), None);
    }

    #[test]
    fn keys_by_which_zenohs_code_has_a_fault_are_distinguished_from_those_of_its_clients() {
        for key in ["v2x/demo/agent/ego/detections", "v2x/**", "v2x/$*a/*", "@/1a/router/**"] {
            assert!(is_sound(key), "{key}");
        }
        for key in ["v2x/$*", "v2x//a", "/v2x", "v2x/", "v2x/a#b", "", &"k".repeat(MAX_KEY + 1)] {
            assert!(!is_sound(key), "{}", &key[..key.len().min(20)]);
        }
    }
}
