//! All browsers that show the page.

use super::mailbox::{Events, MAX_STREAMS, Mailbox, Stream};
use hyper::body::Bytes;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Sends each message to every browser.
#[derive(Debug, Default)]
pub(super) struct Browsers(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    mailboxes: Vec<Weak<Mailbox>>,
    /// What a browser that comes later is sent first.
    newest: BTreeMap<Stream, Bytes>,
    is_closed: bool,
}

impl Browsers {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is consistent between any two statements: a poisoned lock is safe to use.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The stream of events of another browser.
    pub(super) fn join(&self) -> Events {
        let mailbox = Arc::new(Mailbox::default());
        let mut state = self.lock();
        for (stream, event) in &state.newest {
            mailbox.put(*stream, event.clone());
        }
        if state.is_closed {
            mailbox.close();
        }
        state.mailboxes.push(Arc::downgrade(&mailbox));
        Events(mailbox)
    }

    /// Whether no browser is connected: then no frame needs to be written.
    pub(super) fn is_empty(&self) -> bool {
        let mut state = self.lock();
        state.mailboxes.retain(|mailbox| mailbox.strong_count() > 0);
        state.mailboxes.is_empty()
    }

    /// Sends a message, which is JSON in one line.
    pub(super) fn send(&self, stream: Stream, json: &str) {
        let event = Bytes::from(format!("data: {json}\n\n"));
        let mut state = self.lock();
        if stream.is_state() && (state.newest.len() < MAX_STREAMS || state.newest.contains_key(&stream)) {
            state.newest.insert(stream, event.clone());
        }
        state
            .mailboxes
            .iter()
            .filter_map(Weak::upgrade)
            .for_each(|mailbox| mailbox.put(stream, event.clone()));
    }

    /// Ends all streams of events, also of browsers that come later.
    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        state.mailboxes.iter().filter_map(Weak::upgrade).for_each(|mailbox| mailbox.close());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::body::Body;
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    fn next(events: &mut Events) -> Option<String> {
        match Pin::new(events).poll_frame(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(Some(Ok(frame))) => {
                Some(String::from_utf8(frame.into_data().unwrap().to_vec()).unwrap())
            }
            _ => None,
        }
    }

    #[test]
    fn a_later_browser_gets_the_state_and_no_old_frames() {
        let browsers = Browsers::default();
        let hub = v2x_common::id::HubId::new("hub").unwrap();
        browsers.send(Stream::Hello, "1");
        browsers.send(Stream::Fused(hub), "2");
        let mut events = browsers.join();
        browsers.send(Stream::Fused(hub), "3");
        let taken: Vec<_> = std::iter::from_fn(|| next(&mut events)).collect();
        assert_eq!(taken, ["data: 1\n\n", "data: 3\n\n"]);
    }

    #[test]
    fn a_browser_that_left_is_forgotten() {
        let browsers = Browsers::default();
        let events = browsers.join();
        assert!(!browsers.is_empty());
        drop(events);
        assert!(browsers.is_empty());
    }
}
