//! The experiments that the tables need.

use crate::data::conditions::Conditions;
use crate::data::noise::{NoisePair, Shape};
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::method::Method;
use crate::drive::keyframes::setting::Setting;
use crate::report::tables::kind::Table;
use crate::score::keyframes::experiments::Experiment;
use crate::score::keyframes::moment::Moment;

/// The requested tables.
#[derive(Clone, Debug)]
pub(crate) struct Study {
    /// The tables.
    pub tables: Vec<Table>,
    /// The levels of noise, as far as a table has them.
    pub noise: Vec<NoisePair>,
    /// The methods; all of a table if this is empty.
    pub methods: Vec<Method>,
    /// The shape of the errors; [`Table::Robustness`] has all shapes.
    pub shape: Shape,
    /// The conditions of all tables but [`Table::Sensors`].
    pub conditions: Conditions,
    /// Further rows of every table.
    pub further: Vec<Contender>,
    /// Which keyframe [`Table::Fig5`] shows.
    pub moment: Moment,
    /// Whether robustness is computed at the lowest and the highest level only: it needs all shapes.
    pub is_brief: bool,
}

/// One block of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Block {
    /// The table.
    pub table: Table,
    /// Noise and conditions of detections.
    pub setting: Setting,
    /// Its rows.
    pub contenders: Vec<Contender>,
}

impl Study {
    /// The blocks of all tables, in order.
    pub(crate) fn blocks(&self) -> Vec<Block> {
        self.tables.iter().flat_map(|table| self.blocks_of(*table)).collect()
    }

    fn blocks_of(&self, table: Table) -> Vec<Block> {
        let conditions = if table == Table::Sensors { Conditions::Sensors } else { self.conditions };
        // With clutter and misses there are no true identities as input.
        let can_run =
            |method: &Method| conditions == Conditions::Paper || !method.inputs().contains("identities");
        let is_wanted =
            |method: &Method| can_run(method) && (self.methods.is_empty() || self.methods.contains(method));
        // The picture takes any method, in the order of the option; a table has its own rows.
        let takes_any = table == Table::Fig5 && !self.methods.is_empty();
        let rows = if takes_any { &self.methods } else { table.methods() };
        let contenders: Vec<Contender> =
            rows.iter().filter(|method| is_wanted(method)).copied().map(Contender::Method).collect();
        if contenders.is_empty() {
            return Vec::new();
        }
        let shapes = if table == Table::Robustness { Shape::ALL.to_vec() } else { vec![self.shape] };
        let is_left_out = |noise: &NoisePair| {
            self.is_brief && table == Table::Robustness && !matches!(noise, NoisePair::N1N1 | NoisePair::N3N3)
        };
        let noise = table.noise().iter().copied();
        let noise = noise.filter(|noise| self.noise.contains(noise) && !is_left_out(noise));
        let setting = |noise| shapes.iter().map(move |shape| Setting { noise, shape: *shape, conditions });
        let block = |setting| {
            let mut contenders = contenders.clone();
            contenders.extend(self.further_in(table, setting).cloned());
            Block { table, setting, contenders }
        };
        noise.flat_map(setting).map(block).collect()
    }

    /// The further contenders that can run in a block.
    fn further_in(&self, table: Table, setting: Setting) -> impl Iterator<Item = &Contender> {
        let claims = move |contender: &&Contender| table != Table::Nees || contender.claims_accuracy();
        self.further.iter().filter(move |contender| contender.has_output_for(&setting)).filter(claims)
    }

    /// Every setting once, with all contenders that any table needs. [`Table::Fig5`] shows one keyframe and needs none.
    pub(crate) fn experiments(&self) -> Vec<Experiment> {
        let mut experiments: Vec<Experiment> = Vec::new();
        let blocks = self.blocks().into_iter().filter(|block| block.table != Table::Fig5);
        for Block { setting, contenders, .. } in blocks {
            let place = experiments.iter().position(|one| one.setting == setting).unwrap_or_else(|| {
                experiments.push(Experiment { setting, contenders: Vec::new() });
                experiments.len() - 1
            });
            let known = &mut experiments[place].contenders;
            for contender in contenders {
                if !known.contains(&contender) {
                    known.push(contender);
                }
            }
        }
        experiments
    }
}

impl Table {
    /// Its rows.
    pub const fn methods(self) -> &'static [Method] {
        match self {
            Self::II => &Method::TABLE_II,
            Self::III => &[Method::Single1, Method::UnikfPaper, Method::Ours, Method::Single1Ours],
            Self::IV => &[Method::Nms, Method::DairV2x, Method::UnikfPaper, Method::Ours],
            Self::Fig3 => &[Method::Nms, Method::DairV2x, Method::UnikfPaper, Method::Ours],
            Self::Fig4 => &[
                Method::UnikfPaper,
                Method::UnikfPaperTrueId,
                Method::UnikfPaperIou,
                Method::UnikfPaperEuclidean,
                Method::Ours,
                Method::OursTrueId,
            ],
            Self::Fig5 => &[Method::Nms, Method::Ours],
            Self::Robustness => {
                &[Method::Single1, Method::CsbaWls, Method::CsbaWlsCv, Method::UnikfPaper, Method::Ours]
            }
            Self::Nees => &[Method::UnikfPaper, Method::Ours, Method::OursTrueId],
            Self::Ablation => &[
                Method::CsbaWls,
                Method::Ours,
                Method::OursCv,
                Method::OursNoPrior,
                Method::OursNoSizePrior,
                Method::OursBiased,
                Method::OursCsba,
                Method::OursForgetful,
            ],
            // With clutter there are no true identities as input.
            Self::Sensors => Method::TABLE_II.split_at(20).0,
        }
    }

    /// Its levels of noise.
    pub const fn noise(self) -> &'static [NoisePair] {
        match self {
            Self::IV | Self::Fig3 | Self::Fig5 => &[NoisePair::N1N3],
            Self::Fig4 => &[NoisePair::N1N1, NoisePair::N3N3],
            _ => &NoisePair::ALL,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(tables: &[Table], methods: &[Method]) -> Study {
        Study {
            tables: tables.to_vec(),
            noise: NoisePair::ALL.to_vec(),
            methods: methods.to_vec(),
            shape: Shape::Gaussian,
            conditions: Conditions::Paper,
            further: Vec::new(),
            moment: Moment::default(),
            is_brief: false,
        }
    }

    #[test]
    fn experiments_shared_by_several_tables_run_once() {
        let experiments = study(&[Table::II, Table::III, Table::IV, Table::Fig3], &[]).experiments();
        assert_eq!(experiments.len(), 4);
        assert!(experiments.iter().all(|one| one.contenders.len() == Method::TABLE_II.len()));
        // Three further shapes at four levels.
        let robust = study(&[Table::II, Table::Robustness], &[]);
        assert_eq!(robust.experiments().len(), 4 + 12);
        assert_eq!(Study { is_brief: true, ..robust }.experiments().len(), 4 + 6);
    }

    #[test]
    fn a_table_without_any_of_the_wanted_methods_is_left_out() {
        let study = study(&[Table::II, Table::Fig4], &[Method::CsbaWls]);
        assert!(study.blocks().iter().all(|block| block.table == Table::II));
    }

    #[test]
    fn detectors_that_miss_leave_out_methods_with_true_identities() {
        let lidar = Study { conditions: Conditions::Lidar, ..study(&[Table::II], &[]) };
        let blocks = lidar.blocks();
        assert!(blocks.iter().all(|block| block.setting.conditions == Conditions::Lidar));
        assert!(blocks.iter().all(|block| block.contenders.len() == Method::TABLE_II.len() - 1));
    }

    #[test]
    fn no_method_receives_true_identities_under_sensors() {
        let truth = |method: &&Method| method.inputs().contains("identities");
        assert_eq!(Table::Sensors.methods().iter().filter(truth).count(), 0);
        assert_eq!(Table::Sensors.methods().len(), Method::TABLE_II.len() - 1);
    }
}
