//! What waits for one browser: of every stream the newest message only.

use hyper::body::{Body, Bytes, Frame};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use v2x_common::id::{AgentId, HubId};

/// Messages of which a newer one makes the older one useless. In the order in which they are sent: a fused frame comes
/// after the detections that it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stream {
    Hello,
    Connection,
    Presence,
    Sensor(AgentId),
    Status,
    Detections(AgentId),
    Fused(HubId),
}

impl Stream {
    /// Whether a browser that comes later needs the newest message, too.
    pub(super) const fn is_state(self) -> bool {
        !matches!(self, Self::Detections(_) | Self::Fused(_))
    }
}

/// Streams of one browser: beyond them messages are skipped.
pub(super) const MAX_STREAMS: usize = 2048;

/// One browser's messages.
#[derive(Debug, Default)]
pub(super) struct Mailbox(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    pending: BTreeMap<Stream, Bytes>,
    skipped: u64,
    skipped_said: u64,
    is_closed: bool,
    reader: Option<Waker>,
}

impl Mailbox {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is consistent between any two statements: a poisoned lock is safe to use.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a message in place of an older one of its stream.
    pub(super) fn put(&self, stream: Stream, event: Bytes) {
        let mut state = self.lock();
        if state.pending.len() >= MAX_STREAMS && !state.pending.contains_key(&stream) {
            state.skipped += 1;
            return;
        }
        if state.pending.insert(stream, event).is_some() && !stream.is_state() {
            state.skipped += 1;
        }
        state.wake();
    }

    /// Ends the stream of events.
    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        state.wake();
    }

    fn poll(&self, context: &Context<'_>) -> Poll<Option<Bytes>> {
        let mut state = self.lock();
        if state.is_closed {
            return Poll::Ready(None);
        }
        if let Some((_, event)) = state.pending.pop_first() {
            return Poll::Ready(Some(event));
        }
        if state.skipped > state.skipped_said {
            state.skipped_said = state.skipped;
            let event = format!("data: {{\"t\":\"skipped\",\"n\":{}}}\n\n", state.skipped);
            return Poll::Ready(Some(event.into()));
        }
        state.reader = Some(context.waker().clone());
        Poll::Pending
    }
}

impl State {
    fn wake(&mut self) {
        if let Some(reader) = self.reader.take() {
            reader.wake();
        }
    }
}

/// The messages as the body of a response: it takes one when the connection has room for it.
#[derive(Debug)]
pub(super) struct Events(pub(super) Arc<Mailbox>);

impl Body for Events {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        self.0.poll(context).map(|event| event.map(|event| Ok(Frame::data(event))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poll(mailbox: &Mailbox) -> Poll<Option<Bytes>> {
        mailbox.poll(&Context::from_waker(Waker::noop()))
    }

    fn text(polled: Poll<Option<Bytes>>) -> String {
        match polled {
            Poll::Ready(Some(bytes)) => String::from_utf8(bytes.to_vec()).unwrap(),
            other => format!("{other:?}"),
        }
    }

    #[test]
    fn of_each_stream_only_the_newest_waits_and_the_others_are_counted() {
        let mailbox = Mailbox::default();
        let [ego, rsu] = ["ego", "rsu"].map(|name| Stream::Detections(AgentId::new(name).unwrap()));
        for n in 0..1000 {
            mailbox.put(ego, format!("ego {n}").into());
            mailbox.put(Stream::Status, format!("status {n}").into());
        }
        mailbox.put(rsu, "rsu".into());
        let taken: Vec<_> = (0..4).map(|_| text(poll(&mailbox))).collect();
        assert_eq!(
            taken,
            ["status 999", "ego 999", "rsu", "data: {\"t\":\"skipped\",\"n\":999}\n\n"],
            "a state that was replaced is not lost"
        );
        assert!(poll(&mailbox).is_pending());
    }

    #[test]
    fn streams_beyond_the_limit_are_skipped() {
        let mailbox = Mailbox::default();
        for n in 0..2 * MAX_STREAMS {
            let agent = AgentId::new(&format!("a{n}")).unwrap();
            mailbox.put(Stream::Detections(agent), Bytes::new());
        }
        let state = mailbox.lock();
        assert_eq!((state.pending.len(), state.skipped), (MAX_STREAMS, MAX_STREAMS as u64));
    }

    #[test]
    fn a_closed_mailbox_ends_at_once() {
        let mailbox = Mailbox::default();
        mailbox.put(Stream::Status, "status".into());
        mailbox.close();
        assert!(matches!(poll(&mailbox), Poll::Ready(None)));
    }
}
