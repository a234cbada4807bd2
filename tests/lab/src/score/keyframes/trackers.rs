//! Tracking and detection metrics of contenders.

use crate::data::scene::Scene;
use crate::drive::parallel;
use crate::score::detection::{self, DetectionScore, Velocities};
use crate::score::gospa::gospa;
use crate::score::keyframes::experiments::{Cell, Experiment, Plan, RunError};
use crate::score::keyframes::scored_keyframe::ScoredKeyframe;
use crate::score::moments::Moments;
use crate::score::tracking::figures::TrackingFigures;
use crate::score::tracking::sequence::Instant as Tracked;
use crate::score::tracking::sequence::{ReportedBox, Sequence};
use serde::Serialize;
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::association::assignment::Assigner;

/// GOSPA's cut-off: a miss and a false object cost as much as a pair this far apart, m.
pub(super) const GOSPA_CUTOFF_M: f64 = 5.0;

/// A contender's tracking and detection metrics, over all scenes of a trial, then averaged over trials. Boxes are matched by position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct TrackerScore {
    /// GOSPA (p 2, α 2, cut-off 5 m), mean over frames, m.
    pub gospa_m: Option<f64>,
    /// HOTA over positions (similarity 1 − distance / 4 m).
    pub hota: Option<f64>,
    /// HOTA's detection accuracy.
    pub deta: Option<f64>,
    /// HOTA's association accuracy.
    pub assa: Option<f64>,
    /// CLEAR MOT's accuracy, pairs within 2 m.
    pub mota: Option<f64>,
    /// CLEAR MOT's precision, the mean distance of pairs, m.
    pub motp_m: Option<f64>,
    /// Share of boxes with the right identity.
    pub idf1: Option<f64>,
    /// Identity switches.
    pub id_switches: Option<f64>,
    /// Fragmentations.
    pub fragmentations: Option<f64>,
    /// nuScenes' AMOTA, mean over its classes.
    pub amota: Option<f64>,
    /// nuScenes' AMOTP, m.
    pub amotp_m: Option<f64>,
    /// nuScenes' mAP for detection; a box's score is the existence probability of its object.
    pub map: Option<f64>,
    /// AP at an intersection over union of 0.3, whatever the classes (as OpenCOOD).
    pub ap_iou_30: Option<f64>,
    /// The same at 0.5.
    pub ap_iou_50: Option<f64>,
    /// The same at 0.7.
    pub ap_iou_70: Option<f64>,
    /// AP at a centre distance of 0.5 m, mean over classes (as nuScenes).
    pub ap_05_m: Option<f64>,
    /// The same at 1 m.
    pub ap_1_m: Option<f64>,
    /// The same at 2 m.
    pub ap_2_m: Option<f64>,
    /// The same at 4 m.
    pub ap_4_m: Option<f64>,
    /// nuScenes' error of position at 2 m, mean over classes, m.
    pub nuscenes_ate_m: Option<f64>,
    /// nuScenes' error of size.
    pub nuscenes_ase: Option<f64>,
    /// nuScenes' error of orientation, rad.
    pub nuscenes_aoe_rad: Option<f64>,
    /// nuScenes' error of velocity, m/s; 1 for boxes without one.
    pub nuscenes_ave_mps: Option<f64>,
    /// nuScenes' NDS of the mAP and these four errors.
    pub nds_without_attributes: Option<f64>,
}

impl Plan {
    /// The tracking metrics of these cells, in this order.
    pub(crate) fn track(
        &self,
        scenes: &[Scene],
        cells: &[Cell],
        progress: impl FnMut(usize, usize),
    ) -> Result<Vec<TrackerScore>, RunError> {
        let trials = self.trials as usize;
        let work = |place: usize| {
            let trial = u32::try_from(place % trials).unwrap_or(0);
            self.tracker_score(scenes, cells[place / trials], trial)
        };
        let by_trial = parallel::map(cells.len() * trials, self.threads, work, progress)?;
        Ok(by_trial.chunks(trials).map(TrackerScore::mean).collect())
    }

    fn tracker_score(&self, scenes: &[Scene], cell: Cell, trial: u32) -> Result<TrackerScore, RunError> {
        let Experiment { setting, contenders } = &self.experiments[cell.experiment];
        let contender = &contenders[cell.contender];
        let (mut sequences, mut velocities, mut gospa_m) = (Vec::new(), Vec::new(), Moments::default());
        let mut assigner = Assigner::default();
        for scene in scenes {
            let (mut instants, mut of_scene) = (Vec::new(), Vec::new());
            self.run_scene(scene, (*setting, trial), &[contender], |_, keyframe| {
                let instant = tracked(keyframe);
                let boxes: (Vec<BevBox>, Vec<BevBox>) = (
                    instant.reported.iter().map(|one| one.bev).collect(),
                    instant.truth.iter().map(|one| one.bev).collect(),
                );
                gospa_m.add(Some(gospa(&boxes.0, &boxes.1, GOSPA_CUTOFF_M, &mut assigner).distance_m()));
                instants.push(instant);
                of_scene.push(velocities_of(keyframe));
            })?;
            match Sequence::new(instants) {
                Ok(sequence) => {
                    sequences.push(sequence);
                    velocities.push(of_scene);
                }
                // A user's method that publishes a track twice in a frame is no tracker.
                Err(error) => {
                    tracing::warn!(method = contender.key(), scene = scene.name, %error, "no tracker's figures");
                    return Ok(TrackerScore { gospa_m: gospa_m.mean(), ..TrackerScore::default() });
                }
            }
        }
        Ok(TrackerScore { gospa_m: gospa_m.mean(), ..TrackerScore::of(&sequences, &velocities) })
    }
}

fn tracked(keyframe: &ScoredKeyframe<'_>) -> Tracked {
    let tracks = keyframe.counted_boxes().map(|one| ReportedBox {
        track: one.track.0,
        class: one.class,
        score: one.existence,
        bev: one.bev,
    });
    Tracked { truth: keyframe.objects().copied().collect(), reported: tracks.collect() }
}

/// The velocities of the boxes of [`tracked`].
fn velocities_of(keyframe: &ScoredKeyframe<'_>) -> Velocities {
    let truth = keyframe.objects().map(|one| keyframe.scene.velocity(keyframe.frame, one.id));
    Velocities {
        truth: truth.collect(),
        reported: keyframe.counted_boxes().map(|one| one.velocity).collect(),
    }
}

impl TrackerScore {
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    fn of(sequences: &[Sequence], velocities: &[Vec<Velocities>]) -> Self {
        let figures = TrackingFigures::of(sequences);
        let scenes = sequences.iter().zip(velocities);
        let scenes: Vec<_> =
            scenes.map(|(sequence, velocities)| detection::Scene { sequence, velocities }).collect();
        let detection = DetectionScore::of(&scenes);
        let at_overlap = |place: usize| detection.ap_iou.map(|ap| ap[place]);
        let at_distance = |place: usize| detection.ap_distance.map(|ap| ap[place]);
        Self {
            gospa_m: None,
            hota: figures.hota,
            deta: figures.deta,
            assa: figures.assa,
            mota: figures.mota,
            motp_m: figures.motp_m,
            idf1: figures.idf1,
            id_switches: Some(figures.id_switches as f64),
            fragmentations: Some(figures.fragmentations as f64),
            amota: figures.amota,
            amotp_m: figures.amotp_m,
            map: detection.map,
            ap_iou_30: at_overlap(0),
            ap_iou_50: at_overlap(1),
            ap_iou_70: at_overlap(2),
            ap_05_m: at_distance(0),
            ap_1_m: at_distance(1),
            ap_2_m: at_distance(2),
            ap_4_m: at_distance(3),
            nuscenes_ate_m: detection.nuscenes_ate_m,
            nuscenes_ase: detection.nuscenes_ase,
            nuscenes_aoe_rad: detection.nuscenes_aoe_rad,
            nuscenes_ave_mps: detection.nuscenes_ave_mps,
            nds_without_attributes: detection.nds_without_attributes,
        }
    }

    /// The mean over trials.
    fn mean(trials: &[Self]) -> Self {
        let of =
            |figure: fn(&Self) -> Option<f64>| trials.iter().filter_map(figure).collect::<Moments>().mean();
        Self {
            gospa_m: of(|one| one.gospa_m),
            hota: of(|one| one.hota),
            deta: of(|one| one.deta),
            assa: of(|one| one.assa),
            mota: of(|one| one.mota),
            motp_m: of(|one| one.motp_m),
            idf1: of(|one| one.idf1),
            id_switches: of(|one| one.id_switches),
            fragmentations: of(|one| one.fragmentations),
            amota: of(|one| one.amota),
            amotp_m: of(|one| one.amotp_m),
            map: of(|one| one.map),
            ap_iou_30: of(|one| one.ap_iou_30),
            ap_iou_50: of(|one| one.ap_iou_50),
            ap_iou_70: of(|one| one.ap_iou_70),
            ap_05_m: of(|one| one.ap_05_m),
            ap_1_m: of(|one| one.ap_1_m),
            ap_2_m: of(|one| one.ap_2_m),
            ap_4_m: of(|one| one.ap_4_m),
            nuscenes_ate_m: of(|one| one.nuscenes_ate_m),
            nuscenes_ase: of(|one| one.nuscenes_ase),
            nuscenes_aoe_rad: of(|one| one.nuscenes_aoe_rad),
            nuscenes_ave_mps: of(|one| one.nuscenes_ave_mps),
            nds_without_attributes: of(|one| one.nds_without_attributes),
        }
    }
}
