//! A log whose frames are taken, and of which no object is published: why that may be.

use crate::data::detection_log::Arrival;
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// Detections that are looked at: where the units are wrong, all of them are.
const MOST: u64 = 2_000;
/// Of a frame.
const MOST_OF_FRAME: usize = 64;
/// No road user is faster.
const FAST_MPS: f64 = 100.0;
/// Objects of one place are not so far from each other.
const APART_M: f64 = 5_000.0;
/// Standard deviations of a detector are smaller.
const VAGUE_M: f64 = 10.0;

/// What its first detections show.
#[derive(Debug, Default)]
pub(super) struct Unpublished {
    frames: u64,
    detections: u64,
    /// Those whose standard deviation is large.
    vague: u64,
    /// Those of a sensor that saw something before, and of these those that are near nothing of it.
    followed: u64,
    jumped: u64,
    /// West, south, east and north.
    extent: Option<[f64; 4]>,
    before: BTreeMap<AgentId, (Timestamp, Vec<(f64, f64)>)>,
}

impl Unpublished {
    /// Takes in a frame.
    pub(super) fn note(&mut self, Arrival { frame, .. }: &Arrival) {
        if self.detections >= MOST || frame.detections.is_empty() {
            return;
        }
        let detections = &frame.detections[..frame.detections.len().min(MOST_OF_FRAME)];
        let places: Vec<_> = detections.iter().map(|one| (one.bev.x, one.bev.y)).collect();
        let is_vague = |xx: f64, yy: f64| libm::sqrt(f64::midpoint(xx, yy)) > VAGUE_M;
        for one in detections {
            let position = one.covariance.position;
            self.vague += u64::from(is_vague(position.xx, position.yy));
        }
        self.frames += 1;
        self.detections += detections.len() as u64;
        for (x, y) in &places {
            let [west, south, east, north] = self.extent.unwrap_or([*x, *y, *x, *y]);
            self.extent = Some([west.min(*x), south.min(*y), east.max(*x), north.max(*y)]);
        }
        let before = self.before.insert(frame.id.agent, (frame.captured_at, places.clone()));
        let Some((at, before)) = before.filter(|(at, _)| *at < frame.captured_at) else { return };
        let reach_m = FAST_MPS * (frame.captured_at - at).as_secs_f64();
        let is_near = |a: &(f64, f64), b: &(f64, f64)| libm::hypot(a.0 - b.0, a.1 - b.1) <= reach_m;
        self.followed += places.len() as u64;
        let jumped = places.iter().filter(|&place| !before.iter().any(|one| is_near(one, place)));
        self.jumped += jumped.count() as u64;
    }

    /// Why nothing was published, as far as it shows; nothing of a log without detections.
    pub(super) fn finding(&self) -> Option<Finding> {
        let is_most = |part: u64, of: u64| of > 0 && 2 * part > of;
        let is_wide = self
            .extent
            .is_some_and(|[west, south, east, north]| libm::fmax(east - west, north - south) > APART_M);
        if self.detections == 0 {
            return None;
        }
        let nothing = "nothing was published: no object was confirmed";
        let (says, change) = if is_most(self.jumped, self.followed) || is_wide {
            let [west, south, east, north] = self.extent.unwrap_or_default();
            (
                format!(
                    "{nothing}. {} of {} detections lie farther from those of the frame before than 100 m/s lead, and all within x \
                     {west:.0} to {east:.0} and y {south:.0} to {north:.0}",
                    self.jumped, self.followed
                ),
                "Write metres: are x and y centimetres (divide by 100) or millimetres (by 1000)? Are `t` seconds?",
            )
        } else if is_most(self.vague, self.detections) {
            (
                format!(
                    "{nothing}. {} of {} detections have a standard deviation of more than 10 m",
                    self.vague, self.detections
                ),
                "Write sx and sy in metres (0.3 to 2 are usual), or leave these cells empty",
            )
        } else {
            (
                format!("{nothing} by {} detections in {} frames", self.detections, self.frames),
                "An object is in the list once detections of several frames or sensors agree on it: is each object in more than one \
                 frame, and are its positions metres in one map?",
            )
        };
        Some(Finding::of_network(Code::Missing, says, change))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::detection_log::DetectionLog;
    use std::path::Path;

    fn words(row: impl Fn(u32) -> String) -> String {
        let rows: String = (0..5).map(|k| format!("{k}.2,{k},a,{}\n", row(k))).collect();
        let text = format!("t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n{rows}");
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
        let mut unpublished = Unpublished::default();
        while let Some(arrival) = log.next_arrival().unwrap() {
            unpublished.note(&arrival);
        }
        unpublished.finding().map(|one| one.to_string()).unwrap_or_default()
    }

    #[test]
    fn why_nothing_was_published_is_said_by_what_the_detections_show() {
        let jumps = words(|k| format!("car,{},0,2,4,0,0.5,0.5,0.2,0.4,0.1", 1000 * k));
        assert!(jumps.contains("4 of 4 detections lie farther") && jumps.contains("centimetres"), "{jumps}");
        let vague = words(|k| format!("car,{k},0,2,4,0,30,30,0.2,0.4,0.1"));
        assert!(vague.contains("5 of 5 detections have a standard deviation"), "{vague}");
        let rare = words(|k| format!("car,{k},0,2,4,0,0.5,0.5,0.2,0.4,0.1"));
        assert!(rare.contains("no object was confirmed by 5 detections in 5 frames"), "{rare}");
        assert_eq!(words(|_| ",,,,,,,,,,".to_owned()), "", "nothing was seen");
    }
}
