//! How many contributors an object names.

use crate::world::{agent, at, config, detection, frame};
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::{Hypotheses, preset};
use v2x_fusion_hub::values::ContributorLimit;

/// Five agents report one car, `a` last; the list, and with a lag the second one.
fn lists(config: EngineConfig, contributors: ContributorLimit) -> Vec<FusedFrame> {
    let mut engine = Engine::new(EngineConfig { contributors, ..config });
    for round in 0..5_u8 {
        for (place, name) in (0..).zip(["e", "c", "d", "b", "a"]) {
            let ms = 100 * i64::from(round) + 2 * place;
            let frame = frame(agent(name), u64::from(round), ms, vec![detection(0, at(ms), (0.0, 0.0))]);
            let _ = engine.handle_frame(&frame, at(ms));
        }
    }
    let mut lists = vec![engine.fused(at(420)).clone()];
    lists.extend(engine.lagged(at(430)).cloned());
    lists
}

fn named(object: &FusedObject) -> String {
    object.contributors.iter().map(|one| one.frame.agent.to_string()).collect()
}

fn unnamed(list: &FusedFrame) -> FusedFrame {
    let objects = list.objects.iter().map(FusedObject::without_contributors).collect();
    FusedFrame { objects, ..list.clone() }
}

#[test]
fn an_object_names_the_newest_contributors_by_name_and_nothing_else_changes() {
    let lagged = config().with_tracking(|tracking| {
        let lag = v2x_common::time::Span::ZERO;
        tracking.tracker.hypotheses =
            Hypotheses::Single { lag, second_lag: Some(v2x_common::time::Span::from_millis(5)) };
    });
    for config in [config(), lagged, config().with_preset(preset("csba-wls").unwrap())] {
        let all = lists(config, ContributorLimit::All);
        for (limit, expected) in [(0, ""), (1, "a"), (2, "ab"), (4, "abcd"), (9, "abcde")] {
            for (all, limited) in all.iter().zip(lists(config, ContributorLimit::Newest(limit))) {
                assert_eq!((all.objects.len(), named(&all.objects[0]).as_str()), (1, "abcde"));
                assert_eq!(named(&limited.objects[0]), expected, "{limit}");
                assert_eq!(unnamed(&limited), unnamed(all));
            }
        }
    }
}
