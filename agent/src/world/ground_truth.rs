//! Ground truth at any time.

use std::sync::Arc;

use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::AgentId;
use v2x_common::sensor::{Body, SensorKind};
use v2x_common::time::Span;

use super::body::Shape;
use super::error::InvalidParameter;
use super::motion::Motion;
use super::parameters::{Route, Station, WorldAgent, WorldConfig, WorldParameters};
use super::recorded::RecordedWorld;
use super::{crossing, highway};
use crate::random::{Purpose, WorldDraw, keyed_rng};
use crate::trajectories::{State, Trajectory};
use crate::truth::{ObjectId, TrueObject};

/// Agents' own bodies are numbered from here in the order of the parameters, so that adding one renumbers nothing.
const FIRST_AGENT_OBJECT: u32 = 100_000;
/// The same beside more recorded objects than that.
const FIRST_AGENT_OF_MANY: u32 = 1_000_000_000;

/// Ground truth.
#[derive(Clone, Debug)]
pub struct World {
    loop_length: Span,
    /// Whether it begins again after its length.
    repeats: bool,
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
    /// Whether its body is one of the other objects, on which it rides.
    is_of_the_population: bool,
}

impl World {
    /// The world of these parameters and of the run's seed.
    pub fn new(parameters: &WorldParameters, seed: u64) -> Result<Self, InvalidParameter> {
        parameters.validate()?;
        let WorldParameters { loop_length, config, agents } = parameters;
        let setting = Setting::of(config, *loop_length);
        let agents: Vec<Agent> = (0..agents.len()).map(|index| setting.agent(agents, index, seed)).collect();
        let numbered = |population: Vec<(Shape, Motion)>| {
            let objects = (1..).zip(population);
            objects.map(|(id, (shape, motion))| (ObjectId(id), shape, motion)).collect()
        };
        let population: Vec<_> = match config {
            WorldConfig::Crossing(config) => {
                let queued = queued_agents(&parameters.agents);
                numbered(crossing::population(config, *loop_length, &queued, seed))
            }
            WorldConfig::Highway(config) => numbered(highway::population(config, *loop_length, seed)),
            WorldConfig::Recorded(recorded) => recorded.population(),
        };
        let others = population.into_iter().map(|(id, shape, motion)| Object { id, shape, motion });
        let bodies = agents.iter().filter_map(|agent| {
            let (id, shape) = agent.body.filter(|_| !agent.is_of_the_population)?;
            Some(Object { id, shape, motion: agent.motion.clone() })
        });
        let objects = others.chain(bodies).collect();
        Ok(Self { loop_length: *loop_length, repeats: config.repeats(), objects, agents })
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
            let State { pose, velocity } = object.motion.at(t)?;
            let Shape { class, w, d } = object.shape;
            let bev = BevBox { x: pose.x, y: pose.y, w, d, yaw: pose.yaw };
            Some(TrueObject { id: object.id, class, bev, velocity })
        }));
    }

    /// The index of an agent in the parameters; `None` where there is no such agent.
    pub fn agent_index(&self, id: &AgentId) -> Option<usize> {
        self.agents.iter().position(|agent| agent.id == *id)
    }

    /// The true pose of an agent, by its index, at scenario time `t`; `None` where there is no such agent, and while the
    /// object that it rides on is absent.
    pub fn agent_pose(&self, agent: usize, t: Span) -> Option<Pose> {
        self.agents.get(agent)?.motion.at(self.in_loop(t)).map(|state| state.pose)
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
        if !self.repeats {
            return t;
        }
        Span::from_nanos(t.as_nanos().rem_euclid(self.loop_length.as_nanos()))
    }
}

/// What the agents' motions depend on.
struct Setting<'a> {
    /// How long a lap on a route takes.
    lap: Span,
    recorded: Option<&'a RecordedWorld>,
    first_agent_object: u32,
}

impl<'a> Setting<'a> {
    fn of(config: &'a WorldConfig, loop_length: Span) -> Self {
        let (lap, recorded) = match config {
            WorldConfig::Crossing(_) => (crossing::lap_length(loop_length), None),
            WorldConfig::Highway(_) => (highway::lap_length(loop_length), None),
            WorldConfig::Recorded(recorded) => (loop_length, Some(recorded)),
        };
        let are_many =
            recorded.is_some_and(|world| world.traffic.objects.len() >= FIRST_AGENT_OBJECT as usize);
        let first_agent_object = if are_many { FIRST_AGENT_OF_MANY } else { FIRST_AGENT_OBJECT };
        Self { lap, recorded, first_agent_object }
    }

    fn agent(&self, agents: &[WorldAgent], index: usize, seed: u64) -> Agent {
        let WorldAgent { id, kind, station } = &agents[index];
        if let Station::Riding(name) = station {
            let ridden = self.recorded.and_then(|recorded| recorded.named(name));
            let (body, motion) = match ridden {
                Some((object, shape, motion)) => (Some((object, shape)), motion),
                // It has not come yet.
                None => (None, Motion::Recorded(Arc::new(Trajectory::new(Vec::new(), Span::ZERO)))),
            };
            return Agent { id: *id, motion, body, is_of_the_population: true };
        }
        let body = (*kind == SensorKind::Vehicle).then(|| {
            let mut rng = keyed_rng(seed, Some(id), 0, Purpose::World(WorldDraw::AgentBody));
            let offset = u32::try_from(index).expect("there are far fewer agents than u32 can count");
            (ObjectId(self.first_agent_object + offset), Shape::agent(&mut rng))
        });
        let rank = agents[..index].iter().filter(|other| other.station == *station).count();
        let motion = match station {
            Station::Fixed(pose) => Motion::Standing(*pose),
            Station::Driving(Route::Block(arm)) => crossing::block_lap(*arm, rank, self.lap),
            Station::Driving(Route::Service(side)) => highway::service_lap(*side, rank, self.lap),
            Station::Following(trajectory) => Motion::Recorded(Arc::clone(trajectory)),
            Station::Riding(_) => unreachable!("returned above"),
        };
        Agent { id: *id, motion, body, is_of_the_population: false }
    }
}

/// How many agents wait at each arm's stop line.
fn queued_agents(agents: &[WorldAgent]) -> [usize; 4] {
    [0, 1, 2, 3].map(|arm| {
        let station = Station::Driving(Route::Block(arm));
        agents.iter().filter(|agent| agent.station == station).count()
    })
}
