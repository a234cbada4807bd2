//! A consumer of the network that feeds the browsers.

use super::browsers::Browsers;
use super::mailbox::Stream;
use super::message::{Connection, Hello, Message, Presence, Status};
use super::picture::{KnownWritings, Next, Picture, send};
use super::presence::Tokens;
use super::source::Source;
use anyhow::{Context, anyhow};
use std::sync::PoisonError;
use std::time::Duration;
use tokio::sync::Notify;
use tokio::time::{Interval, MissedTickBehavior, interval};
use tokio_util::sync::CancellationToken;
use v2x_common::net::endpoint;
use v2x_common::net::session::DEFAULT_ENDPOINT;
use v2x_common::wire::Writings;
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};
use v2x_lab::loopback::hub_status;
use zenoh::Session;

/// Samples that may wait while the newest ones are translated.
const CAPACITY: usize = 1024;
/// Time between two questions for the status, and the shortest one where frames were refused.
const STATUS_EVERY: Duration = Duration::from_secs(1);
const STATUS_SOONEST: Duration = Duration::from_millis(250);
/// The page is there before a hub is, for as long as it takes: ten years.
const PATIENCE: Duration = Duration::from_secs(10 * 365 * 86_400);

/// Feeds the browsers until shutdown.
pub(super) async fn feed(
    source: &Source,
    browsers: &Browsers,
    shutdown: &CancellationToken,
) -> anyhow::Result<()> {
    let Source { session, network, hub, scene } = source;
    let (name, roads) =
        scene.as_ref().map_or((None, &[][..]), |scene| (Some(&*scene.name), &scene.roads[..]));
    send(browsers, Stream::Hello, &Message::Hello(Hello::new(*network, name, roads)));
    let endpoints = match &session.connect[..] {
        [] => vec![DEFAULT_ENDPOINT.to_owned()],
        // It is for browsers: no private keys.
        given => given.iter().map(|endpoint| endpoint::shown(endpoint).into_owned()).collect(),
    };
    let say_connected = |connected| {
        let message = Message::Connection(Connection { connected, endpoints: &endpoints });
        send(browsers, Stream::Connection, &message);
    };
    say_connected(false);
    let subscription =
        Subscription { network: *network, traffic: Traffic::Everything, hub: *hub, capacity: CAPACITY };
    let Some(consumer) = Consumer::connect(session, subscription, PATIENCE, shutdown).await? else {
        return Ok(());
    };
    say_connected(true);
    let tokens = Tokens::subscribe(consumer.session(), *network, *hub).await;
    let mut tokens =
        tokens.map_err(|error| anyhow!("{error}")).context("subscribing to liveliness tokens")?;
    let (hurry, writings) = (Notify::new(), KnownWritings::default());
    tokio::select! {
        () = shutdown.cancelled() => {}
        () = show_frames(&consumer, Picture::new(browsers, scene.as_ref(), &writings), &hurry) => {}
        () = show_presence(&mut tokens, browsers) => {}
        () = show_status((consumer.session(), source), browsers, &hurry, &writings) => {}
        followed = follow(source, consumer.session(), shutdown) => followed?,
    }
    drop(tokens);
    consumer.close().await.context("leaving the network")
}

/// Follows the world of the scene, where another program drives it.
async fn follow(source: &Source, session: &Session, shutdown: &CancellationToken) -> anyhow::Result<()> {
    match &source.scene {
        Some(scene) => scene.follow(session, source.network, shutdown).await,
        None => std::future::pending().await,
    }
}

async fn show_frames(consumer: &Consumer, mut picture: Picture<'_>, hurry: &Notify) {
    loop {
        let entry = consumer.next().await;
        match picture.handle(&entry) {
            Ok(Next::AskForStatus) => hurry.notify_one(),
            Ok(Next::Nothing) => {}
            Err(error) => tracing::debug!(key = entry.key, %error, "a sample that the view cannot read"),
        }
        // Where samples come faster than they are translated, the queue is never empty: browsers, the status and the
        // shutdown have their turn all the same.
        tokio::task::yield_now().await;
    }
}

async fn show_presence(tokens: &mut Tokens, browsers: &Browsers) {
    loop {
        tokens.changed().await;
        let [agents, hubs] = tokens.names();
        send(browsers, Stream::Presence, &Message::Presence(Presence { hubs: &hubs, agents: &agents }));
    }
}

/// Asks once a second, and sooner where frames were refused.
async fn show_status(
    (session, source): (&Session, &Source),
    browsers: &Browsers,
    hurry: &Notify,
    writings: &KnownWritings,
) {
    let (mut tick, mut soonest) = (paced(STATUS_EVERY), paced(STATUS_SOONEST));
    loop {
        tokio::select! {
            _ = tick.tick() => {}
            () = hurry.notified() => {}
        }
        soonest.tick().await;
        let (hubs, error) = match hub_status::query_of(session, source.network, source.hub).await {
            Ok(hubs) => (hubs, None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        // What was known holds where none answers.
        note_writings(writings, hub_status::writings_of(&hubs));
        send(browsers, Stream::Status, &Message::Status(Status { hubs: &hubs, error }));
    }
}

fn note_writings(known: &KnownWritings, writings: Option<Writings>) {
    let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
    match writings {
        Some(writings) => *known = Some(writings),
        None => drop(known.get_or_insert_default()),
    }
}

fn paced(period: Duration) -> Interval {
    let mut paced = interval(period);
    paced.set_missed_tick_behavior(MissedTickBehavior::Delay);
    paced
}
