//! The metrics of trackers side by side: HOTA, CLEAR MOT, identity and AMOTA of the same scenes.

use crate::score::tracking::amota::NuscenesScore;
use crate::score::tracking::clear::Clear;
use crate::score::tracking::hota::{Hota, ZERO_M};
use crate::score::tracking::identity::Identity;
use crate::score::tracking::sequence::{GATE_M, Sequence};
use serde::Serialize;

/// The figures of some scenes together. Classes count for AMOTA only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TrackingFigures {
    /// CLEAR MOT's accuracy, pairs within 2 m: at most 1, negative where errors outnumber objects.
    pub mota: Option<f64>,
    /// CLEAR MOT's precision, the mean distance of pairs, m.
    pub motp_m: Option<f64>,
    /// Share of boxes with the right identity.
    pub idf1: Option<f64>,
    /// HOTA over positions (similarity 1 − distance / 4 m).
    pub hota: Option<f64>,
    /// HOTA's detection accuracy.
    pub deta: Option<f64>,
    /// HOTA's association accuracy.
    pub assa: Option<f64>,
    /// nuScenes' AMOTA, mean over its classes with true boxes.
    pub amota: Option<f64>,
    /// nuScenes' AMOTP, m.
    pub amotp_m: Option<f64>,
    /// CLEAR MOT's identity switches.
    #[serde(rename = "clear_id_switches")]
    pub id_switches: u64,
    /// CLEAR MOT's fragmentations.
    pub fragmentations: u64,
}

impl TrackingFigures {
    /// Of these scenes.
    pub fn of(scenes: &[Sequence]) -> Self {
        let (mut clear, mut identity, mut hota) = (Clear::default(), Identity::default(), Hota::default());
        for scene in scenes {
            clear.merge(&Clear::of(scene, GATE_M));
            identity.merge(&Identity::of(scene, GATE_M));
            hota.merge(&Hota::of(scene, ZERO_M));
        }
        let (nuscenes, hota) = (NuscenesScore::of(scenes), hota.score());
        Self {
            mota: clear.mota(),
            motp_m: clear.motp_m(),
            idf1: identity.idf1(),
            hota: Some(hota.hota),
            deta: Some(hota.det_a),
            assa: Some(hota.ass_a),
            amota: nuscenes.amota(),
            amotp_m: nuscenes.amotp_m(),
            id_switches: clear.switches,
            fragmentations: clear.fragmentations,
        }
    }
}
