//! From a configuration to a method.

use super::config::{Fusion, MotionModel};
use super::method::FusionMethod;
use super::tracking::Tracking;
use super::window::WindowFusion;
use crate::filter::{ImmState, State};
use crate::tracker::Lifetimes;

impl Fusion {
    /// Starts the method, without tracks. Its track ids are of this lineage.
    pub(crate) fn start(&self, lifetimes: Lifetimes, lineage: u32) -> Box<dyn FusionMethod> {
        match *self {
            Self::Window(window) => {
                Box::new(WindowFusion::new(window, lineage, lifetimes.coast.without_rate()))
            }
            Self::Tracking(tracking) => match tracking.motion {
                MotionModel::Cv => Box::new(Tracking::<State>::new(tracking, lifetimes, lineage)),
                MotionModel::Imm => Box::new(Tracking::<ImmState>::new(tracking, lifetimes, lineage)),
            },
        }
    }
}
