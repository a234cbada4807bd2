//! What is to be said about the world of a scenario.

use v2x_agent::scenario::Scenario;

/// Logs what was done with recorded traffic, and what looks wrong in it.
pub fn log_remarks(scenario: &Scenario) {
    let Some(recorded) = scenario.world.recorded() else { return };
    let file = scenario.files.first().map(|file| file.path.display().to_string()).unwrap_or_default();
    for note in &recorded.traffic.remarks.notes {
        tracing::info!("{file}: {note}");
    }
    for warning in &recorded.traffic.remarks.warnings {
        tracing::warn!("{file}: {warning}");
    }
}
