//! What the launcher of a simulated network knows of its world: the roads, and the truth at any time.

use super::errors::Errors;
use v2x_agent::scenario::Scenario;
use v2x_agent::truth::TrueObject;
use v2x_agent::world::{Road, World};
use v2x_common::time::Timestamp;

/// The world of a scenario.
pub(crate) struct Scene {
    pub(super) name: String,
    pub(super) roads: Vec<Road>,
    world: World,
    start: Timestamp,
}

impl Scene {
    /// Of a run with this seed, whose scenario time is zero at `start`.
    pub(crate) fn new(scenario: &Scenario, seed: u64, start: Timestamp) -> Self {
        let (name, roads) = (scenario.name.clone(), scenario.world.roads());
        Self { name, roads, world: scenario.world(seed), start }
    }

    /// Of agents that were started by hand or by `v2x up`: they agree on a start by the scenario's period.
    pub(crate) fn of_period(scenario: &Scenario, seed: u64) -> Self {
        Self::new(scenario, seed, Timestamp::EPOCH)
    }

    /// Every true object at a time, by id.
    pub(super) fn truth(&self, at: Timestamp) -> Vec<TrueObject> {
        let mut objects = Vec::new();
        self.world.objects_at(at - self.start, &mut objects);
        objects
    }

    /// The errors of estimates for a time, at these positions, m.
    pub(super) fn errors(&self, at: Timestamp, estimates: impl Iterator<Item = (f64, f64)>) -> Errors {
        Errors::of(estimates, &self.truth(at))
    }
}
