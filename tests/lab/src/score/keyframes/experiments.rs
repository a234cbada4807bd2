//! Experiments: methods over many scenes and trials, on several threads.

use crate::data::noise::{NoisePair, Realisation};
use crate::data::observation::Protocol;
use crate::data::scene::Scene;
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::engine_run::{KeyframeOutput, Refused};
use crate::drive::keyframes::setting::{SceneTrial, Setting};
use crate::drive::parallel;
use crate::score::keyframes::method_score::MethodScore;
use crate::score::keyframes::scored_keyframe::ScoredKeyframe;

/// A setting, and the methods that are compared in it. All get the same errors.
#[derive(Clone, Debug)]
pub(crate) struct Experiment {
    /// Noise and conditions of detections.
    pub setting: Setting,
    /// The compared methods.
    pub contenders: Vec<Contender>,
}

/// A set of experiments.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// The experiments.
    pub experiments: Vec<Experiment>,
    /// Number of realisations of the noise.
    pub trials: u32,
    /// The seed of all trials.
    pub seed: u64,
    /// Number of threads. It does not change the results.
    pub threads: usize,
}

/// A method failed on a scene.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{method} on {scene}, {}", .noise.name())]
pub struct RunError {
    method: String,
    scene: String,
    noise: NoisePair,
    source: Box<Refused>,
}

/// Scores by experiment, trial, scene, contender.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scores {
    n_trials: usize,
    n_scenes: usize,
    by_task: Vec<Vec<MethodScore>>,
}

/// Which scores: the places of an experiment in the plan, and of a contender in that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell {
    /// Place of the experiment.
    pub experiment: usize,
    /// Place of the contender.
    pub contender: usize,
}

impl Scores {
    /// The score of one scene in one trial.
    pub(crate) fn scene(&self, cell: Cell, trial: usize, scene: usize) -> &MethodScore {
        &self.by_task[(cell.experiment * self.n_trials + trial) * self.n_scenes + scene][cell.contender]
    }

    /// The score of all scenes in one trial.
    pub(crate) fn trial(&self, cell: Cell, trial: usize) -> MethodScore {
        let mut total = MethodScore::default();
        (0..self.n_scenes).for_each(|scene| total.merge(self.scene(cell, trial, scene)));
        total
    }

    /// Number of trials.
    pub(crate) const fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// Number of scenes.
    pub(crate) const fn n_scenes(&self) -> usize {
        self.n_scenes
    }
}

/// One trial of one scene.
#[derive(Clone, Copy, Debug)]
struct Task {
    experiment: usize,
    trial: u32,
    scene: usize,
}

impl Plan {
    /// The places of a setting, and of a contender in it.
    pub(crate) fn cell(&self, setting: Setting, key: &str) -> Option<Cell> {
        let experiment = self.experiments.iter().position(|one| one.setting == setting)?;
        let contenders = &self.experiments[experiment].contenders;
        let contender = contenders.iter().position(|one| one.key() == key)?;
        Some(Cell { experiment, contender })
    }

    /// Computes all scores. After every finished part `progress` gets the number of finished parts and of all parts.
    pub(crate) fn run(
        &self,
        scenes: &[Scene],
        progress: impl FnMut(usize, usize),
    ) -> Result<Scores, RunError> {
        let tasks = self.tasks(scenes.len());
        let scores = |place: usize| self.scores(&scenes[tasks[place].scene], tasks[place]);
        let by_task = parallel::map(tasks.len(), self.threads, scores, progress)?;
        Ok(Scores { n_trials: self.trials as usize, n_scenes: scenes.len(), by_task })
    }

    /// All tasks by experiment, trial and scene.
    fn tasks(&self, n_scenes: usize) -> Vec<Task> {
        let trials = |experiment| (0..self.trials).map(move |trial| (experiment, trial));
        let scenes = |(experiment, trial)| (0..n_scenes).map(move |scene| Task { experiment, trial, scene });
        (0..self.experiments.len()).flat_map(trials).flat_map(scenes).collect()
    }

    /// The scores of all contenders on one scene.
    fn scores(&self, scene: &Scene, task: Task) -> Result<Vec<MethodScore>, RunError> {
        let Task { experiment, trial, .. } = task;
        let Experiment { setting, contenders } = &self.experiments[experiment];
        let contenders: Vec<&Contender> = contenders.iter().collect();
        let mut scores = vec![MethodScore::default(); contenders.len()];
        self.run_scene(scene, (*setting, trial), &contenders, |place, keyframe| scores[place].add(keyframe))?;
        Ok(scores)
    }

    /// Runs contenders on a scene. `visit` gets every keyframe of each, with the contender's place.
    pub(super) fn run_scene(
        &self,
        scene: &Scene,
        (setting, trial): (Setting, u32),
        contenders: &[&Contender],
        mut visit: impl FnMut(usize, &ScoredKeyframe<'_>),
    ) -> Result<(), RunError> {
        let Setting { noise, shape, conditions } = setting;
        let realisation = Realisation { seed: self.seed, trial };
        let protocol = Protocol { noise, shape, conditions, realisation };
        let trial_of_scene = SceneTrial { noise, conditions, trial, scene: &scene.name };
        let mut fusers: Vec<_> = contenders.iter().map(|one| one.begin(&trial_of_scene)).collect();
        let views: Vec<Vec<bool>> =
            (0..scene.keyframes.len()).map(|frame| protocol.is_in_view(scene, frame)).collect();
        let mut visit_all = |place: usize, outputs: Vec<KeyframeOutput>| {
            for KeyframeOutput { frame, boxes } in outputs {
                visit(place, &ScoredKeyframe::new(scene, frame, &views[frame], &boxes));
            }
        };
        for (frame, keyframe) in scene.keyframes.iter().enumerate() {
            let reports = protocol.observe(scene, frame);
            for (place, fuser) in fusers.iter_mut().enumerate() {
                let outputs = fuser.fuse(&reports, (frame, keyframe.at)).map_err(|source| {
                    let (method, scene) = (contenders[place].key().to_owned(), scene.name.clone());
                    RunError { method, scene, noise, source: Box::new(source) }
                })?;
                visit_all(place, outputs);
            }
        }
        for (place, fuser) in fusers.iter_mut().enumerate() {
            visit_all(place, fuser.finish());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::conditions::Conditions;
    use crate::data::dataset::synthetic;
    use crate::data::noise::Shape;
    use crate::data::scene::Keyframe;
    use crate::data::test_scenes::parking;
    use crate::drive::keyframes::method::Method;
    use crate::score::keyframes::counting::{Counting, Subset};
    use crate::score::moments::Moments;
    use std::f64::consts::PI;

    fn experiment(noise: NoisePair, methods: &[Method]) -> Experiment {
        let setting = Setting { noise, shape: Shape::Gaussian, conditions: Conditions::Paper };
        Experiment { setting, contenders: methods.iter().copied().map(Contender::Method).collect() }
    }

    const FIRST: Cell = Cell { experiment: 0, contender: 0 };

    fn plan(threads: usize) -> Plan {
        let methods = [Method::Single1, Method::CsbaWls, Method::Ours];
        let experiment = |noise| experiment(noise, &methods);
        Plan {
            experiments: [NoisePair::N1N1, NoisePair::N1N3].map(experiment).to_vec(),
            trials: 2,
            seed: 7,
            threads,
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let scenes = [parking(4), parking(2), parking(3)];
        let one = plan(1).run(&scenes, |_, _| {}).unwrap();
        assert_eq!(one, plan(4).run(&scenes, |_, _| {}).unwrap());
    }

    #[test]
    fn trials_differ_and_progress_reaches_the_end() {
        let mut last = (0, 0);
        let scores = plan(2).run(&[parking(2)], |done, of| last = (done, of)).unwrap();
        assert_eq!(last, (4, 4));
        let ate = |trial| scores.trial(FIRST, trial).of(Subset::All).metrics(Counting::Table)[0].mean();
        assert_ne!(ate(0), ate(1));
    }

    #[test]
    fn the_errors_of_a_single_detector_equal_the_closed_forms() {
        // The mean length of a normal in the plane is √(π/2) σ, on a line √(2/π) σ; σ at the true range.
        let scenes: Vec<Scene> = (0..150).step_by(6).map(synthetic::scene).collect();
        for noise in NoisePair::ALL {
            let model = noise.levels()[0].model();
            let over_frames = |sigma: &dyn Fn(f64) -> f64| {
                let keyframes = scenes.iter().flat_map(|scene| &scene.keyframes);
                let means = keyframes.filter_map(|Keyframe { ego, objects, .. }| {
                    let sigmas = objects.iter().map(|one| sigma(ego.distance_to(one.bev.x, one.bev.y)));
                    sigmas.collect::<Moments>().mean()
                });
                means.collect::<Moments>().mean().unwrap()
            };
            let expected = [
                libm::sqrt(PI / 2.0) * over_frames(&|range_m| model.position_sigma_m(range_m)),
                libm::sqrt(2.0 / PI) * over_frames(&|range_m| model.yaw_sigma_rad(range_m)).to_degrees(),
            ];
            let plan = Plan { experiments: vec![experiment(noise, &[Method::Single1])], ..plan(2) };
            let scores = plan.run(&scenes, |_, _| {}).unwrap();
            let mut both = scores.trial(FIRST, 0);
            both.merge(&scores.trial(FIRST, 1));
            let metrics = both.of(Subset::All).metrics(Counting::Table).map(|metric| metric.mean().unwrap());
            for (ours, expected) in [metrics[0], metrics[2]].into_iter().zip(expected) {
                assert!((ours / expected - 1.0).abs() < 0.02, "{noise:?}: {ours}, expected {expected}");
            }
            assert_eq!((metrics[3], metrics[4]), (1.0, 1.0));
        }
    }

    #[test]
    fn fusing_two_agents_is_more_accurate_than_one_agent() {
        let scores = plan(2).run(&[parking(30)], |_, _| {}).unwrap();
        let ate = |method| {
            scores.trial(Cell { contender: method, ..FIRST }, 0).of(Subset::All).metrics(Counting::Table)[0]
                .mean()
        };
        assert!(ate(1) < ate(0), "least squares over one agent");
        assert!(ate(2) < ate(1), "memory over least squares");
    }
}
