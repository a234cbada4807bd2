//! The methods of the tables, and the inputs of each.

use crate::data::noise::NoisePair;
use crate::drive::keyframes::setup::Setup;
use serde::Serialize;

macro_rules! methods {
    ($($(#[doc = $doc:literal])* $variant:ident = $key:literal;)*) => {
        /// A row of the tables.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "lab", derive(clap::ValueEnum))]
        pub enum Method {
            $($(#[doc = $doc])* #[serde(rename = $key)] #[cfg_attr(feature = "lab", value(name = $key))] $variant,)*
        }

        impl Method {
            /// Every method.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Its name in tables, on the command line and in JSON.
            pub const fn key(self) -> &'static str {
                match self { $(Self::$variant => $key,)* }
            }
        }
    };
}

methods! {
    /// Agent 1 alone
    Single1 = "single-1";
    /// Non-maximum suppression by IoU
    Nms = "nms";
    /// Non-maximum suppression by GIoU
    NmsGiou = "nms-giou";
    /// Promotion-suppression aggregation, ties kept
    Psa = "psa";
    /// Weighted box fusion
    Wbf = "wbf";
    /// InfraDet3D-Late as the paper's rows have it
    InfraDet3d = "infradet3d";
    /// InfraDet3D-Late as its authors' code has it
    InfraDet3dCode = "infradet3d-code";
    /// DAIR-V2X-Late as the paper's rows have it
    DairV2x = "dair-v2x";
    /// DAIR-V2X-Late as its authors' code has it
    DairV2xCode = "dair-v2x-code";
    /// CSBA association, weighted least squares
    CsbaWls = "csba-wls";
    /// The same, with the size noise law
    CsbaWlsDebiased = "csba-wls-debiased";
    /// CSBA+WLS in every frame, then a constant-velocity Kalman filter
    CsbaWlsCv = "csba-wls-cv";
    /// DAIR-V2X-Late in every frame, then a constant-velocity Kalman filter
    DairV2xCv = "dair-v2x-cv";
    /// UniKF as in the paper, with late data replayed
    UnikfPaper = "unikf-paper";
    /// The same, with true associations
    UnikfPaperTrueId = "unikf-paper-true-id";
    /// The same, associated by overlap (IoU)
    UnikfPaperIou = "unikf-paper-iou";
    /// The same, associated by distance
    UnikfPaperEuclidean = "unikf-paper-euclidean";
    /// Our engine
    Ours = "ours";
    /// Our engine with 8 association hypotheses
    OursParticles = "ours-particles";
    /// Our engine without class priors: sizes by the detections alone, and all objects move as cars do
    OursNoPrior = "ours-no-prior";
    /// Our engine with a lag of half a second: the next keyframe counts, too
    OursLagHalf = "ours-lag-0.5s";
    /// Our engine with a lag of one second: the next two keyframes count, too
    OursLag1 = "ours-lag-1s";
    /// Our engine, agent 1 alone
    Single1Ours = "single-1-ours";
    /// Our engine with true associations: an upper bound
    OursTrueId = "ours-true-id";
    /// Our engine without size priors of classes
    OursNoSizePrior = "ours-no-size-prior";
    /// Our engine without the four interacting models: constant velocity
    OursCv = "ours-cv";
    /// Our engine without the size noise law
    OursBiased = "ours-biased";
    /// Our engine, associating by CSBA's cost
    OursCsba = "ours-csba";
    /// Our engine without memory: every keyframe is the first
    OursForgetful = "ours-forgetful";
}

/// The inputs of a method apart from boxes and classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Inputs {
    sigma: bool,
    past: bool,
    later: bool,
    class_prior: bool,
    size_law: bool,
    truth: bool,
}

/// How a method is composed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// The engine.
    pub setup: Setup,
    /// An engine before it. Its fused objects replace the detections of the agents.
    pub before: Option<Setup>,
}

impl Method {
    /// The rows of Table II, in its order.
    pub const TABLE_II: [Self; 21] = [
        Self::Single1,
        Self::Nms,
        Self::NmsGiou,
        Self::Psa,
        Self::Wbf,
        Self::InfraDet3d,
        Self::InfraDet3dCode,
        Self::DairV2x,
        Self::DairV2xCode,
        Self::CsbaWls,
        Self::CsbaWlsDebiased,
        Self::CsbaWlsCv,
        Self::DairV2xCv,
        Self::UnikfPaper,
        Self::Ours,
        Self::OursParticles,
        Self::OursNoPrior,
        Self::OursLagHalf,
        Self::OursLag1,
        Self::Single1Ours,
        Self::OursTrueId,
    ];

    /// Its inputs apart from boxes and classes, in words.
    pub fn inputs(self) -> String {
        let Inputs { sigma, past, later, class_prior, size_law, truth } = self.given();
        let parts = [
            (sigma, "σ"),
            (past, "past frames"),
            (later, "later frames"),
            (class_prior, "class prior"),
            (size_law, "size law"),
            (truth, "true identities"),
        ];
        let parts: Vec<&str> =
            parts.iter().filter(|(is_given, _)| *is_given).map(|(_, name)| *name).collect();
        parts.join(", ")
    }

    fn given(self) -> Inputs {
        let sigma = Inputs { sigma: true, ..Inputs::default() };
        // The process noise of the constant-velocity filter depends on the class.
        let filtered = Inputs { past: true, class_prior: true, ..sigma };
        let ours = Inputs { size_law: true, ..filtered };
        match self {
            Self::CsbaWls => sigma,
            Self::CsbaWlsDebiased => Inputs { size_law: true, ..sigma },
            Self::CsbaWlsCv
            | Self::DairV2xCv
            | Self::UnikfPaper
            | Self::UnikfPaperIou
            | Self::UnikfPaperEuclidean => filtered,
            Self::UnikfPaperTrueId => Inputs { truth: true, ..filtered },
            Self::Ours | Self::OursParticles | Self::Single1Ours | Self::OursCv | Self::OursCsba => ours,
            Self::OursNoPrior => Inputs { class_prior: false, ..ours },
            // The class still decides the motion parameters.
            Self::OursNoSizePrior => ours,
            Self::OursBiased => Inputs { size_law: false, ..ours },
            Self::OursForgetful => Inputs { past: false, ..ours },
            Self::OursLagHalf | Self::OursLag1 => Inputs { later: true, ..ours },
            Self::OursTrueId => Inputs { truth: true, ..ours },
            _ => Inputs::default(),
        }
    }

    /// How it is put together, for this level of noise: a preset of the hub, and what the laboratory changes around it.
    pub fn recipe(self, noise: NoisePair) -> Recipe {
        let of = |key: &str| Setup::of_preset(key, noise.overlap_threshold());
        // Only ours takes out the declared laws of size errors.
        let undeclared = |key: &str| Setup { declares_size_law: false, ..of(key) };
        let filtered = |rule: &str| {
            let setup = Setup { n_agents: 1, reads_fused_list: true, ..undeclared("unikf-paper") };
            Recipe { setup, before: Some(undeclared(rule)) }
        };
        let setup = match self {
            Self::CsbaWlsDebiased => of("csba-wls"),
            Self::CsbaWlsCv => return filtered("csba-wls"),
            Self::DairV2xCv => return filtered("dair-v2x"),
            Self::UnikfPaperTrueId => Setup { has_true_identities: true, ..undeclared("unikf-paper") },
            Self::Single1Ours => Setup { n_agents: 1, ..of("ours") },
            Self::OursTrueId => Setup { has_true_identities: true, ..of("ours") },
            Self::OursForgetful => Setup { remembers: false, ..of("ours") },
            Self::OursLagHalf | Self::OursLag1 => {
                let setup = of(self.key());
                Setup { lag: setup.config.fusion.lag(), ..setup }
            }
            Self::Ours
            | Self::OursParticles
            | Self::OursNoPrior
            | Self::OursNoSizePrior
            | Self::OursCv
            | Self::OursBiased
            | Self::OursCsba => of(self.key()),
            other => undeclared(other.key()),
        };
        Recipe { setup, before: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_fusion_hub::engine::EngineConfig;
    use v2x_fusion_hub::fusion::PRESETS;

    #[test]
    fn keys_are_the_names_on_the_command_line_and_in_json() {
        use clap::ValueEnum;
        for method in Method::ALL {
            assert_eq!(method.to_possible_value().unwrap().get_name(), method.key());
            assert_eq!(serde_json::to_string(&method).unwrap(), format!("{:?}", method.key()));
        }
    }

    #[test]
    fn a_row_with_the_key_of_a_preset_of_the_hub_is_that_preset() {
        let noise = NoisePair::N1N1;
        let mut n_shared = 0;
        for preset in PRESETS {
            let Some(row) = Method::ALL.iter().find(|method| method.key() == preset.key) else { continue };
            n_shared += 1;
            let fusion = preset.fusion_at(noise.overlap_threshold());
            let expected = EngineConfig { fusion, ..Setup::ours().config.with_preset(preset) };
            assert_eq!(row.recipe(noise).setup.config, expected, "{}", preset.key);
        }
        assert_eq!(n_shared, 22, "every row that the laboratory adds nothing to");
    }

    #[test]
    fn every_row_can_be_put_together() {
        for method in Method::ALL {
            method.recipe(NoisePair::N1N1);
        }
    }

    #[test]
    fn single_frame_methods_without_accuracies_receive_no_covariances() {
        assert_eq!(Method::DairV2x.inputs(), "");
        assert_eq!(Method::Ours.inputs(), "σ, past frames, class prior, size law");
    }
}
