//! The consumer's loop.

use super::WatchArgs;
use super::browser;
use super::lines::plain;
use super::lists::Lists;
use super::screen::{self, Screen};
use super::statuses::Statuses;
use super::view::{Action, View};
use crate::foxglove;
use crate::output::{self, Output};
use crate::record::{self, Counts};
use anyhow::{Context, bail};
use std::time::Duration;
use tokio::time::MissedTickBehavior;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::net::events;
use v2x_common::recording::Entry;
use v2x_common::wire;
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};

/// Samples that may wait: plain lines show only the newest one, the live table the newest of each hub, a recording keeps all.
const LINES_CAPACITY: usize = 1;
const VIEW_CAPACITY: usize = 64;
const STREAM_CAPACITY: usize = 1 << 16;
/// Time between two tables in a terminal, and elsewhere.
const REDRAW: Duration = Duration::from_millis(200);
const REPRINT: Duration = Duration::from_secs(1);
/// Time without a fused frame after which a warning is printed; a hub publishes ten times a second.
const SILENCE: Duration = Duration::from_secs(3);
/// Time between two progress events.
const PROGRESS: Duration = Duration::from_secs(1);

/// Watches until shutdown, or until `--count` frames have come.
pub(crate) async fn run(args: &WatchArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    if let Some(address) = args.web.web {
        return browser::show(args, address, shutdown).await;
    }
    if let Some(address) = args.foxglove.foxglove {
        return foxglove::serve(address, &args.session_options(), (args.network, args.hub), shutdown).await;
    }
    let traffic = args.traffic();
    if let Some(recording) = args.recording() {
        return record::record(&recording, traffic, shutdown).await;
    }
    let is_table = !args.json;
    let is_whole = matches!(traffic, Traffic::Fused | Traffic::Lagged);
    let is_live = is_table && screen::is_possible();
    let capacity = match (is_table && is_whole, is_live) {
        (true, true) => VIEW_CAPACITY,
        (true, false) => LINES_CAPACITY,
        (false, _) => STREAM_CAPACITY,
    };
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let options = args.session_options();
    let subscription = Subscription { network: args.network, traffic, hub: args.hub, capacity };
    let connected = Consumer::connect(&options, subscription, timeout, shutdown);
    let Some(consumer) = connected.await.context("start a hub with `v2x up crossing`, or give --connect")?
    else {
        return Ok(());
    };
    if args.events {
        events::emit("ready", &serde_json::json!({}));
    }
    let mut watch = Watch { args, counts: Counts::default(), lists: Lists::default() };
    let watched = if is_live {
        watch.show_live(&consumer, shutdown).await
    } else if is_table {
        watch.print_tables(&consumer, shutdown).await
    } else {
        watch.follow(&consumer, shutdown).await
    };
    if args.events {
        events::emit("stopped", &watch.counts.to_json(if is_table { 0 } else { consumer.dropped() }));
    }
    consumer.close().await?;
    watched
}

struct Watch<'a> {
    args: &'a WatchArgs,
    counts: Counts,
    lists: Lists,
}

impl Watch<'_> {
    /// The setting that the hub needs for what is watched.
    const fn setting_needed(&self) -> &'static str {
        match (self.args.lagged, self.args.tile) {
            (true, _) => " with the setting `lagged`",
            (_, Some(_)) => " with the setting `tiles` and objects there",
            _ => "",
        }
    }

    fn is_done(&self) -> bool {
        self.args.count.is_some_and(|count| self.counts.fused_frames >= count)
    }

    /// The live table, until a key ends it.
    async fn show_live(&mut self, consumer: &Consumer, shutdown: &CancellationToken) -> anyhow::Result<()> {
        self.wait_for_a_frame(consumer, shutdown).await?;
        if shutdown.is_cancelled() {
            return Ok(());
        }
        let mut statuses = Statuses::ask(consumer, self.args.network, self.args.hub);
        let mut view = View::new(self.args.sort);
        let mut screen = Screen::open()?;
        let mut pace = tokio::time::interval(REDRAW);
        pace.set_missed_tick_behavior(MissedTickBehavior::Delay);
        while !self.is_done() {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                action = screen.next() => {
                    match action {
                        Action::Quit => break,
                        Action::Redraw => screen.clear()?,
                        action => view.act(action, clock::now()),
                    }
                    screen.draw(&mut view)?;
                }
                answers = statuses.next() => view.take_statuses(answers, clock::now()),
                _ = pace.tick() => screen.draw(&mut view)?,
                entry = consumer.next() => if let Some(frame) = self.list_after(&entry) {
                    view.take_frame(frame, clock::now());
                },
            }
        }
        Ok(())
    }

    /// Tables as plain lines.
    async fn print_tables(
        &mut self,
        consumer: &Consumer,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        self.wait_for_a_frame(consumer, shutdown).await?;
        let mut statuses = Statuses::ask(consumer, self.args.network, self.args.hub);
        let mut view = View::new(self.args.sort);
        let mut pace = tokio::time::interval(REPRINT);
        while !self.is_done() {
            let entry = tokio::select! {
                () = shutdown.cancelled() => return Ok(()),
                entry = consumer.next() => entry,
                () = tokio::time::sleep(SILENCE) => {
                    tracing::warn!("no fused frame for {SILENCE:?}; is the hub still there?");
                    continue;
                }
            };
            let mut frame = self.list_after(&entry);
            // Of the whole list only the newest sample waits; of parts every one counts.
            while !self.is_done()
                && let Some(entry) = consumer.try_next()
            {
                frame = self.list_after(&entry).or(frame);
            }
            let Some(frame) = frame else { continue };
            let (now, hub) = (clock::now(), frame.hub);
            view.take_frame(frame, now);
            view.show(hub);
            if let Some(answers) = statuses.try_next() {
                view.take_statuses(answers, now);
            }
            if output::print(&plain(&mut view, screen::width(), now))? == Output::Closed {
                return Ok(());
            }
            pace.tick().await;
        }
        Ok(())
    }

    /// The list after a sample; `None` where it gives none.
    fn list_after(&mut self, entry: &Entry) -> Option<FusedFrame> {
        if !self.counts.add(entry) {
            return None;
        }
        let followed = self.lists.handle(entry).inspect_err(|error| {
            self.counts.unreadable += 1;
            tracing::warn!(key = entry.key, %error, "unreadable fused frame");
        });
        followed.ok().flatten()
    }

    /// Waits for the first fused frame for the time of `--wait`: from a router without a hub, or for a wrong
    /// network name, no frame ever comes.
    async fn wait_for_a_frame(
        &self,
        consumer: &Consumer,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let timeout = Duration::try_from_secs_f64(self.args.wait)?;
        tokio::select! {
            () = consumer.wait() => Ok(()),
            () = shutdown.cancelled() => Ok(()),
            () = tokio::time::sleep(timeout) => bail!(
                "no fused frame of network {} came within {timeout:.0?}; is --network right, and does {} run{}?",
                self.args.network,
                self.args.hub.map_or_else(|| "a hub".to_owned(), |hub| format!("the hub {hub}")),
                self.setting_needed()
            ),
        }
    }

    /// Prints every list as a line of JSON.
    async fn follow(&mut self, consumer: &Consumer, shutdown: &CancellationToken) -> anyhow::Result<()> {
        self.wait_for_a_frame(consumer, shutdown).await?;
        let mut progress = tokio::time::interval(PROGRESS);
        while !self.is_done() {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                entry = consumer.next() => if self.take(&entry)? == Output::Closed {
                    return Ok(());
                },
                _ = progress.tick() => if self.args.events {
                    events::emit("progress", &self.counts.to_json(consumer.dropped()));
                },
            }
        }
        while !self.is_done()
            && let Some(entry) = consumer.try_next()
        {
            self.take(&entry)?;
        }
        Ok(())
    }

    /// Prints the list after a sample; returns whether standard output still has a reader.
    fn take(&mut self, entry: &Entry) -> anyhow::Result<Output> {
        let Some(frame) = self.list_after(entry) else { return Ok(Output::Open) };
        self.counts.objects = frame.objects.len();
        let mut line = wire::json::encode_fused(&frame)?;
        line.push(b'\n');
        output::print(&String::from_utf8(line)?)
    }
}
