//! Ground truth as a pure function of (scenario, seed, time).
//!
//! A world is periodic with the scenario's loop length. Its objects are boxes that stand, that go round a closed
//! `path` by a `profile` of speed, or that travel an open path and are absent until the loop brings them
//! back: they come and go at the ends of the roads, far from where agents drive.

mod body;
pub mod crossing;
pub mod highway;
mod motion;
pub mod path;
pub mod profile;

use v2x_common::geometry::{BevBox, Pose};
use v2x_common::sensor::{Body, SensorKind};
use v2x_common::time::Span;

pub use crossing::CrossingConfig;
pub use highway::HighwayConfig;

use crate::random::{Purpose, WorldDraw, keyed_rng};
use crate::scenario::{AgentConfig, Route, Scenario, Station, WorldConfig};
use crate::truth::{ObjectId, TrueObject};
use body::Shape;
use motion::Motion;

/// Agents' own bodies are numbered from here in the scenario's order, so that adding one renumbers nothing.
const FIRST_AGENT_OBJECT: u32 = 100_000;

/// Ground truth.
#[derive(Clone, Debug)]
pub struct World {
    loop_length: Span,
    /// By id.
    objects: Vec<Object>,
    /// By index in the scenario.
    agents: Vec<Agent>,
}

#[derive(Clone, Debug)]
struct Object {
    id: ObjectId,
    shape: Shape,
    motion: Motion,
}

#[derive(Clone, Debug)]
struct Agent {
    motion: Motion,
    body: Option<(ObjectId, Shape)>,
}

impl World {
    /// The world of a scenario. The seed is the run's, which may be another than the scenario's own.
    pub fn new(scenario: &Scenario, seed: u64) -> Self {
        let lap = match &scenario.world {
            WorldConfig::Crossing(_) => crossing::lap_length(scenario.loop_length),
            WorldConfig::Highway(_) => highway::lap_length(scenario.loop_length),
        };
        let agents: Vec<Agent> =
            (0..scenario.agents.len()).map(|index| agent(scenario, index, lap, seed)).collect();
        let population = match &scenario.world {
            WorldConfig::Crossing(config) => {
                crossing::population(config, scenario.loop_length, &queued_agents(scenario), seed)
            }
            WorldConfig::Highway(config) => highway::population(config, scenario.loop_length, seed),
        };
        let others =
            (1..).zip(population).map(|(id, (shape, motion))| Object { id: ObjectId(id), shape, motion });
        let bodies = agents.iter().filter_map(|agent| {
            agent.body.map(|(id, shape)| Object { id, shape, motion: agent.motion.clone() })
        });
        Self { loop_length: scenario.loop_length, objects: others.chain(bodies).collect(), agents }
    }

    /// The period.
    pub const fn loop_length(&self) -> Span {
        self.loop_length
    }

    /// Every object that is there at scenario time `t`, by id, in `out` (which is cleared first).
    pub fn objects_at(&self, t: Span, out: &mut Vec<TrueObject>) {
        out.clear();
        let t = self.in_loop(t);
        out.extend(self.objects.iter().filter_map(|object| {
            let (pose, speed_mps) = object.motion.at(t)?;
            let (sin, cos) = libm::sincos(pose.yaw);
            let Shape { class, w, d } = object.shape;
            Some(TrueObject {
                id: object.id,
                class,
                bev: BevBox { x: pose.x, y: pose.y, w, d, yaw: pose.yaw },
                velocity: (speed_mps * cos, speed_mps * sin),
            })
        }));
    }

    /// Where an agent (by index in the scenario) is at scenario time `t`.
    ///
    /// # Panics
    /// If the scenario has no such agent.
    pub fn agent_pose(&self, agent: usize, t: Span) -> Pose {
        let (pose, _) = self.agents[agent].motion.at(self.in_loop(t)).expect("agents are always there");
        pose
    }

    /// The object that a vehicle agent is; `None` for a roadside unit.
    ///
    /// # Panics
    /// If the scenario has no such agent.
    pub fn agent_object(&self, agent: usize) -> Option<ObjectId> {
        self.agents[agent].body.map(|(id, _)| id)
    }

    /// The body of a vehicle agent; `None` for a roadside unit.
    ///
    /// # Panics
    /// If the scenario has no such agent.
    pub fn agent_body(&self, agent: usize) -> Option<Body> {
        self.agents[agent].body.map(|(_, Shape { class, w, d })| Body { class, w, d })
    }

    fn in_loop(&self, t: Span) -> Span {
        Span::from_nanos(t.as_nanos().rem_euclid(self.loop_length.as_nanos()))
    }
}

fn agent(scenario: &Scenario, index: usize, lap: Span, seed: u64) -> Agent {
    let config = &scenario.agents[index];
    let body = (config.kind == SensorKind::Vehicle).then(|| {
        let mut rng = keyed_rng(seed, Some(&config.id), 0, Purpose::World(WorldDraw::AgentBody));
        let offset = u32::try_from(index).expect("a scenario has few agents");
        (ObjectId(FIRST_AGENT_OBJECT + offset), Shape::agent(&mut rng))
    });
    let motion = match config.station {
        Station::Fixed(pose) => Motion::Standing(pose),
        Station::Driving(Route::Block(arm)) => crossing::block_lap(arm, rank(scenario, config), lap),
        Station::Driving(Route::Service(side)) => highway::service_lap(side, rank(scenario, config), lap),
    };
    Agent { motion, body }
}

/// How many agents before this one drive on the same route.
fn rank(scenario: &Scenario, config: &AgentConfig) -> usize {
    scenario
        .agents
        .iter()
        .take_while(|other| other.id != config.id)
        .filter(|other| other.station == config.station)
        .count()
}

/// How many agents wait at each arm's stop line.
fn queued_agents(scenario: &Scenario) -> [usize; 4] {
    [0, 1, 2, 3].map(|arm| {
        let station = Station::Driving(Route::Block(arm));
        scenario.agents.iter().filter(|agent| agent.station == station).count()
    })
}

#[cfg(test)]
mod tests;
