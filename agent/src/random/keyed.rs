//! One stream of random numbers for each purpose.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use v2x_common::id::AgentId;

use crate::truth::ObjectId;

/// What a stream of random numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Layout of the world and its traffic; the sequence is the place that is filled.
    World(WorldDraw),
    /// Whether one object is detected in a frame, and with which error.
    Measurement(ObjectId),
    /// Error of a vehicle's report of itself in a frame.
    SelfReport,
    /// False detections of a frame.
    Clutter,
    /// Order of the detections in a frame.
    Order,
    /// Loss and delay of a frame.
    Link,
    /// Whether a frame falls into a burst of losses.
    LossBurst,
    /// Error of an agent's pose; the sequence is a frame number.
    PoseError,
    /// Time that a frame takes from capture until it is ready to be sent.
    SensorModel,
    /// Capture time of an agent's first frame, where it is random.
    CapturePhase,
    /// Times of its opportunities to send, where they are random.
    TransmitPhase,
    /// How a detector with a profile errs on one object.
    Detector(DetectorStream, ObjectId),
    /// False objects that stay; the sequence is the first frame of their span.
    FalseObjects,
}

/// What a detector's draws on one object are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DetectorStream {
    /// Slow errors of its position.
    Errors,
    /// Whether it is detected.
    Hits,
    /// Whether its heading is turned.
    Flips,
    /// Whether its class is wrong.
    Class,
    /// Its score.
    Score,
    /// What is independent in each frame.
    Frame,
}

/// Which part of the world is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldDraw {
    /// A place in a lane's traffic.
    Traffic,
    /// A bicycle.
    Bicycle,
    /// A person on foot.
    Pedestrian,
    /// A parked or standing vehicle.
    Parked,
    /// The parking places that are occupied.
    ParkingPlaces,
    /// A cone or barrier.
    Works,
    /// The body of a vehicle agent.
    AgentBody,
}

impl Purpose {
    /// Eight bytes, different for each purpose.
    fn key(self) -> u64 {
        let (major, minor) = match self {
            Self::World(draw) => (1, draw as u32),
            Self::Measurement(object) => (2, object.0),
            Self::SelfReport => (3, 0),
            Self::Clutter => (4, 0),
            Self::Order => (5, 0),
            Self::Link => (6, 0),
            Self::LossBurst => (7, 0),
            Self::PoseError => (8, 0),
            Self::SensorModel => (9, 0),
            Self::CapturePhase => (10, 0),
            Self::TransmitPhase => (11, 0),
            Self::FalseObjects => (12, 0),
            Self::Detector(stream, object) => (13 + stream as u64, object.0),
        };
        u64::from(minor) << 32 | major
    }
}

/// The generator of one draw. `agent` is `None` for draws of the world.
pub fn keyed_rng(seed: u64, agent: Option<&AgentId>, sequence: u64, purpose: Purpose) -> ChaCha8Rng {
    let words = [seed, agent.map_or(0, stable_hash), sequence, purpose.key()];
    let mut key = [0; 32];
    for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    ChaCha8Rng::from_seed(key)
}

/// FNV-1a: the same on every machine and in every version, unlike std's hashers.
fn stable_hash(agent: &AgentId) -> u64 {
    agent
        .as_str()
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn every_part_of_the_key_matters() {
        let agents = [AgentId::new("a").unwrap(), AgentId::new("b").unwrap()];
        let mut firsts: Vec<u64> = [
            keyed_rng(1, None, 0, Purpose::Clutter),
            keyed_rng(2, None, 0, Purpose::Clutter),
            keyed_rng(1, Some(&agents[0]), 0, Purpose::Clutter),
            keyed_rng(1, Some(&agents[1]), 0, Purpose::Clutter),
            keyed_rng(1, None, 1, Purpose::Clutter),
            keyed_rng(1, None, 0, Purpose::Order),
            keyed_rng(1, None, 0, Purpose::Measurement(ObjectId(1))),
            keyed_rng(1, None, 0, Purpose::Measurement(ObjectId(2))),
            keyed_rng(1, None, 0, Purpose::World(WorldDraw::Traffic)),
            keyed_rng(1, None, 0, Purpose::World(WorldDraw::Bicycle)),
        ]
        .iter_mut()
        .map(|rng| rng.random())
        .collect();
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), 10);
    }

    #[test]
    fn the_stream_of_a_key_never_changes() {
        let agent = AgentId::new("ego").unwrap();
        let mut rng = keyed_rng(1, Some(&agent), 7, Purpose::Link);
        // The first draw as this test's failure prints it; a change of it changes every scenario's runs.
        assert_eq!(rng.random::<u64>(), 5_105_196_772_680_445_547);
    }
}
