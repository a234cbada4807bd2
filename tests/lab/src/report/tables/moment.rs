//! The paper's Fig. 5: one keyframe under each method.

use crate::data::fused_box::FusedBox;
use crate::report::plot::comparison::Comparison;
use crate::report::plot::scene::{BevScene, FusedMark, SceneAgent, TrueBox};
use crate::report::table::Table;
use crate::score::keyframes::moment::{Moment, Shown, ShownMethod};
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorKind;

/// What each method made of the keyframe.
pub(crate) fn table(shown: Option<&Shown>) -> Table {
    let row = |objects: usize, ShownMethod { key, boxes, gospa_m }: &ShownMethod| {
        vec![key.clone(), boxes.len().to_string(), objects.to_string(), format!("{gospa_m:.2}")]
    };
    let rows = shown.map_or_else(Vec::new, |shown| {
        let objects = shown.truth.iter().filter(|(_, is_in_view)| *is_in_view).count();
        shown.methods.iter().map(|method| row(objects, method)).collect()
    });
    Table { header: ["method", "boxes", "objects", "GOSPA m"].map(str::to_owned).into(), rows }
}

/// The keyframe, and why it was chosen.
pub(crate) fn which(shown: &Shown) -> String {
    let Shown { scene, frame, of, .. } = shown;
    let methods = || {
        let name = |method: Option<&ShownMethod>| method.map(|method| method.key.clone()).unwrap_or_default();
        format!("{} and {}", name(shown.methods.first()), name(shown.methods.last()))
    };
    let why = match &shown.moment {
        Moment::LargestDifference => {
            format!(": of {of} keyframes the one in which {} differ most (by GOSPA)", methods())
        }
        Moment::Typical => format!(": {} differ as in the median of {of} keyframes (by GOSPA)", methods()),
        Moment::Keyframe { .. } => String::new(),
    };
    format!("{scene}, keyframe {frame} at {:.1} s{why}", shown.at.as_secs_f64())
}

/// The picture.
pub(crate) fn comparison(shown: &Shown, title: String) -> Comparison {
    let scenes = shown.methods.iter().map(|method| (method.key.clone(), scene(shown, method)));
    Comparison { title, subtitle: which(shown), scenes: scenes.collect() }
}

fn scene(shown: &Shown, method: &ShownMethod) -> BevScene {
    let truth = |(one, is_covered): &(crate::data::scene::TrueBox, bool)| TrueBox {
        bev: one.bev,
        class: one.class,
        is_covered: *is_covered,
    };
    let agents = shown.reports.iter().zip(["agent-1", "agent-2"]).map(|(report, name)| SceneAgent {
        id: AgentId::new(name).expect("a legal name"),
        kind: Some(SensorKind::Vehicle),
        pose: Some(report.pose),
        detections: report.detections.iter().map(|detection| detection.bev).collect(),
        offset: None,
    });
    let mark = |one: &FusedBox| FusedMark {
        bev: one.bev,
        class: one.class,
        words: format!("{}, existence {:.2}", one.class, one.existence),
    };
    BevScene {
        truth: shown.truth.iter().map(truth).collect(),
        agents: agents.collect(),
        fused: method.boxes.iter().map(mark).collect(),
        ..BevScene::default()
    }
}
