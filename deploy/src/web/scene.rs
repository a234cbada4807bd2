//! What the launcher of a simulated network knows of its world: the roads, and the truth at any time.

use super::errors::Errors;
use anyhow::Context;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio_util::sync::CancellationToken;
use v2x_agent::scenario::Scenario;
use v2x_agent::shell::{LiveWorld, Steps};
use v2x_agent::truth::TrueObject;
use v2x_agent::world::{Road, World};
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_common::time::{Span, Timestamp};
use zenoh::Session;

/// The world of a scenario.
pub(crate) struct Scene {
    pub(super) name: String,
    pub(super) roads: Vec<Road>,
    view: Mutex<View>,
    /// When scenario time is zero, where the launcher knows it.
    start: Option<Timestamp>,
    /// The scenario and the run's seed, where another program drives its world.
    live: Option<(Scenario, u64)>,
}

/// No time.
const NEVER: (Span, Span) = (Span::ZERO, Span::from_nanos(-1));

/// The world as far as it is known.
struct View {
    world: World,
    /// When scenario time is zero.
    start: Timestamp,
    /// The times at which it is known; all times where it is not driven elsewhere.
    known: Option<(Span, Span)>,
}

impl Scene {
    /// Of a run with this seed, whose scenario time is zero at `start`.
    pub(crate) fn new(scenario: &Scenario, seed: u64, start: Timestamp) -> Self {
        Self::beginning(scenario, seed, Some(start))
    }

    /// Of agents that were started by hand or by `v2x up`: they agree on a start by the scenario's period, or by the world
    /// that they hear.
    pub(crate) fn of_period(scenario: &Scenario, seed: u64) -> Self {
        Self::beginning(scenario, seed, None)
    }

    fn beginning(scenario: &Scenario, seed: u64, start: Option<Timestamp>) -> Self {
        let (name, roads) = (scenario.name.clone(), scenario.world.roads());
        let is_live = scenario.world.is_live();
        let view = View {
            world: scenario.world(seed),
            start: start.unwrap_or(Timestamp::EPOCH),
            known: is_live.then_some(NEVER),
        };
        let live = is_live.then(|| (scenario.clone(), seed));
        Self { name, roads, view: Mutex::new(view), start, live }
    }

    /// Every true object at a time, by id; `None` where that is not known.
    pub(super) fn truth(&self, at: Timestamp) -> Option<Vec<TrueObject>> {
        let view = self.view();
        let t = at - view.start;
        if view.known.is_some_and(|(from, to)| t < from || t > to) {
            return None;
        }
        let mut objects = Vec::new();
        view.world.objects_at(t, &mut objects);
        Some(objects)
    }

    /// The errors of estimates for a time, at these positions, m.
    pub(super) fn errors(
        &self,
        at: Timestamp,
        estimates: impl Iterator<Item = (f64, f64)>,
    ) -> Option<Errors> {
        Some(Errors::of(estimates, &self.truth(at)?))
    }

    /// Follows a world that another program drives until shutdown; waits for that where there is none.
    pub(super) async fn follow(
        &self,
        session: &Session,
        network: NetworkId,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let Some((scenario, seed)) = &self.live else {
            shutdown.cancelled().await;
            return Ok(());
        };
        let steps = Steps::subscribe(session, &Keys::new(network)).await?;
        let live = LiveWorld::begin(steps, (scenario, *seed), self.start, shutdown).await;
        let Some(mut live) = live else { return Ok(()) };
        loop {
            let view = View {
                world: live.world().context("the live world")?,
                start: live.start(),
                known: Some(live.known().unwrap_or(NEVER)),
            };
            *self.view() = view;
            tokio::select! {
                _ = live.advance() => {}
                () = shutdown.cancelled() => return Ok(()),
            }
        }
    }

    fn view(&self) -> MutexGuard<'_, View> {
        // A view is replaced as a whole: a poisoned lock is safe to use.
        self.view.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
