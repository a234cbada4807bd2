//! Methods over scenes and trials.

use super::output::{MethodOutput, OutputError, Provenance};
use crate::data::conditions::Conditions;
use crate::data::exported;
use crate::data::noise::{NoisePair, Realisation, Shape};
use crate::data::observation::{AgentReport, Protocol};
use crate::data::scene::Scene;
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::outputs::RecordedOutput;
use crate::drive::keyframes::setting::{SceneTrial, Setting};
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::experiments::{Cell, Experiment, Plan, RunError};
use crate::score::keyframes::method_score::MethodScore;
use crate::score::keyframes::metrics::{Metrics, values};
use std::sync::Arc;

/// Scenes under one setting of noise.
#[derive(Clone, Debug)]
pub struct Study {
    /// The scenes.
    pub scenes: Vec<Scene>,
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// What agents can see.
    pub conditions: Conditions,
    /// Number of realisations of the noise.
    pub trials: u32,
    /// The seed of all trials.
    pub seed: u64,
}

/// The score of a method over all scenes, by trial.
#[derive(Clone, Debug)]
pub struct Score(Vec<MethodScore>);

impl Score {
    /// The metrics as a row of the tables has them.
    pub fn metrics(&self, counting: Counting, subset: Subset) -> Metrics {
        let by_trial: Vec<_> = self.0.iter().map(|score| score.of(subset).metrics(counting)).collect();
        Metrics(values(&by_trial))
    }
}

impl Study {
    /// What the agents report of every keyframe of a scene in a trial.
    pub fn reports(&self, scene: &Scene, trial: u32) -> Vec<[AgentReport; 2]> {
        let realisation = Realisation { seed: self.seed, trial };
        let Self { noise, shape, conditions, .. } = *self;
        exported::reports(&Protocol { noise, shape, conditions, realisation }, scene)
    }

    /// The score of a method of the laboratory, on so many threads.
    ///
    /// # Errors
    /// Where the engine refuses a frame of the protocol.
    pub fn score(&self, contender: Contender, threads: usize) -> Result<Score, RunError> {
        let Self { noise, shape, conditions, trials, seed, .. } = *self;
        let setting = Setting { noise, shape, conditions };
        let experiments = vec![Experiment { setting, contenders: vec![contender] }];
        let scores = Plan { experiments, trials, seed, threads }.run(&self.scenes, |_, _| {})?;
        let cell = Cell { experiment: 0, contender: 0 };
        Ok(Score((0..scores.n_trials()).map(|trial| scores.trial(cell, trial)).collect()))
    }

    /// An output to which those of all scenes and trials are added by [`Self::add`].
    pub fn output(&self) -> RecordedOutput {
        RecordedOutput::new("output", "").for_detections(self.shape, self.conditions)
    }

    /// Adds what a method made of a scene in a trial.
    ///
    /// # Errors
    /// Where the output is not of the scene.
    pub fn add(
        &self,
        output: &mut RecordedOutput,
        (scene, trial): (&Scene, u32),
        made: &MethodOutput,
    ) -> Result<(), OutputError> {
        if made.provenance == Provenance::Position && self.conditions != Conditions::Paper {
            return Err(OutputError::ByPosition);
        }
        let boxes = made.scored(scene, &self.reports(scene, trial))?;
        let Self { noise, conditions, .. } = *self;
        output.insert(&SceneTrial { noise, conditions, trial, scene: &scene.name }, boxes);
        Ok(())
    }

    /// The score of what a method made of all scenes and trials.
    ///
    /// # Errors
    /// None: an output refuses no frame.
    pub fn score_output(&self, output: RecordedOutput, threads: usize) -> Result<Score, RunError> {
        self.score(Contender::Recorded(Arc::new(output)), threads)
    }
}
