//! Ground truth at any time.

use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::AgentId;
use v2x_common::sensor::{Body, SensorKind};
use v2x_common::time::Span;

use super::body::Shape;
use super::error::InvalidParameter;
use super::motion::Motion;
use super::parameters::{Route, Station, WorldAgent, WorldConfig, WorldParameters};
use super::{crossing, highway};
use crate::random::{Purpose, WorldDraw, keyed_rng};
use crate::truth::{ObjectId, TrueObject};

/// Agents' own bodies are numbered from here in the order of the parameters, so that adding one renumbers nothing.
const FIRST_AGENT_OBJECT: u32 = 100_000;

/// Ground truth.
#[derive(Clone, Debug)]
pub struct World {
    loop_length: Span,
    /// By id.
    objects: Vec<Object>,
    /// By index in the parameters.
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
    id: AgentId,
    motion: Motion,
    body: Option<(ObjectId, Shape)>,
}

impl World {
    /// The world of these parameters and of the run's seed.
    pub fn new(parameters: &WorldParameters, seed: u64) -> Result<Self, InvalidParameter> {
        parameters.validate()?;
        let WorldParameters { loop_length, config, agents } = parameters;
        let lap = match config {
            WorldConfig::Crossing(_) => crossing::lap_length(*loop_length),
            WorldConfig::Highway(_) => highway::lap_length(*loop_length),
        };
        let agents: Vec<Agent> = (0..agents.len()).map(|index| agent(agents, index, lap, seed)).collect();
        let population = match config {
            WorldConfig::Crossing(config) => {
                crossing::population(config, *loop_length, &queued_agents(&parameters.agents), seed)
            }
            WorldConfig::Highway(config) => highway::population(config, *loop_length, seed),
        };
        let others =
            (1..).zip(population).map(|(id, (shape, motion))| Object { id: ObjectId(id), shape, motion });
        let bodies = agents.iter().filter_map(|agent| {
            agent.body.map(|(id, shape)| Object { id, shape, motion: agent.motion.clone() })
        });
        Ok(Self { loop_length: *loop_length, objects: others.chain(bodies).collect(), agents })
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

    /// The index of an agent in the parameters; `None` where there is no such agent.
    pub fn agent_index(&self, id: &AgentId) -> Option<usize> {
        self.agents.iter().position(|agent| agent.id == *id)
    }

    /// The true pose of an agent, by its index, at scenario time `t`; `None` where there is no such agent.
    pub fn agent_pose(&self, agent: usize, t: Span) -> Option<Pose> {
        let (pose, _) = self.agents.get(agent)?.motion.at(self.in_loop(t))?;
        Some(pose)
    }

    /// The object that a vehicle agent is; `None` for a roadside unit, and where there is no such agent.
    pub fn agent_object(&self, agent: usize) -> Option<ObjectId> {
        self.agents.get(agent)?.body.map(|(id, _)| id)
    }

    /// The body of a vehicle agent; `None` for a roadside unit, and where there is no such agent.
    pub fn agent_body(&self, agent: usize) -> Option<Body> {
        self.agents.get(agent)?.body.map(|(_, Shape { class, w, d })| Body { class, w, d })
    }

    fn in_loop(&self, t: Span) -> Span {
        Span::from_nanos(t.as_nanos().rem_euclid(self.loop_length.as_nanos()))
    }
}

fn agent(agents: &[WorldAgent], index: usize, lap: Span, seed: u64) -> Agent {
    let WorldAgent { id, kind, station } = agents[index];
    let body = (kind == SensorKind::Vehicle).then(|| {
        let mut rng = keyed_rng(seed, Some(&id), 0, Purpose::World(WorldDraw::AgentBody));
        let offset = u32::try_from(index).expect("there are far fewer agents than u32 can count");
        (ObjectId(FIRST_AGENT_OBJECT + offset), Shape::agent(&mut rng))
    });
    let rank = agents[..index].iter().filter(|other| other.station == station).count();
    let motion = match station {
        Station::Fixed(pose) => Motion::Standing(pose),
        Station::Driving(Route::Block(arm)) => crossing::block_lap(arm, rank, lap),
        Station::Driving(Route::Service(side)) => highway::service_lap(side, rank, lap),
    };
    Agent { id, motion, body }
}

/// How many agents wait at each arm's stop line.
fn queued_agents(agents: &[WorldAgent]) -> [usize; 4] {
    [0, 1, 2, 3].map(|arm| {
        let station = Station::Driving(Route::Block(arm));
        agents.iter().filter(|agent| agent.station == station).count()
    })
}
