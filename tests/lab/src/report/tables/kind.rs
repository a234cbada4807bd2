//! Which tables and figures there are.

use serde::Serialize;

/// A table or figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
pub enum Table {
    /// The paper's Table II: late fusion methods
    #[value(name = "II")]
    II,
    /// The paper's Table III: one agent against two
    #[value(name = "III")]
    III,
    /// The paper's Table IV: others' metrics against the paper's
    #[value(name = "IV")]
    IV,
    /// The paper's Fig. 3: errors by category
    #[serde(rename = "fig3")]
    #[value(name = "fig3")]
    Fig3,
    /// The paper's Fig. 4: what association does
    #[serde(rename = "fig4")]
    #[value(name = "fig4")]
    Fig4,
    /// Errors of other shapes and the same standard deviations
    #[serde(rename = "robustness")]
    Robustness,
    /// Whether claimed accuracies are true, by category
    #[serde(rename = "nees")]
    Nees,
    /// Ours without its parts
    #[serde(rename = "ablation")]
    Ablation,
    /// With misses, clutter and views that overlap partly
    #[serde(rename = "sensors")]
    Sensors,
}

impl Table {
    /// The beginning of names of files.
    pub const fn stem(self) -> &'static str {
        match self {
            Self::II => "table-2",
            Self::III => "table-3",
            Self::IV => "table-4",
            Self::Fig3 => "fig-3",
            Self::Fig4 => "fig-4",
            Self::Robustness => "robustness",
            Self::Nees => "nees",
            Self::Ablation => "ablation",
            Self::Sensors => "sensors",
        }
    }
}
