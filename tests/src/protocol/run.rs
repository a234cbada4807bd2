//! Many scenes, trials and levels of noise, on several threads.

use super::counting::Score;
use super::engine_run::Refused;
use super::method::Method;
use super::noise::{NoisePair, Realisation, Shape};
use super::observe::Protocol;
use super::scene::Scene;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// What is to be computed.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Levels of noise.
    pub noise: Vec<NoisePair>,
    /// The methods; all see the same errors.
    pub methods: Vec<Method>,
    /// Number of realisations of the noise.
    pub trials: u32,
    /// The seed of them all.
    pub seed: u64,
    /// The shape of the errors.
    pub shape: Shape,
    /// Number of threads; of no influence on the results.
    pub threads: usize,
}

/// A method failed on a scene.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{} on {scene}, {}", .method.key(), .noise.name())]
pub struct RunError {
    method: Method,
    scene: String,
    noise: NoisePair,
    source: Box<Refused>,
}

/// Scores by level of noise, trial, scene, method.
#[derive(Clone, Debug, PartialEq)]
pub struct Scores {
    n_trials: usize,
    n_scenes: usize,
    by_task: Vec<Vec<Score>>,
}

impl Scores {
    /// Of one scene in one trial, with the plan's noise and method of these places.
    pub fn scene(&self, (noise, method): (usize, usize), trial: usize, scene: usize) -> &Score {
        &self.by_task[(noise * self.n_trials + trial) * self.n_scenes + scene][method]
    }

    /// Of all scenes in one trial.
    pub fn trial(&self, cell: (usize, usize), trial: usize) -> Score {
        let mut total = Score::default();
        (0..self.n_scenes).for_each(|scene| total.merge(self.scene(cell, trial, scene)));
        total
    }

    /// Number of trials.
    pub const fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// Number of scenes.
    pub const fn n_scenes(&self) -> usize {
        self.n_scenes
    }
}

/// One scene, once.
#[derive(Clone, Copy, Debug)]
struct Task {
    noise: NoisePair,
    trial: u32,
    scene: usize,
}

impl Plan {
    /// Computes all; `progress` is told of every finished part how many of how many are done.
    pub fn run(&self, scenes: &[Scene], mut progress: impl FnMut(usize, usize)) -> Result<Scores, RunError> {
        let tasks = self.tasks(scenes.len());
        let next = AtomicUsize::new(0);
        let (sender, receiver) = mpsc::channel();
        let mut done: Vec<Option<Result<Vec<Score>, RunError>>> = vec![None; tasks.len()];
        std::thread::scope(|scope| {
            for _ in 0..self.threads.max(1) {
                let (sender, next, tasks) = (sender.clone(), &next, &tasks);
                scope.spawn(move || {
                    loop {
                        let place = next.fetch_add(1, Ordering::Relaxed);
                        let Some(task) = tasks.get(place) else { return };
                        let outcome = self.scores(&scenes[task.scene], *task);
                        if outcome.is_err() {
                            next.store(tasks.len(), Ordering::Relaxed);
                        }
                        if sender.send((place, outcome)).is_err() {
                            return;
                        }
                    }
                });
            }
            drop(sender);
            for (finished, (place, outcome)) in (1..).zip(receiver) {
                done[place] = Some(outcome);
                progress(finished, tasks.len());
            }
        });
        // After an error some tasks were never begun.
        let by_task = done.into_iter().flatten().collect::<Result<Vec<_>, _>>()?;
        Ok(Scores { n_trials: self.trials as usize, n_scenes: scenes.len(), by_task })
    }

    /// By noise, trial and scene.
    fn tasks(&self, n_scenes: usize) -> Vec<Task> {
        let trials = |noise| (0..self.trials).map(move |trial| (noise, trial));
        let scenes = |(noise, trial)| (0..n_scenes).map(move |scene| Task { noise, trial, scene });
        self.noise.iter().copied().flat_map(trials).flat_map(scenes).collect()
    }

    /// All methods on one scene, each beginning anew.
    fn scores(&self, scene: &Scene, task: Task) -> Result<Vec<Score>, RunError> {
        let Task { noise, trial, .. } = task;
        let realisation = Realisation { seed: self.seed, trial };
        let protocol = Protocol { noise, shape: self.shape, realisation };
        let mut fusers: Vec<_> = self.methods.iter().map(|method| (*method, method.begin(noise))).collect();
        let mut scores = vec![Score::default(); fusers.len()];
        for (frame, keyframe) in scene.keyframes.iter().enumerate() {
            let reports = protocol.observe(scene, frame);
            for ((method, fuser), score) in fusers.iter_mut().zip(&mut scores) {
                let answers = fuser.fuse(&reports, (frame, keyframe.at)).map_err(|source| {
                    let scene = scene.name.clone();
                    RunError { method: *method, scene, noise, source: Box::new(source) }
                })?;
                answers.iter().for_each(|answer| score.add(&answer.told, scene, answer.frame));
            }
        }
        for ((_, fuser), score) in fusers.iter_mut().zip(&mut scores) {
            fuser.finish().iter().for_each(|answer| score.add(&answer.told, scene, answer.frame));
        }
        Ok(scores)
    }
}

#[cfg(test)]
mod tests {
    use super::super::counting::{Counting, Subset};
    use super::super::moments::Moments;
    use super::super::scene::Keyframe;
    use super::super::testing::parking;
    use super::*;
    use crate::dataset::synthetic;
    use std::f64::consts::PI;

    fn plan(threads: usize) -> Plan {
        Plan {
            noise: vec![NoisePair::N1N1, NoisePair::N1N3],
            methods: vec![Method::Single1, Method::CsbaWls, Method::Ours],
            trials: 2,
            seed: 7,
            shape: Shape::Gaussian,
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
        let ate = |trial| scores.trial((0, 0), trial).of(Subset::All).metrics(Counting::Table)[0].mean();
        assert_ne!(ate(0), ate(1));
    }

    #[test]
    fn a_single_detector_errs_as_the_closed_forms_say() {
        // Of a normal in the plane the mean length is √(π/2) σ, on a line √(2/π) σ; σ at the true range.
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
            let plan = Plan { noise: vec![noise], methods: vec![Method::Single1], ..plan(2) };
            let scores = plan.run(&scenes, |_, _| {}).unwrap();
            let mut both = scores.trial((0, 0), 0);
            both.merge(&scores.trial((0, 0), 1));
            let metrics = both.of(Subset::All).metrics(Counting::Table).map(|metric| metric.mean().unwrap());
            for (ours, expected) in [metrics[0], metrics[2]].into_iter().zip(expected) {
                assert!((ours / expected - 1.0).abs() < 0.02, "{noise:?}: {ours}, expected {expected}");
            }
            assert_eq!((metrics[3], metrics[4]), (1.0, 1.0));
        }
    }

    #[test]
    fn what_both_agents_know_is_better_than_what_one_knows() {
        let scores = plan(2).run(&[parking(30)], |_, _| {}).unwrap();
        let ate = |method| scores.trial((0, method), 0).of(Subset::All).metrics(Counting::Table)[0].mean();
        assert!(ate(1) < ate(0), "least squares over one agent");
        assert!(ate(2) < ate(1), "memory over least squares");
    }
}
