//! The tables and figures.

use serde::Serialize;

/// A table or figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
pub enum Table {
    /// The paper's Table II: late fusion methods
    #[value(name = "II")]
    II,
    /// The paper's Table III: one agent against two
    #[value(name = "III")]
    #[expect(clippy::upper_case_acronyms, reason = "a Roman numeral")]
    III,
    /// The paper's Table IV: others' metrics against the paper's
    #[value(name = "IV")]
    IV,
    /// The paper's Fig. 3: errors by category
    #[serde(rename = "fig3")]
    #[value(name = "fig3")]
    Fig3,
    /// The paper's Fig. 4: influence of association
    #[serde(rename = "fig4")]
    #[value(name = "fig4")]
    Fig4,
    /// The paper's Fig. 5: one moment under NMS and under ours, or under --methods, as a picture
    #[serde(rename = "fig5")]
    #[value(name = "fig5")]
    Fig5,
    /// Errors of other shapes with the same standard deviations
    #[serde(rename = "robustness")]
    Robustness,
    /// Consistency of published covariances (NEES), by category
    #[serde(rename = "nees")]
    Nees,
    /// Ours without each of its parts
    #[serde(rename = "ablation")]
    Ablation,
    /// With missed detections, clutter and partly overlapping views
    #[serde(rename = "sensors")]
    Sensors,
}

impl Table {
    /// The beginning of file names.
    pub const fn stem(self) -> &'static str {
        match self {
            Self::II => "table-2",
            Self::III => "table-3",
            Self::IV => "table-4",
            Self::Fig3 => "fig-3",
            Self::Fig4 => "fig-4",
            Self::Fig5 => "fig-5",
            Self::Robustness => "robustness",
            Self::Nees => "nees",
            Self::Ablation => "ablation",
            Self::Sensors => "sensors",
        }
    }
}
