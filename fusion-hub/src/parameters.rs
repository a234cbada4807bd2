//! The tuned numbers, with their date.
//!
//! Every number that decides what is fused is written down in a dated file under `fusion-hub/parameters`, with where it
//! comes from; a test holds the code against the newest one. A change of a number needs a new dated file.

/// Date of the numbers in use.
pub const DATE: &str = "2026-12-01b";

/// The dated file.
pub const FILE: &str = include_str!("../parameters/2026-12-01b.txt");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineConfig;
    use crate::fusion::{Fusion, TrackingConfig, preset};
    use crate::{association, duplicates, filter, learning, registration, track, tracker, values};
    use v2x_common::id::HubId;

    fn listed() -> String {
        let ours = EngineConfig::new(HubId::new("hub").unwrap(), 0);
        let tracking = |key: &str| -> TrackingConfig {
            match preset(key).unwrap().fusion() {
                Fusion::Tracking(tracking) => tracking,
                Fusion::Window(_) => unreachable!("{key} tracks"),
            }
        };
        let gate = |key: &str| tracking(key).tracker.association.gate;
        let engine = [
            ("association.gate", format!("{} (unikf-paper: {})", gate("ours"), gate("unikf-paper"))),
            ("sensing.defaults", format!("{:?}", ours.sensing)),
            ("publish.existence", tracking("ours").publish_existence.to_string()),
        ];
        let parts = [
            engine.to_vec(),
            association::likelihood::listed(),
            association::gate::listed(),
            association::classes_listed(),
            tracker::update_listed(),
            tracker::occupied_listed(),
            values::existence_listed(),
            vec![values::seen_places_listed()],
            values::coast_listed(),
            values::classes_listed(),
            values::exclusion_listed(),
            values::support_listed(),
            values::pose_errors_listed(),
            vec![values::position_errors_listed(), values::headings_listed()],
            track::listed(),
            track::snapshot_listed(),
            learning::listed(),
            duplicates::listed(),
            filter::listed(),
            registration::listed(),
        ];
        parts.concat().iter().map(|(name, value)| format!("{name} = {value}\n")).collect()
    }

    #[test]
    fn every_number_equals_the_newest_dated_file() {
        let frozen: String = FILE
            .lines()
            .filter(|line| !line.starts_with('#') && !line.is_empty())
            .map(|line| format!("{line}\n"))
            .collect();
        let listed = listed();
        assert!(frozen == listed, "date a new file; now it is:\n{listed}");
        assert!(FILE.contains(DATE));
    }
}
