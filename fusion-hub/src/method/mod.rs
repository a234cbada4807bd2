//! Which method fuses: ours, the paper's, others', or one of your own.
//!
//! Whatever the method, the [`Engine`](crate::engine::Engine) around it is the same: it checks frames, keeps the
//! books on agents, and publishes. So every method runs in the live hub and in the laboratory.

mod plugged;
mod window;

pub(crate) use plugged::Plugged;
pub use window::{WindowConfig, WindowFusion};

use crate::baselines::{Rule, Ties, dair_v2x, infradet3d};
use crate::sensing::Sensing;
use serde::{Deserialize, Serialize};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::time::Timestamp;

/// A way of making one list of objects of what agents report: the place for a method of your own
/// ([`Engine::with_fusion`](crate::engine::Engine::with_fusion)).
///
/// Time comes in as an argument; a method that asks no clock and draws no unseeded random numbers gives the same
/// bits for the same input, live and in the laboratory.
pub trait FusionMethod: std::fmt::Debug + Send {
    /// Takes in a frame. It has been checked, and is not older than Δmax; it may be older than others that came
    /// before it, of the same agent too. `sensing` reads its detections by what the agent has declared of its
    /// sensor ([`Sensing::measurement`]).
    fn handle_frame(&mut self, frame: &DetectionFrame, sensing: &Sensing);

    /// Writes down the objects as of `now` (the hub's clock) into a list that is empty.
    ///
    /// Objects are told apart by [`FusedObject::track`]. Name in [`FusedObject::contributors`] the detections that
    /// an object was made of: the laboratory scores it by them. [`FusedObject::from_box`] fills in the rest.
    fn tell(&mut self, now: Timestamp, objects: &mut Vec<FusedObject>);
}

/// The methods that are there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The best we know.
    #[default]
    Ours,
    /// UniKF as in the paper, with late data replayed: constant velocity, CSBA, ε_s = 10 ms.
    UnikfPaper,
    /// UniKF as the paper's text reads literally: what is newer than a late measurement is lost.
    UnikfLiteral,
    /// The main agent alone.
    #[serde(rename = "single-1")]
    Single1,
    /// Non-maximum suppression by IoU.
    Nms,
    /// Non-maximum suppression by GIoU.
    NmsGiou,
    /// Promotion-suppression aggregation, ties kept.
    Psa,
    /// Weighted box fusion.
    Wbf,
    /// InfraDet3D-Late as the paper's rows have it.
    #[serde(rename = "infradet3d")]
    InfraDet3d,
    /// InfraDet3D-Late as its authors' code has it.
    #[serde(rename = "infradet3d-code")]
    InfraDet3dCode,
    /// DAIR-V2X-Late as the paper's rows have it.
    #[serde(rename = "dair-v2x")]
    DairV2x,
    /// DAIR-V2X-Late as its authors' code has it.
    #[serde(rename = "dair-v2x-code")]
    DairV2xCode,
    /// CSBA association and weighted least squares, of what 100 ms hold.
    CsbaWls,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Ours,
        Self::UnikfPaper,
        Self::UnikfLiteral,
        Self::Single1,
        Self::Nms,
        Self::NmsGiou,
        Self::Psa,
        Self::Wbf,
        Self::InfraDet3d,
        Self::InfraDet3dCode,
        Self::DairV2x,
        Self::DairV2xCode,
        Self::CsbaWls,
    ];

    /// The rule of a method without memory; `None` for those with one. `overlap` is the threshold of those that
    /// go by overlap (IoU or GIoU).
    pub const fn rule(self, overlap: f64) -> Option<Rule> {
        Some(match self {
            Self::Ours | Self::UnikfPaper | Self::UnikfLiteral => return None,
            Self::Single1 => Rule::Single(0),
            Self::Nms => Rule::Nms { overlap },
            Self::NmsGiou => Rule::NmsGiou { overlap },
            Self::Psa => Rule::Psa(Ties::Kept),
            Self::Wbf => Rule::Wbf { overlap },
            Self::InfraDet3d => Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize),
            Self::InfraDet3dCode => Rule::InfraDet3d(infradet3d::Merge::MeanBoxFirstHeading),
            Self::DairV2x => Rule::DairV2x(dair_v2x::Variant::Average),
            Self::DairV2xCode => Rule::DairV2x(dair_v2x::Variant::MainAgent),
            Self::CsbaWls => Rule::CsbaWls,
        })
    }
}
