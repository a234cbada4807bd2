//! The detection metrics side by side: fused objects as boxes with their existence for a score.

use crate::score::detection::nuscenes::DetectionFigures;
use crate::score::detection::{Scene, overlap};
use serde::Serialize;

/// Average precisions and errors. The score of a box is the existence probability of its object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct DetectionScore {
    /// AP at an intersection over union of 0.3, 0.5 and 0.7, whatever the classes (as OpenCOOD).
    pub ap_iou: Option<[f64; 3]>,
    /// AP at centre distances of 0.5, 1, 2 and 4 m, mean over classes (as nuScenes).
    pub ap_distance: Option<[f64; 4]>,
    /// The mean of these.
    pub map: Option<f64>,
    /// nuScenes' error of position at 2 m, mean over classes, m.
    pub nuscenes_ate_m: Option<f64>,
    /// nuScenes' error of size, 1 − IoU of aligned boxes.
    pub nuscenes_ase: Option<f64>,
    /// nuScenes' error of orientation, rad.
    pub nuscenes_aoe_rad: Option<f64>,
    /// nuScenes' error of velocity, m/s.
    pub nuscenes_ave_mps: Option<f64>,
    /// (5 mAP + Σ max(0, 1 − error)) / 9 over these four errors: nuScenes' NDS without attributes.
    pub nds_without_attributes: Option<f64>,
}

impl DetectionScore {
    /// Of these scenes together.
    pub(crate) fn of(scenes: &[Scene<'_>]) -> Self {
        let nuscenes = DetectionFigures::of(scenes);
        let [ate, ase, aoe, ave] = nuscenes.errors();
        Self {
            ap_iou: overlap::average_precisions(scenes),
            ap_distance: nuscenes.ap(),
            map: nuscenes.map(),
            nuscenes_ate_m: ate,
            nuscenes_ase: ase,
            nuscenes_aoe_rad: aoe,
            nuscenes_ave_mps: ave,
            nds_without_attributes: nuscenes.nds(),
        }
    }
}
