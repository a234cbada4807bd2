//! The page of a recording that is no run of the laboratory's: it has no truth.

use crate::data::hub_inputs::{HubInputs, hub_inputs};
use crate::data::recorded_lists::{RecordedLists, recorded_lists};
use crate::drive::found::Found;
use crate::drive::rerun::{Rerun, frames_near, rerun};
use crate::report::plot::recorded_scene::{recorded_scene, typical_and_busiest};
use crate::report::recording_page::{RecordingPage, recording_page};
use anyhow::{Context, ensure};
use std::collections::BTreeMap;
use std::path::Path;
use v2x_common::id::AgentId;
use v2x_common::recording::Recording;
use v2x_common::sensor::SensorDescription;
use v2x_fusion_hub::hub::HubSettings;

type File = Recording<std::io::BufReader<std::fs::File>>;

fn open(path: &Path) -> anyhow::Result<File> {
    Recording::open(path).with_context(|| format!("opening {}", path.display()))
}

/// The page as HTML.
pub(super) fn page_of(path: &Path) -> anyhow::Result<String> {
    let in_file = || format!("in {}", path.display());
    let mut recording = open(path)?;
    let mut recorded = recorded_lists(&mut recording).with_context(in_file)?;
    let commit = recording.facts();
    let commit = commit.get("version").map(|version| {
        let commit = commit.get("commit").map_or_else(String::new, |commit| format!(", commit {commit}"));
        format!("Recorded by version {version}{commit}")
    });
    let given = hub_inputs(open(path)?).with_context(in_file)?;
    ensure!(
        !recorded.lists.is_empty() || !given.inputs.is_empty(),
        "{} holds neither lists of a hub nor frames of agents: nothing was on the network",
        path.display()
    );
    let settings = settings(&given);
    let again = rerun(&given, settings.clone()).context("running the hub's core again")?;
    let is_published = !recorded.lists.is_empty();
    if !is_published {
        recorded.lists.clone_from(&again.lists);
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let shown = Shown { name: &name, settings, recorded: &recorded, is_published, commit, score: &[] };
    Ok(shown.html(&given, &again))
}

/// What a hub was given by something else than a recording.
pub(super) struct Given<'a> {
    pub(super) name: &'a str,
    pub(super) inputs: HubInputs,
    pub(super) settings: HubSettings,
    pub(super) descriptions: BTreeMap<AgentId, SensorDescription>,
    /// What was found wrong with it, by whoever has seen more of it.
    pub(super) found: Vec<Found>,
    /// How good what is published is by a truth, line by line; none without one.
    pub(super) score: Vec<String>,
}

/// The page of that as HTML.
pub(super) fn page(given: &Given<'_>) -> anyhow::Result<String> {
    let again = rerun(&given.inputs, given.settings.clone()).context("fusing the frames for the page")?;
    let again = Rerun { found: given.found.clone(), ..again };
    ensure!(
        !again.lists.is_empty(),
        "{}: nothing is published, so that there is nothing to show",
        given.name
    );
    let descriptions = given.descriptions.clone();
    let recorded = RecordedLists { hub: None, lists: again.lists.clone(), descriptions };
    let shown = Shown {
        name: given.name,
        settings: given.settings.clone(),
        recorded: &recorded,
        is_published: false,
        commit: None,
        score: &given.score,
    };
    Ok(shown.html(&given.inputs, &again))
}

/// What a page is of.
struct Shown<'a> {
    name: &'a str,
    settings: HubSettings,
    recorded: &'a RecordedLists,
    is_published: bool,
    commit: Option<String>,
    score: &'a [String],
}

impl Shown<'_> {
    /// The page, with what a hub's core makes of what it was given.
    fn html(self, given: &HubInputs, again: &Rerun) -> String {
        let Self { name, settings, recorded, is_published, commit, score } = self;
        let agents: Vec<_> = again.agents.iter().map(|(agent, _)| *agent).collect();
        let moments = typical_and_busiest(&recorded.lists).into_iter().map(|(what, list)| {
            let frames = frames_near(given, settings.clone(), list.frame.fused_at);
            recorded_scene(format!("{name}: {what}"), list, &frames, (&agents, recorded))
        });
        let moments: Vec<_> = moments.collect();
        recording_page(&RecordingPage {
            name,
            recorded,
            is_published,
            again,
            moments: &moments,
            commit,
            score,
        })
    }
}

/// Of the recorded hub, or the defaults.
fn settings(given: &HubInputs) -> HubSettings {
    given.settings.clone().unwrap_or_else(|| {
        tracing::warn!("the recording has no journal, and so no settings of its hub: the defaults are used");
        HubSettings::default()
    })
}
