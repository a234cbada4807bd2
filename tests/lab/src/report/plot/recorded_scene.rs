//! A time of a recording without truth: fused objects, and what each agent detected.

use crate::data::recorded_lists::RecordedLists;
use crate::data::run_log::ReceivedFused;
use crate::report::plot::scene::{BevScene, SceneAgent, fused_mark, motion};
use std::collections::BTreeMap;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::AgentId;

/// The list with the median number of objects, nearest to the middle of the recording, and the one with the most; with what is
/// said of them. One where both are the same list, none where all are empty.
pub(crate) fn typical_and_busiest(lists: &[ReceivedFused]) -> Vec<(&'static str, &ReceivedFused)> {
    let count = |list: &ReceivedFused| list.frame.objects.len();
    let mut counts: Vec<usize> = lists.iter().map(count).filter(|count| *count > 0).collect();
    counts.sort_unstable();
    let Some(median) = counts.get(counts.len() / 2) else { return Vec::new() };
    let middle = lists.len() / 2;
    let typical = lists.iter().enumerate().filter(|(_, list)| count(list) == *median);
    let typical = typical.min_by_key(|(place, _)| place.abs_diff(middle)).map(|(_, list)| list);
    let busiest = lists.iter().reduce(|most, list| if count(list) > count(most) { list } else { most });
    let busiest = busiest.filter(|list| count(list) > *median);
    let words = [("a typical moment", typical), ("the moment with the most objects", busiest)];
    words.into_iter().filter_map(|(words, list)| Some((words, list?))).collect()
}

/// The scene of a list, with all agents of the recording.
pub(crate) fn recorded_scene(
    title: String,
    list: &ReceivedFused,
    frames: &BTreeMap<AgentId, DetectionFrame>,
    (agents, recorded): (&[AgentId], &RecordedLists),
) -> BevScene {
    let frame = &list.frame;
    // In the order of the other figures of the page, so that an agent has one colour.
    let agents = agents.iter().map(|agent| {
        let of_agent = frames.get(agent);
        let described = recorded.descriptions.get(agent);
        SceneAgent {
            id: *agent,
            kind: described.map(|description| description.kind),
            pose: of_agent.and_then(|frame| frame.sensor_pose),
            detections: of_agent
                .map_or_else(Vec::new, |frame| frame.detections.iter().map(|d| d.bev).collect()),
            offset: of_agent.map(|of_agent| of_agent.captured_at - frame.fused_at),
        }
    });
    BevScene {
        title,
        subtitle: format!("{} objects in the list", frame.objects.len()),
        agents: agents.collect(),
        fused: frame.objects.iter().map(|object| fused_mark(object, None)).collect(),
        motions: frame.objects.iter().filter_map(motion).collect(),
        ..BevScene::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{agent, fused, predicted};
    use crate::report::plot::bev::busiest_spot;
    use v2x_common::class::Class;
    use v2x_common::fused::FusedObject;
    use v2x_common::id::TrackId;

    fn list(at_ms: i64, objects: u64) -> ReceivedFused {
        let mut list = fused(at_ms, at_ms, &[]);
        let object =
            |k: u64| FusedObject::from_box(TrackId(k), Class::Car, predicted(10.0 * k as f64 + 5.0, 0.0));
        list.frame.objects = (0..objects).map(object).collect();
        list
    }

    #[test]
    fn one_list_is_typical_and_another_one_is_the_busiest() {
        let lists: Vec<_> = (0..).zip([0, 2, 2, 3, 2, 7, 0]).map(|(k, n)| list(100 * k, n)).collect();
        let chosen = typical_and_busiest(&lists);
        let counts: Vec<usize> = chosen.iter().map(|(_, list)| list.frame.objects.len()).collect();
        assert_eq!(counts, [2, 7]);
        assert_eq!(typical_and_busiest(&lists[1..3]).len(), 1, "one where both are the same");
        assert!(typical_and_busiest(&lists[..1]).is_empty());
    }

    #[test]
    fn an_agent_without_a_frame_near_the_time_is_named_without_detections() {
        let list = list(100, 1);
        let scene = recorded_scene(
            "run".to_owned(),
            &list,
            &BTreeMap::new(),
            (&[agent("ego")], &RecordedLists::default()),
        );
        assert_eq!((scene.agents.len(), scene.fused.len(), scene.truth.len()), (1, 1, 0));
        assert_eq!(busiest_spot(&scene, 12.0), (scene.fused[0].bev.x, scene.fused[0].bev.y));
        assert!(scene.agents[0].detections.is_empty() && scene.agents[0].offset.is_none());
    }
}
