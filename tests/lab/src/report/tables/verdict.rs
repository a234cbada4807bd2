//! The first line of the report: whether ours has the least position error, and beside which method.

use crate::data::conditions::Conditions;
use crate::data::noise::{NoisePair, Shape};
use crate::drive::keyframes::setting::Setting;
use crate::report::page::verdict_html;
use crate::report::palette::{is_of_ours, is_ours};
use crate::report::tables::gain::gains;
use crate::report::tables::kind::Table;
use crate::report::tables::results::Tables;
use crate::report::tables::study::Block;
use crate::score::bootstrap::Ratio;
use crate::score::keyframes::counting::{Counting, Subset};
use clap::ValueEnum;

/// Our method beside the best other one.
#[derive(Clone, Debug, PartialEq)]
struct Comparison {
    setting: Setting,
    /// Our position error, m.
    ours_m: f64,
    /// The other method with the least error.
    rival: String,
    /// Ours over its.
    ratio: f64,
}

/// In how many settings ours has the least position error, beside which method, and by how much; empty where it is not
/// compared.
pub(super) fn verdict(tables: &Tables) -> String {
    let compared = comparisons(tables);
    let Some(worst) = compared.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio)) else {
        return String::new();
    };
    let won = compared.iter().filter(|one| one.ratio < 1.0).count();
    let all = compared.len();
    let is_best = won == all;
    let word = if is_best { "Ours is the most accurate" } else { "Ours is not always the most accurate" };
    // Where ours loses, that setting is named; else the one with unequal agents, if it is there.
    let unequal = compared.iter().find(|one| one.setting.noise == NoisePair::N1N3);
    let named = if is_best { unequal.unwrap_or(worst) } else { worst };
    let mut said = format!("mATE {}", in_words(tables, named));
    if all > 1 {
        let least = compared.iter().map(|one| one.ratio).fold(worst.ratio, f64::min);
        said += &format!("; {least:.2} to {:.2} × the best other method's over {all} settings", worst.ratio);
    }
    if !is_best {
        said += &format!("; least in {won} of {all}");
    }
    let note = "Variants of ours are not counted as other methods.".to_owned();
    verdict_html(is_best, word, &[said + ".", note])
}

/// Each setting once, whichever tables have it. Ablations have no rivals, and pictures and classes are parts of the same runs.
fn comparisons(tables: &Tables) -> Vec<Comparison> {
    let is_counted =
        |block: &&Block| !matches!(block.table, Table::Fig3 | Table::Fig5 | Table::Nees | Table::Ablation);
    let blocks: Vec<&Block> = tables.blocks.iter().filter(is_counted).collect();
    let mut settings: Vec<Setting> = Vec::new();
    for block in &blocks {
        if !settings.contains(&block.setting) {
            settings.push(block.setting);
        }
    }
    let errors = |setting: Setting| {
        let of_setting = blocks.iter().filter(|block| block.setting == setting).copied();
        of_setting.flat_map(|block| errors(tables, block)).collect::<Vec<_>>()
    };
    settings.iter().filter_map(|setting| comparison(*setting, &errors(*setting))).collect()
}

/// Position errors by method, of all objects, counted as in the paper's tables.
fn errors<'a>(tables: &'a Tables, block: &'a Block) -> impl Iterator<Item = (&'a str, f64)> {
    let rows = tables
        .rows_of(block)
        .filter(|row| row.subset == Subset::All && row.counting == Counting::Table && row.class.is_none());
    rows.filter_map(|row| Some((row.method.as_str(), row.metrics.0[0].mean?)))
}

/// Ours beside the best method that is no variant of it.
fn comparison(setting: Setting, errors: &[(&str, f64)]) -> Option<Comparison> {
    let (_, ours_m) = *errors.iter().find(|(method, _)| is_ours(method))?;
    let others = errors.iter().filter(|(method, _)| !is_of_ours(method));
    let (rival, error_m) = *others.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(Comparison { setting, ours_m, rival: rival.to_owned(), ratio: ours_m / error_m })
}

fn in_words(tables: &Tables, Comparison { setting, ours_m, rival, ratio }: &Comparison) -> String {
    // One scene has no interval.
    let interval = Some(tables.scores.n_scenes()).filter(|scenes| *scenes > 1);
    let interval = interval.and_then(|_| gains(tables, *setting, ("ours", rival.as_str()), Subset::All));
    let interval = interval
        .map_or_else(String::new, |[Ratio { low, high, .. }, ..]| format!(" (95 %: {low:.2} to {high:.2})"));
    format!("{ours_m:.3} m, {ratio:.2} × {rival}'s{interval} at {}", name(*setting))
}

fn name(Setting { noise, shape, conditions }: Setting) -> String {
    let mut name = noise.name().to_owned();
    if shape != Shape::Gaussian {
        name += &format!(", {}", shape.name());
    }
    if conditions != Conditions::Paper {
        let value = conditions.to_possible_value();
        name += &format!(", {}", value.as_ref().map_or("", |value| value.get_name()));
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTING: Setting =
        Setting { noise: NoisePair::N1N3, shape: Shape::Laplace, conditions: Conditions::Sensors };

    #[test]
    fn the_rival_is_the_best_method_that_is_no_variant_of_ours() {
        let errors =
            [("nms", 2.0), ("ours-lag-1s", 0.2), ("single-1-ours", 0.3), ("ours", 0.4), ("csba-wls", 0.5)];
        let one = comparison(SETTING, &errors).unwrap();
        assert_eq!((one.rival.as_str(), one.ratio, one.ours_m), ("csba-wls", 0.8, 0.4));
        assert_eq!(comparison(SETTING, &errors[1..4]), None, "nothing to compare with");
        assert_eq!(comparison(SETTING, &errors[..2]), None, "without ours");
    }

    #[test]
    fn a_setting_is_named_with_what_differs_from_the_papers() {
        assert_eq!(name(SETTING), "N1-N3, laplace, sensors");
        let paper = Setting { shape: Shape::Gaussian, conditions: Conditions::Paper, ..SETTING };
        assert_eq!(name(paper), "N1-N3");
    }
}
