//! What is in SUMO at the moment, in our frame.

use super::client::Client;
use super::error::SumoError;
use super::message::{Domain, Question, Value, Variable};
use std::collections::BTreeMap;
use v2x_agent::trajectories::{LiveObject, Names, class_of_vehicle_class};
use v2x_common::class::Class;
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{Pose, wrap_angle};

/// From here on vehicles of agents have their numbers.
const FIRST_AGENT: u32 = 100_000;
/// Room for them.
const AGENTS: u32 = 1_000_000;

/// What SUMO knows an object by.
type Key = (Domain, String);

/// The objects that were ever seen.
#[derive(Debug, Default)]
pub(super) struct Objects {
    known: BTreeMap<Key, Known>,
    /// Those that have a number, because they had a place.
    numbered: u32,
    names: Names,
}

#[derive(Clone, Debug)]
struct Known {
    /// 0 before it has a place.
    number: u32,
    /// Its id, made unique among vehicles and persons; empty before it has a place.
    name: String,
    class: Class,
    w: f64,
    d: f64,
}

impl Objects {
    /// Number of objects so far.
    pub(super) const fn count(&self) -> u32 {
        self.numbered
    }

    /// Whether the numbers are those of a recording.
    pub(super) const fn are_countable(&self) -> bool {
        self.numbered < FIRST_AGENT
    }

    /// All objects that are there, by number.
    pub(super) async fn observe(&mut self, sumo: &mut Client) -> Result<Vec<LiveObject>, SumoError> {
        let ids = |domain| Question { domain, variable: Variable::Ids, object: "" };
        let lists = sumo.values(&[ids(Domain::Vehicle), ids(Domain::Person)]).await?;
        let mut there = Vec::new();
        for (domain, list) in [Domain::Vehicle, Domain::Person].into_iter().zip(lists) {
            let Value::Texts(mut ids) = list else { return Err(SumoError::Message("a list was expected")) };
            ids.sort_unstable();
            there.extend(ids.into_iter().map(|id| (domain, id)));
        }
        self.meet(sumo, &there).await?;
        let asked: Vec<_> = there.iter().flat_map(|key| ask(key, observed(key.0))).collect();
        let mut values = sumo.values(&asked).await?.into_iter();
        let mut objects = Vec::with_capacity(there.len());
        for key in &there {
            let (Some(Value::Place(x, y)), Some(Value::Number(angle_deg))) = (values.next(), values.next())
            else {
                return Err(SumoError::Message("a place and an angle were expected"));
            };
            let vehicle = if key.0 == Domain::Person { values.next() } else { None };
            let is_inside = matches!(vehicle, Some(Value::Text(vehicle)) if !vehicle.is_empty());
            // Somebody who is not on the road yet has no place.
            let is_there = !is_inside && x.abs() < 1e8 && y.abs() < 1e8;
            if let Some(known) = self.known.get_mut(key).filter(|_| is_there) {
                if known.number == 0 {
                    self.numbered += 1;
                    known.number = number(self.numbered);
                    known.name = self.names.of(kind(key.0), &key.1).into_owned();
                }
                objects.push(object(key.0, known, (x, y), angle_deg));
            }
        }
        objects.sort_by_key(|object| object.number);
        Ok(objects)
    }

    /// Asks for size and class of those who are new, and numbers them.
    async fn meet(&mut self, sumo: &mut Client, there: &[Key]) -> Result<(), SumoError> {
        let new: Vec<_> = there.iter().filter(|key| !self.known.contains_key(*key)).collect();
        let asked: Vec<_> = new.iter().flat_map(|key| ask(key, described(key.0))).collect();
        let mut values = sumo.values(&asked).await?.into_iter();
        for key in new {
            let (Some(Value::Number(w)), Some(Value::Number(d))) = (values.next(), values.next()) else {
                return Err(SumoError::Message("a size was expected"));
            };
            let class = match key.0 {
                Domain::Person => Class::Adult,
                Domain::Vehicle | Domain::Simulation => match values.next() {
                    Some(Value::Text(name)) => class_of_vehicle_class(&name).unwrap_or(Class::Car),
                    _ => return Err(SumoError::Message("a vehicle class was expected")),
                },
            };
            let size = |value: f64| value.clamp(MIN_SIZE_M, MAX_SIZE_M);
            let new = Known { number: 0, name: String::new(), class, w: size(w), d: size(d) };
            self.known.insert(key.clone(), new);
        }
        Ok(())
    }
}

/// The number of the n-th object.
const fn number(n: u32) -> u32 {
    if n < FIRST_AGENT { n } else { n.saturating_add(AGENTS) }
}

/// What is asked of everybody.
const fn observed(domain: Domain) -> &'static [Variable] {
    match domain {
        Domain::Person => &[Variable::Position, Variable::Angle, Variable::Vehicle],
        Domain::Vehicle | Domain::Simulation => &[Variable::Position, Variable::Angle],
    }
}

/// What is asked of somebody who is new.
const fn described(domain: Domain) -> &'static [Variable] {
    match domain {
        Domain::Person => &[Variable::Width, Variable::Length],
        Domain::Vehicle | Domain::Simulation => &[Variable::Width, Variable::Length, Variable::VehicleClass],
    }
}

fn ask<'a>((domain, object): &'a Key, variables: &'a [Variable]) -> impl Iterator<Item = Question<'a>> {
    variables.iter().map(|variable| Question { domain: *domain, variable: *variable, object })
}

/// What an object is called where another one has its id.
const fn kind(domain: Domain) -> &'static str {
    match domain {
        Domain::Person => "person",
        Domain::Vehicle | Domain::Simulation => "vehicle",
    }
}

/// SUMO's place of a vehicle is the middle of its front bumper, and its angles are those of a compass.
fn object(domain: Domain, known: &Known, place: (f64, f64), angle_deg: f64) -> LiveObject {
    let Known { number, name, class, w, d } = known;
    let yaw = wrap_angle(std::f64::consts::FRAC_PI_2 - angle_deg.to_radians());
    let front = Pose { x: place.0, y: place.1, yaw };
    let (x, y) = if domain == Domain::Vehicle { front.offset(-d / 2.0, 0.0) } else { place };
    LiveObject { number: *number, id: name.clone(), class: *class, x, y, yaw, w: *w, d: *d }
}
