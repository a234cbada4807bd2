//! One keyframe under several methods, for the paper's qualitative figure: a given one, or one that is chosen by how much the
//! methods differ in it.

use crate::data::fused_box::FusedBox;
use crate::data::noise::Realisation;
use crate::data::observation::{AgentReport, Protocol};
use crate::data::scene::{Scene, TrueBox};
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::setting::Setting;
use crate::drive::parallel;
use crate::score::gospa::gospa;
use crate::score::keyframes::experiments::{Plan, RunError};
use crate::score::keyframes::scored_keyframe::ScoredKeyframe;
use crate::score::keyframes::trackers::GOSPA_CUTOFF_M;
use std::fmt;
use std::str::FromStr;
use v2x_common::geometry::BevBox;
use v2x_common::time::Span;
use v2x_fusion_hub::association::assignment::Assigner;

/// Of the trials, the one that is shown.
const TRIAL: u32 = 0;

/// Which keyframe.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Moment {
    /// The one with the largest difference between the first and the last method, in GOSPA.
    #[default]
    LargestDifference,
    /// The one with the median difference.
    Typical,
    /// This keyframe of this scene, counted from 0.
    Keyframe {
        /// The scene's name.
        scene: String,
        /// Its keyframe.
        frame: usize,
    },
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LargestDifference => f.write_str("telling"),
            Self::Typical => f.write_str("typical"),
            Self::Keyframe { scene, frame } => write!(f, "{scene}:{frame}"),
        }
    }
}

/// A text that names no moment.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0:?} is none of telling, typical, and SCENE:KEYFRAME such as scene-0003:12")]
pub struct NoMoment(String);

impl FromStr for Moment {
    type Err = NoMoment;

    fn from_str(text: &str) -> Result<Self, NoMoment> {
        match text {
            "telling" => Ok(Self::LargestDifference),
            "typical" => Ok(Self::Typical),
            _ => {
                let parts = text.rsplit_once(':').filter(|(scene, _)| !scene.is_empty());
                let parts = parts.and_then(|(scene, frame)| Some((scene.to_owned(), frame.parse().ok()?)));
                let (scene, frame) = parts.ok_or_else(|| NoMoment(text.to_owned()))?;
                Ok(Self::Keyframe { scene, frame })
            }
        }
    }
}

/// A keyframe under several methods.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    /// Noise and conditions of detections.
    pub setting: Setting,
    /// Its scene.
    pub scene: String,
    /// Its place in the scene.
    pub frame: usize,
    /// Since the scene's start.
    pub at: Span,
    /// How many keyframes there are to choose from.
    pub of: usize,
    /// How it was chosen.
    pub moment: Moment,
    /// The true objects, and whether any agent covers them.
    pub truth: Vec<(TrueBox, bool)>,
    /// What the agents reported.
    pub reports: [AgentReport; 2],
    /// What the methods published.
    pub methods: Vec<ShownMethod>,
}

/// What a method published.
#[derive(Clone, Debug)]
pub(crate) struct ShownMethod {
    /// Its name in tables.
    pub key: String,
    /// Its boxes.
    pub boxes: Vec<FusedBox>,
    /// GOSPA of positions (p 2, α 2, cut-off 5 m), m.
    pub gospa_m: f64,
}

/// No keyframe can be shown.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum ShowError {
    /// A method failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The data set has no such scene.
    #[error("--moment {moment}: there is no scene {scene:?}; there are {}", listed(.known))]
    NoScene {
        /// What was asked for.
        moment: Moment,
        /// The scene in it.
        scene: String,
        /// The scenes of the data set.
        known: Vec<String>,
    },
    /// The scene is shorter.
    #[error("--moment {moment}: the scene has {n} keyframes, from 0 to {}", .n.saturating_sub(1))]
    NoFrame {
        /// What was asked for.
        moment: Moment,
        /// Number of keyframes.
        n: usize,
    },
    /// Nothing to choose from.
    #[error("no keyframe has an object in view of an agent")]
    Empty,
}

/// At most eight names.
fn listed(names: &[String]) -> String {
    let shown = names.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
    let more = names.len().saturating_sub(8);
    if more == 0 { shown } else { format!("{shown} and {more} more") }
}

/// A keyframe with the GOSPA of each method, m.
struct Rated {
    scene: usize,
    frame: usize,
    gospa_m: Vec<f64>,
}

impl Rated {
    /// How much worse the first method is than the last one; of a single method, how bad.
    fn difference_m(&self) -> f64 {
        match self.gospa_m.as_slice() {
            [] => 0.0,
            [only] => *only,
            [first, .., last] => first - last,
        }
    }
}

impl Plan {
    /// The keyframe under these methods, with the plan's seed.
    pub(crate) fn show(
        &self,
        scenes: &[Scene],
        (setting, contenders): (Setting, &[Contender]),
        moment: &Moment,
    ) -> Result<Shown, ShowError> {
        let of = scenes.iter().map(|scene| scene.keyframes.len()).sum();
        let (scene, frame) = self.choose(scenes, (setting, contenders), moment)?;
        let scene = &scenes[scene];
        let mut methods: Vec<ShownMethod> = Vec::new();
        let mut truth = Vec::new();
        self.visit(scene, (setting, contenders), |place, keyframe, gospa_m| {
            if keyframe.frame == frame {
                let in_view = keyframe.is_in_view().iter().copied();
                truth = keyframe.truth.iter().copied().zip(in_view).collect();
                methods.push(ShownMethod {
                    key: contenders[place].key().to_owned(),
                    boxes: keyframe.boxes.to_vec(),
                    gospa_m,
                });
            }
        })?;
        let place_of = |method: &ShownMethod| contenders.iter().position(|one| one.key() == method.key);
        methods.sort_by_key(place_of);
        let Setting { noise, shape, conditions } = setting;
        let realisation = Realisation { seed: self.seed, trial: TRIAL };
        let reports = Protocol { noise, shape, conditions, realisation }.observe(scene, frame);
        let at = scene.keyframes[frame].at;
        let (scene, moment) = (scene.name.clone(), moment.clone());
        Ok(Shown { setting, scene, frame, at, of, moment, truth, reports, methods })
    }

    /// The places of scene and keyframe.
    fn choose(
        &self,
        scenes: &[Scene],
        what: (Setting, &[Contender]),
        moment: &Moment,
    ) -> Result<(usize, usize), ShowError> {
        if let Moment::Keyframe { scene: name, frame } = moment {
            let Some(place) = scenes.iter().position(|scene| scene.name == *name) else {
                let known = scenes.iter().map(|scene| scene.name.clone()).collect();
                return Err(ShowError::NoScene { moment: moment.clone(), scene: name.clone(), known });
            };
            let n = scenes[place].keyframes.len();
            return if *frame < n {
                Ok((place, *frame))
            } else {
                Err(ShowError::NoFrame { moment: moment.clone(), n })
            };
        }
        let work = |place: usize| self.rate(&scenes[place], place, what);
        let rated = parallel::map(scenes.len(), self.threads, work, |_, _| {})?;
        let mut rated: Vec<Rated> = rated.into_iter().flatten().collect();
        rated.sort_by(|a, b| b.difference_m().total_cmp(&a.difference_m()));
        let place = if *moment == Moment::LargestDifference { 0 } else { rated.len() / 2 };
        rated.get(place).map(|one| (one.scene, one.frame)).ok_or(ShowError::Empty)
    }

    /// Every keyframe of a scene that has objects in view.
    fn rate(
        &self,
        scene: &Scene,
        place: usize,
        what: (Setting, &[Contender]),
    ) -> Result<Vec<Rated>, RunError> {
        let blank = |frame| Rated { scene: place, frame, gospa_m: vec![0.0; what.1.len()] };
        let mut rated: Vec<Rated> = (0..scene.keyframes.len()).map(blank).collect();
        let mut has_objects = vec![false; rated.len()];
        self.visit(scene, what, |method, keyframe, gospa_m| {
            rated[keyframe.frame].gospa_m[method] = gospa_m;
            has_objects[keyframe.frame] = keyframe.objects().next().is_some();
        })?;
        let mut has_objects = has_objects.into_iter();
        rated.retain(|_| has_objects.next() == Some(true));
        Ok(rated)
    }

    /// Every keyframe of every method, with the method's place and the GOSPA.
    fn visit(
        &self,
        scene: &Scene,
        (setting, contenders): (Setting, &[Contender]),
        mut visit: impl FnMut(usize, &ScoredKeyframe<'_>, f64),
    ) -> Result<(), RunError> {
        let contenders: Vec<_> = contenders.iter().collect();
        let mut assigner = Assigner::default();
        self.run_scene(scene, (setting, TRIAL), &contenders, |place, keyframe| {
            let boxes: Vec<BevBox> = keyframe.counted_boxes().map(|one| one.bev).collect();
            let objects: Vec<BevBox> = keyframe.objects().map(|one| one.bev).collect();
            let gospa_m = gospa(&boxes, &objects, GOSPA_CUTOFF_M, &mut assigner).distance_m();
            visit(place, keyframe, gospa_m);
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::conditions::Conditions;
    use crate::data::dataset::synthetic;
    use crate::data::noise::{NoisePair, Shape};
    use crate::drive::keyframes::method::Method;

    const SETTING: Setting =
        Setting { noise: NoisePair::N1N3, shape: Shape::Gaussian, conditions: Conditions::Paper };

    fn shown(moment: &Moment) -> Result<Shown, ShowError> {
        let contenders = [Method::Nms, Method::Ours].map(Contender::Method);
        let plan = Plan { experiments: Vec::new(), trials: 1, seed: 3, threads: 2 };
        plan.show(&[3, 40].map(synthetic::scene), (SETTING, &contenders), moment)
    }

    fn difference_m(shown: &Shown) -> f64 {
        shown.methods[0].gospa_m - shown.methods[1].gospa_m
    }

    #[test]
    fn the_moment_of_the_largest_difference_differs_more_than_the_typical_one_and_than_any_other() {
        let largest = shown(&Moment::LargestDifference).unwrap();
        let typical = shown(&Moment::Typical).unwrap();
        assert!(difference_m(&largest) > difference_m(&typical));
        let n_keyframes = [3, 40].map(|place| synthetic::scene(place).keyframes.len());
        assert_eq!(largest.of, n_keyframes.iter().sum::<usize>());
        for frame in [0, 7, 20] {
            let scene = largest.scene.clone();
            let other = shown(&Moment::Keyframe { scene, frame }).unwrap();
            assert!(difference_m(&other) <= difference_m(&largest));
        }
    }

    #[test]
    fn a_moment_holds_what_agents_reported_and_what_each_method_published_then() {
        let scene = synthetic::scene(40);
        let moment = Moment::Keyframe { scene: scene.name.clone(), frame: 5 };
        let shown = shown(&moment).unwrap();
        let keyframe = &scene.keyframes[5];
        assert_eq!((shown.at, shown.truth.len()), (keyframe.at, keyframe.objects.len()));
        assert!(shown.reports.iter().all(|report| report.detections.len() == keyframe.objects.len()));
        let n_boxes: Vec<_> = shown.methods.iter().map(|method| method.boxes.len()).collect();
        assert!(n_boxes[1] >= keyframe.objects.len() && n_boxes[0] > n_boxes[1], "{n_boxes:?}");
    }

    #[test]
    fn a_scene_or_keyframe_that_is_not_there_is_named_with_what_is() {
        let error = |text: &str| shown(&text.parse().unwrap()).unwrap_err().to_string();
        let name = synthetic::scene(3).name;
        assert!(error("nowhere:3").contains(&name), "{}", error("nowhere:3"));
        assert!(error(&format!("{name}:999")).contains("from 0 to"));
        assert!("scene-1".parse::<Moment>().unwrap_err().to_string().contains("SCENE:KEYFRAME"));
    }
}
