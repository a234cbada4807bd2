//! The compared methods of a sweep: each is a setting of a hub.

use v2x_common::id::AgentId;

/// A method of a sweep. `single`, `drop-late`, `ignore-delay`, `rollback-literal` and `replay` are the same
/// constant-velocity filter with the same association: they differ only in their treatment of late data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum SweepMethod {
    /// The first agent alone, constant velocity
    Single,
    /// Frames that arrive after newer ones are dropped
    DropLate,
    /// Every frame is treated as captured when it arrives
    IgnoreDelay,
    /// CSBA and weighted least squares over a window of 100 ms, without memory
    CsbaWls,
    /// Rollback as in the paper's text: data newer than a late frame is lost
    RollbackLiteral,
    /// UniKF's filter, constant velocity: rollback with full replay
    Replay,
    /// Ours: full replay under four interacting motion models, with size priors
    Ours,
    /// Ours, but clock and pose errors of agents are not corrected
    OursUncorrected,
    /// The first agent alone, by our filter
    SingleOurs,
}

impl SweepMethod {
    /// All methods, in the order of tables.
    pub const ALL: [Self; 9] = [
        Self::Single,
        Self::DropLate,
        Self::IgnoreDelay,
        Self::CsbaWls,
        Self::RollbackLiteral,
        Self::Replay,
        Self::Ours,
        Self::OursUncorrected,
        Self::SingleOurs,
    ];

    /// The name in tables, and the id of its hub.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::DropLate => "drop-late",
            Self::IgnoreDelay => "ignore-delay",
            Self::CsbaWls => "csba-wls",
            Self::RollbackLiteral => "rollback-literal",
            Self::Replay => "replay",
            Self::Ours => "ours",
            Self::OursUncorrected => "ours-uncorrected",
            Self::SingleOurs => "single-ours",
        }
    }

    /// The first agent alone with the same filter: the baseline of collaboration. `None` where there is none.
    pub const fn alone(self) -> Option<Self> {
        match self {
            Self::Ours | Self::OursUncorrected => Some(Self::SingleOurs),
            Self::DropLate | Self::IgnoreDelay | Self::RollbackLiteral | Self::Replay => Some(Self::Single),
            Self::CsbaWls | Self::Single | Self::SingleOurs => None,
        }
    }

    /// Whether it listens to the first agent only.
    pub const fn is_alone(self) -> bool {
        matches!(self, Self::Single | Self::SingleOurs)
    }

    /// The preset of its hub.
    const fn preset_key(self) -> &'static str {
        match self {
            Self::Single => "replay",
            Self::SingleOurs => "ours",
            other => other.key(),
        }
    }

    /// Sets its settings in a `[hub]` table; `first` is the agent that is not late. Settings in which methods differ are
    /// overwritten in every method.
    pub fn configure(self, hub: &mut toml::Table, first: &AgentId) {
        RESERVED.iter().for_each(|name| drop(hub.remove(*name)));
        let mut set = |name: &str, value: toml::Value| drop(hub.insert(name.to_owned(), value));
        set("id", self.key().into());
        set("method", self.preset_key().into());
        set("main_agent", first.as_str().into());
        if self.is_alone() {
            set("only_agents", vec![first.as_str()].into());
        }
    }
}

/// Settings in which methods differ. They are not taken from the scenario, and are no axis.
pub(crate) const RESERVED: [&str; 7] =
    ["id", "method", "main_agent", "motion", "late_data", "registration", "only_agents"];

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use v2x_fusion_hub::fusion::{Fusion, LateFrames, MotionModel};
    use v2x_fusion_hub::hub::HubSettings;
    use v2x_fusion_hub::track::Rollback;

    fn settings(method: SweepMethod) -> HubSettings {
        let mut hub = toml::Table::new();
        method.configure(&mut hub, &AgentId::new("rsu").unwrap());
        HubSettings::from_table(hub).unwrap()
    }

    #[test]
    fn every_method_has_valid_hub_settings_and_its_own_name() {
        for method in SweepMethod::ALL {
            assert_eq!(settings(method).engine.hub.as_str(), method.key());
            assert_eq!(method.to_possible_value().unwrap().get_name(), method.key());
            assert_eq!(settings(method).only_agents.is_empty(), !method.is_alone());
        }
    }

    #[test]
    fn methods_of_handling_late_data_differ_in_nothing_else() {
        use SweepMethod::{DropLate, IgnoreDelay, Replay, RollbackLiteral, Single};
        let replay = settings(Replay).engine;
        assert!(matches!(replay.fusion, Fusion::Tracking(tracking) if tracking.motion == MotionModel::Cv));
        for method in [Single, DropLate, IgnoreDelay, RollbackLiteral] {
            let mut engine = settings(method).engine;
            engine.hub = replay.hub;
            assert_eq!(engine == replay, method == Single);
            engine.late_frames = LateFrames::Fuse;
            engine = engine.with_tracking(|tracking| tracking.tracker.rollback = Rollback::Replay);
            assert_eq!(engine, replay);
        }
    }
}
