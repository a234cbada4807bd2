//! Published lists: counted, and as a file.

use crate::data::run_log::ReceivedFused;
use anyhow::Context;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::Path;
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::wire;

/// The numbers of a hub's lists.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(super) struct Counts {
    lists: u64,
    mean_objects: f64,
    /// Tracks that were published at all.
    tracks: usize,
    /// Accepted and refused frames of each agent.
    agents: BTreeMap<AgentId, [u64; 2]>,
}

/// Counts lists one after another.
#[derive(Default)]
struct Counter {
    counts: Counts,
    objects: u64,
    tracks: std::collections::BTreeSet<v2x_common::id::TrackId>,
}

impl Counter {
    fn add(&mut self, frame: &FusedFrame) {
        self.counts.lists += 1;
        self.objects += frame.objects.len() as u64;
        self.tracks.extend(frame.objects.iter().map(|object| object.track));
        for health in &frame.agents {
            self.counts.agents.insert(health.agent, [health.accepted, health.refused]);
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "counts of objects")]
    fn end(self) -> Counts {
        let mean_objects = self.objects as f64 / self.counts.lists.max(1) as f64;
        Counts { mean_objects, tracks: self.tracks.len(), ..self.counts }
    }
}

impl Counts {
    pub(super) fn of(lists: &[ReceivedFused]) -> Self {
        let mut counter = Counter::default();
        lists.iter().for_each(|list| counter.add(&list.frame));
        counter.end()
    }
}

/// Both for people, or as one line of JSON.
pub(super) fn text(now: &Counts, then: &Counts, is_json: bool) -> anyhow::Result<String> {
    if is_json {
        return Ok(serde_json::json!({ "now": now, "recorded": then }).to_string() + "\n");
    }
    let mut text = format!("{:24}{:>12}{:>12}\n", "", "now", "recorded");
    let mut row = |name: &str, now: String, then: String| text += &format!("{name:24}{now:>12}{then:>12}\n");
    row("lists", now.lists.to_string(), then.lists.to_string());
    row("objects in a list", format!("{:.1}", now.mean_objects), format!("{:.1}", then.mean_objects));
    row("tracks", now.tracks.to_string(), then.tracks.to_string());
    for (agent, [accepted, refused]) in &now.agents {
        let [then_accepted, then_refused] = then.agents.get(agent).copied().unwrap_or_default();
        row(&format!("{agent}: accepted"), accepted.to_string(), then_accepted.to_string());
        row(&format!("{agent}: refused"), refused.to_string(), then_refused.to_string());
    }
    text += "Not scored: the recording has no scenario; one of v2x up --record and the folder of v2x demo have.\n";
    Ok(text)
}

/// Writes the lists as lines of JSON.
pub(super) fn write(lists: &[ReceivedFused], path: &Path) -> anyhow::Result<()> {
    let write = || -> anyhow::Result<()> {
        let mut out = BufWriter::new(std::fs::File::create(path)?);
        for list in lists {
            out.write_all(&wire::json::encode_fused(&list.frame)?)?;
            out.write_all(b"\n")?;
        }
        Ok(out.flush()?)
    };
    write().with_context(|| format!("writing {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::fused::{AgentHealth, FusedObject};
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{HubId, TrackId};
    use v2x_common::time::Timestamp;

    fn list(tracks: &[u32], accepted: u64) -> ReceivedFused {
        let object =
            |track: &u32| FusedObject::from_box(TrackId::new(1, *track), Class::Car, BevBox::default());
        let frame = FusedFrame {
            hub: HubId::new("hub").unwrap(),
            lineage: 1,
            sequence: 0,
            fused_at: Timestamp::EPOCH,
            map_frame: None,
            objects: tracks.iter().map(object).collect(),
            agents: vec![AgentHealth {
                agent: AgentId::new("cam").unwrap(),
                epoch: 1,
                newest_captured_at: Timestamp::EPOCH,
                accepted,
                refused: 2,
                out_of_sequence: 0,
            }],
            includes: Vec::new(),
        };
        ReceivedFused { received_at: Timestamp::EPOCH, frame }
    }

    #[test]
    fn lists_objects_tracks_and_frames_are_counted_and_stand_side_by_side() {
        let now = Counts::of(&[list(&[1, 2, 3], 5), list(&[2, 4], 9)]);
        assert_eq!((now.lists, now.mean_objects, now.tracks), (2, 2.5, 4));
        let text = text(&now, &Counts::of(&[list(&[1], 7)]), false).unwrap();
        let cells = |name: &str| {
            let line = text.lines().find(|line| line.starts_with(name)).unwrap();
            line[24..].split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(cells("objects in a list"), ["2.5", "1.0"]);
        assert_eq!(
            (cells("cam: accepted"), cells("cam: refused")),
            (vec!["9".into(), "7".into()], vec!["2".into(); 2])
        );
    }
}
