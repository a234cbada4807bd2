//! Your own fusion method in one file: in the tables of the paper and as a hub on the network.
//!
//! ```console
//! $ cargo run --release -p v2x-lab --example own_method -- tables --quick --table II
//! $ cargo run --release -p v2x-lab --example own_method -- hub --network demo
//! ```
//!
//! The method: the position of an object is the mean of its newest detections. Detections of one class within 2 m
//! of each other belong to one object. Track ids go to the nearest object of the next frame.

use clap::{Parser, Subcommand};
use std::collections::BTreeMap;
use std::process::ExitCode;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, MeasurementId, TrackId};
use v2x_common::net::{logging, shutdown};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::fusion::{AdmittedFrame, FrameOutcome, FusionMethod, ObjectList, TrackCounts};
use v2x_fusion_hub::hub::{HubArgs, run_with};
use v2x_fusion_hub::values::AgentNames;
use v2x_lab::Contender;
use v2x_lab::commands::{TablesArgs, tables_with};

/// Detections within this distance belong to one object, m.
const REACH_M: f64 = 2.0;
/// Frames older than this are dropped.
const MEMORY: Span = Span::from_millis(200);

#[derive(Debug, Default)]
struct NearestMean {
    newest: BTreeMap<AgentId, DetectionFrame>,
    previous: Vec<(TrackId, BevBox)>,
    next: u32,
}

impl FusionMethod for NearestMean {
    fn handle_frame(&mut self, admitted: &AdmittedFrame<'_>) -> FrameOutcome<'_> {
        let frame = admitted.frame;
        let is_newer = |known: &DetectionFrame| known.captured_at < frame.captured_at;
        if self.newest.get(&frame.id.agent).is_none_or(is_newer) {
            self.newest.insert(frame.id.agent, frame.clone());
        }
        FrameOutcome::default()
    }

    fn write_objects(&mut self, now: Timestamp, _: &AgentNames, objects: &mut ObjectList<'_>) {
        self.newest.retain(|_, frame| now - frame.captured_at <= MEMORY);
        let mut current = Vec::new();
        let mut list = Vec::new();
        for group in groups(self.newest.values()) {
            let bev = mean(&group);
            let track = self.track_id(&bev);
            current.push((track, bev));
            let mut object = FusedObject::from_box(track, group[0].1.class, bev);
            object.contributors = group.iter().map(|(id, _)| *id).collect();
            object.last_measured_at = now;
            list.push(object);
        }
        list.sort_by_key(|object| object.track);
        list.into_iter().for_each(|object| objects.push(object));
        self.previous = current;
    }

    fn counts(&self) -> TrackCounts {
        TrackCounts { tracks: self.previous.len(), ..TrackCounts::default() }
    }
}

impl NearestMean {
    /// The track id of the nearest object of the last list that is still free, or a new one.
    fn track_id(&mut self, bev: &BevBox) -> TrackId {
        let distance = |one: &(TrackId, BevBox)| one.1.pose().distance_to(bev.x, bev.y);
        let nearest = (0..self.previous.len())
            .min_by(|a, b| distance(&self.previous[*a]).total_cmp(&distance(&self.previous[*b])));
        match nearest.filter(|place| distance(&self.previous[*place]) < 2.0 * REACH_M) {
            Some(place) => self.previous.swap_remove(place).0,
            None => {
                self.next += 1;
                TrackId::new(0, self.next)
            }
        }
    }
}

type Report = (MeasurementId, Detection);

/// Detections of one class near each other, one of each agent.
fn groups<'a>(frames: impl Iterator<Item = &'a DetectionFrame>) -> Vec<Vec<Report>> {
    let mut groups: Vec<Vec<Report>> = Vec::new();
    for frame in frames {
        for (index, detection) in (0u16..).zip(&frame.detections) {
            let report = (MeasurementId { frame: frame.id, index }, *detection);
            let fits = |group: &&mut Vec<Report>| {
                group.iter().all(|(id, one)| {
                    id.frame.agent != frame.id.agent
                        && one.class == detection.class
                        && one.bev.pose().distance_to(detection.bev.x, detection.bev.y) < REACH_M
                })
            };
            match groups.iter_mut().find(fits) {
                Some(group) => group.push(report),
                None => groups.push(vec![report]),
            }
        }
    }
    groups
}

fn mean(group: &[Report]) -> BevBox {
    let n = group.len() as f64;
    let of =
        |component: fn(&BevBox) -> f64| group.iter().map(|(_, one)| component(&one.bev)).sum::<f64>() / n;
    let yaw = libm::atan2(of(|bev| libm::sin(bev.yaw)), of(|bev| libm::cos(bev.yaw)));
    BevBox { x: of(|bev| bev.x), y: of(|bev| bev.y), w: of(|bev| bev.w), d: of(|bev| bev.d), yaw }
}

/// Your own fusion method
#[derive(Parser)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Tables(TablesArgs),
    Hub(HubArgs),
}

#[tokio::main]
async fn main() -> ExitCode {
    let outcome = async {
        logging::init(logging::DEFAULT_FILTER, logging::Format::Text)?;
        match Cli::parse().command {
            Command::Tables(args) => {
                let mine = Contender::own("nearest-mean", "", || Box::<NearestMean>::default());
                tables_with(&args, vec![mine])
            }
            Command::Hub(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                let engine = |config| Engine::with_fusion(config, Box::<NearestMean>::default());
                run_with(args, shutdown, engine).await
            }
        }
    };
    v2x_common::net::exit_code("own_method", outcome.await)
}
