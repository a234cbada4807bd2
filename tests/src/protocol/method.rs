//! The compared methods, and what each is told.

use super::counting::Prediction;
use super::engine_run::{Answer, EngineRun, Refused, Setup};
use super::noise::NoisePair;
use super::observe::AgentReport;
use serde::Serialize;
use v2x_agent::truth::ObjectId;
use v2x_common::detection::Detection;
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Span;
use v2x_fusion_hub::baselines::{Fused, Member, Report, Rule, Ties, dair_v2x, infradet3d};
use v2x_fusion_hub::config::Preset;
use v2x_fusion_hub::sensing::{Sensing, SensingDefaults};

/// A row of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Agent 1 alone
    #[serde(rename = "single-1")]
    #[value(name = "single-1")]
    Single1,
    /// Non-maximum suppression by IoU
    Nms,
    /// Non-maximum suppression by GIoU
    NmsGiou,
    /// Promotion-suppression aggregation, ties kept
    Psa,
    /// Weighted box fusion
    Wbf,
    /// InfraDet3D-Late as the paper's rows have it
    #[serde(rename = "infradet3d")]
    #[value(name = "infradet3d")]
    InfraDet3d,
    /// InfraDet3D-Late as its authors' code has it
    #[serde(rename = "infradet3d-code")]
    #[value(name = "infradet3d-code")]
    InfraDet3dCode,
    /// DAIR-V2X-Late as the paper's rows have it
    #[serde(rename = "dair-v2x")]
    #[value(name = "dair-v2x")]
    DairV2x,
    /// DAIR-V2X-Late as its authors' code has it
    #[serde(rename = "dair-v2x-code")]
    #[value(name = "dair-v2x-code")]
    DairV2xCode,
    /// CSBA association, weighted least squares
    CsbaWls,
    /// The same, told how sizes err
    CsbaWlsDebiased,
    /// CSBA+WLS in every frame, then a constant-velocity Kalman filter
    CsbaWlsCv,
    /// DAIR-V2X-Late in every frame, then a constant-velocity Kalman filter
    #[serde(rename = "dair-v2x-cv")]
    #[value(name = "dair-v2x-cv")]
    DairV2xCv,
    /// UniKF as in the paper, with late data replayed
    UnikfPaper,
    /// Our engine
    Ours,
    /// Our engine, told half a second later: the keyframe after it counts, too
    #[serde(rename = "ours-lag-0.5s")]
    #[value(name = "ours-lag-0.5s")]
    OursLagHalf,
    /// Our engine, told a second later: the two keyframes after it count, too
    #[serde(rename = "ours-lag-1s")]
    #[value(name = "ours-lag-1s")]
    OursLag1,
    /// Our engine, agent 1 alone
    #[serde(rename = "single-1-ours")]
    #[value(name = "single-1-ours")]
    Single1Ours,
    /// Our engine with every association true: a ceiling
    OursTrueId,
}

/// What a method is given apart from boxes and classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Told {
    sigma: bool,
    past: bool,
    later: bool,
    class_prior: bool,
    size_law: bool,
    truth: bool,
}

impl Method {
    /// The rows of Table II, in its order.
    pub const TABLE_II: [Self; 19] = [
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
        Self::CsbaWlsDebiased,
        Self::CsbaWlsCv,
        Self::DairV2xCv,
        Self::UnikfPaper,
        Self::Ours,
        Self::OursLagHalf,
        Self::OursLag1,
        Self::Single1Ours,
        Self::OursTrueId,
    ];

    /// Its name in tables.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Single1 => "single-1",
            Self::Nms => "nms",
            Self::NmsGiou => "nms-giou",
            Self::Psa => "psa",
            Self::Wbf => "wbf",
            Self::InfraDet3d => "infradet3d",
            Self::InfraDet3dCode => "infradet3d-code",
            Self::DairV2x => "dair-v2x",
            Self::DairV2xCode => "dair-v2x-code",
            Self::CsbaWls => "csba-wls",
            Self::CsbaWlsDebiased => "csba-wls-debiased",
            Self::CsbaWlsCv => "csba-wls-cv",
            Self::DairV2xCv => "dair-v2x-cv",
            Self::UnikfPaper => "unikf-paper",
            Self::Ours => "ours",
            Self::OursLagHalf => "ours-lag-0.5s",
            Self::OursLag1 => "ours-lag-1s",
            Self::Single1Ours => "single-1-ours",
            Self::OursTrueId => "ours-true-id",
        }
    }

    /// What it is told apart from boxes and classes, in words.
    pub fn told(self) -> String {
        let Told { sigma, past, later, class_prior, size_law, truth } = self.given();
        let parts = [
            (sigma, "σ"),
            (past, "past frames"),
            (later, "later frames"),
            (class_prior, "class prior"),
            (size_law, "size law"),
            (truth, "true identities"),
        ];
        let parts: Vec<&str> = parts.iter().filter(|(is_told, _)| *is_told).map(|(_, name)| *name).collect();
        parts.join(", ")
    }

    fn given(self) -> Told {
        let sigma = Told { sigma: true, ..Told::default() };
        let ours = Told { past: true, class_prior: true, size_law: true, ..sigma };
        match self {
            Self::CsbaWls => sigma,
            Self::CsbaWlsDebiased => Told { size_law: true, ..sigma },
            Self::CsbaWlsCv | Self::DairV2xCv | Self::UnikfPaper => Told { past: true, ..sigma },
            Self::Ours | Self::Single1Ours => ours,
            Self::OursLagHalf | Self::OursLag1 => Told { later: true, ..ours },
            Self::OursTrueId => Told { truth: true, ..ours },
            _ => Told::default(),
        }
    }

    /// Made ready for one scene.
    pub fn begin(self, noise: NoisePair) -> Fuser {
        let overlap = noise.overlap_threshold();
        let raw = || sensing(noise, false);
        let rule = |rule| Fuser::Rule(rule, raw());
        let ours = Setup {
            preset: Preset::Ours,
            declares_size_law: true,
            n_agents: 2,
            true_identities: false,
            lag: Span::ZERO,
        };
        let paper = Setup { preset: Preset::Paper, declares_size_law: false, ..ours };
        let filtered = |rule| {
            let run = EngineRun::new(Setup { n_agents: 1, ..paper }, noise.levels());
            Fuser::Filtered(rule, raw(), Box::new(run))
        };
        let engine = |setup| Fuser::Engine(Box::new(EngineRun::new(setup, noise.levels())));
        match self {
            Self::Single1 => rule(Rule::Single(0)),
            Self::Nms => rule(Rule::Nms { overlap }),
            Self::NmsGiou => rule(Rule::NmsGiou { overlap }),
            Self::Psa => rule(Rule::Psa(Ties::Kept)),
            Self::Wbf => rule(Rule::Wbf { overlap }),
            Self::InfraDet3d => rule(Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize)),
            Self::InfraDet3dCode => rule(Rule::InfraDet3d(infradet3d::Merge::MeanBoxFirstHeading)),
            Self::DairV2x => rule(Rule::DairV2x(dair_v2x::Variant::Average)),
            Self::DairV2xCode => rule(Rule::DairV2x(dair_v2x::Variant::MainAgent)),
            Self::CsbaWls => rule(Rule::CsbaWls),
            Self::CsbaWlsDebiased => Fuser::Rule(Rule::CsbaWls, sensing(noise, true)),
            Self::CsbaWlsCv => filtered(Rule::CsbaWls),
            Self::DairV2xCv => filtered(Rule::DairV2x(dair_v2x::Variant::Average)),
            Self::UnikfPaper => engine(paper),
            Self::Ours => engine(ours),
            Self::OursLagHalf => engine(Setup { lag: Span::from_millis(500), ..ours }),
            Self::OursLag1 => engine(Setup { lag: Span::from_millis(1000), ..ours }),
            Self::Single1Ours => engine(Setup { n_agents: 1, ..ours }),
            Self::OursTrueId => engine(Setup { true_identities: true, ..ours }),
        }
    }
}

/// How both agents' reports are read: as they stand, or with the law of their sizes taken out.
fn sensing(noise: NoisePair, is_debiased: bool) -> [Sensing; 2] {
    let defaults = SensingDefaults::default();
    noise.levels().map(|level| {
        let size_noise = is_debiased.then(|| level.model().size);
        let description = SensorDescription { size_noise, ..super::engine_run::DESCRIPTION };
        Sensing::described(&description, &defaults)
    })
}

/// A method at work on one scene.
#[derive(Debug)]
pub enum Fuser {
    /// Without memory.
    Rule(Rule, [Sensing; 2]),
    /// Without memory, and then a filter that takes the fused list for one agent's report.
    Filtered(Rule, [Sensing; 2], Box<EngineRun>),
    /// With memory.
    Engine(Box<EngineRun>),
}

impl Fuser {
    /// Takes in a keyframe, of this number and time in the scene; tells what is there, and with a lag what was there
    /// in earlier ones.
    pub fn fuse(
        &mut self,
        reports: &[AgentReport; 2],
        (frame, at): (usize, Span),
    ) -> Result<Vec<Answer>, Refused> {
        match self {
            Self::Rule(rule, sensing) => {
                let fused = fuse_by_rule(rule, sensing, reports);
                let prediction =
                    |one: &Fused| Prediction { bev: one.bev(), object: scored_as(one, reports).0 };
                Ok(vec![Answer { frame, told: fused.iter().map(prediction).collect() }])
            }
            Self::Filtered(rule, sensing, run) => {
                let fused = fuse_by_rule(rule, sensing, reports);
                run.fuse(&[as_report(&fused, reports)], at)
            }
            Self::Engine(run) => run.fuse(reports, at),
        }
    }

    /// At the end of a scene: what was there in the keyframes that are not answered yet.
    pub fn finish(&mut self) -> Vec<Answer> {
        match self {
            Self::Rule(..) => Vec::new(),
            Self::Filtered(_, _, run) | Self::Engine(run) => run.finish(),
        }
    }
}

fn fuse_by_rule(rule: &Rule, sensing: &[Sensing; 2], reports: &[AgentReport; 2]) -> Vec<Fused> {
    let read = |place: usize| -> Vec<Report> {
        let detections = reports[place].detections.iter();
        let report = |one| Report { z: sensing[place].measurement(one), score: one.score };
        detections.map(report).collect()
    };
    let (first, second) = (read(0), read(1));
    rule.fuse(&[&first, &second])
}

/// Place and number of the object that a fused box is scored against: agent 1's detection in it decides, else
/// agent 2's.
fn scored_as(fused: &Fused, reports: &[AgentReport; 2]) -> (usize, ObjectId) {
    let Member { agent, index } = *fused.members.iter().min().expect("a fused box is of something");
    (reports[agent].objects[index], reports[agent].identities[index])
}

/// A fused list as if agent 1 had reported it.
fn as_report(fused: &[Fused], reports: &[AgentReport; 2]) -> AgentReport {
    let detection = |one: &Fused| Detection {
        class: one.z.class,
        score: one.score,
        bev: one.bev(),
        covariance: one.covariance(),
        velocity: None,
        source_track: None,
    };
    let (objects, identities) = fused.iter().map(|one| scored_as(one, reports)).unzip();
    let detections = fused.iter().map(detection).collect();
    AgentReport { pose: reports[0].pose, detections, objects, identities }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_the_names_on_the_command_line_and_in_json() {
        use clap::ValueEnum;
        for method in Method::TABLE_II {
            assert_eq!(method.to_possible_value().unwrap().get_name(), method.key());
            assert_eq!(serde_json::to_string(&method).unwrap(), format!("{:?}", method.key()));
        }
    }

    #[test]
    fn single_frame_rules_without_accuracies_are_told_nothing() {
        assert_eq!(Method::DairV2x.told(), "");
        assert_eq!(Method::Ours.told(), "σ, past frames, class prior, size law");
    }
}
