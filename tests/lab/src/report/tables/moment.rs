//! The paper's Fig. 5: one keyframe under each method.

use crate::report::plot::comparison::Comparison;
use crate::report::plot::scene::{BevScene, SceneAgent, TrueBox};
use crate::report::plot::sheet::Sheet;
use crate::score::keyframes::moment::{Moment, Shown, ShownMethod};
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorKind;

/// Which keyframe it is, and what each method made of it.
pub(crate) fn text(shown: &Shown) -> String {
    let objects = shown.truth.iter().filter(|(_, is_in_view)| *is_in_view).count();
    let methods = shown.methods.iter().map(|ShownMethod { key, boxes, gospa_m }| {
        format!("{key}: {} boxes of {objects} objects, GOSPA {gospa_m:.2} m", boxes.len())
    });
    format!("{}\n{}", which(shown), methods.collect::<Vec<_>>().join("\n"))
}

/// The keyframe, and why it was chosen.
fn which(shown: &Shown) -> String {
    let Shown { scene, frame, of, .. } = shown;
    let methods = || {
        let name = |method: Option<&ShownMethod>| method.map(|method| method.key.clone()).unwrap_or_default();
        format!("{} and {}", name(shown.methods.first()), name(shown.methods.last()))
    };
    let why = match &shown.moment {
        Moment::Telling => {
            format!(": of {of} keyframes the one in which {} differ most (by GOSPA)", methods())
        }
        Moment::Typical => format!(": {} differ as in the median of {of} keyframes (by GOSPA)", methods()),
        Moment::Keyframe { .. } => String::new(),
    };
    format!("{scene}, keyframe {frame} at {:.1} s{why}", shown.at.as_secs_f64())
}

/// The picture.
pub(crate) fn sheet(shown: &Shown, title: String) -> Sheet {
    let scenes = shown.methods.iter().map(|method| (method.key.clone(), scene(shown, method)));
    Comparison { title, subtitle: which(shown), scenes: scenes.collect() }.sheet()
}

fn scene(shown: &Shown, method: &ShownMethod) -> BevScene {
    let truth = shown.truth.iter().map(|(one, is_covered)| TrueBox { bev: one.bev, is_covered: *is_covered });
    let agents = shown.reports.iter().zip(["agent-1", "agent-2"]).map(|(report, name)| SceneAgent {
        id: AgentId::new(name).expect("a legal name"),
        kind: SensorKind::Vehicle,
        pose: Some(report.pose),
        detections: report.detections.iter().map(|detection| detection.bev).collect(),
        offset: None,
    });
    BevScene {
        truth: truth.collect(),
        agents: agents.collect(),
        fused: method.boxes.iter().map(|one| one.bev).collect(),
        ..BevScene::default()
    }
}
