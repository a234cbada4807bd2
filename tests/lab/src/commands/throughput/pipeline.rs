//! The pipeline under load, from input bytes to output bytes.

use crate::commands::cpu_time::thread_cpu_time;
use crate::data::workload::{Arrival, Load, Workload};
use crate::score::percentiles::Percentiles;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::MotionModel;

/// Time between two fused frames.
const PUBLISH_INTERVAL: Span = Span::from_millis(50);
/// Time before the measurement starts, in which buffers grow and tracks settle.
const WARM_UP_S: i64 = 2;

/// What is used of the heap.
#[derive(Clone, Copy, Debug)]
pub struct Heap {
    /// Allocations so far.
    pub allocations: u64,
    /// Bytes that are held.
    pub bytes: u64,
}

/// The measured values.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) detections: u64,
    pub(super) cpu: Span,
    pub(super) allocations: u64,
    /// Memory of the engine at the end, bytes.
    pub(super) bytes_held: u64,
    /// Decoding and ingestion of a detection frame, µs.
    pub(super) frame_us: Percentiles,
    /// Creation and encoding of a fused frame, µs.
    pub(super) publish_us: Percentiles,
    /// Mean number of objects in a fused frame.
    pub(super) objects_published: f64,
}

/// The part of the hub without I/O, with its buffers.
struct Pipeline {
    engine: Engine,
    frame: DetectionFrame,
    encoded: Vec<u8>,
}

impl Pipeline {
    fn take(&mut self, arrival: &Arrival) -> anyhow::Result<()> {
        wire::detections::decode_into(&arrival.bytes, &mut self.frame)?;
        let disposition = self.engine.handle_frame(&self.frame, arrival.received_at);
        anyhow::ensure!(matches!(disposition, Disposition::Accepted { .. }), "refused: {disposition:?}");
        Ok(())
    }

    fn publish(&mut self, now: Timestamp) -> anyhow::Result<usize> {
        let fused = self.engine.fused(now);
        self.encoded.clear();
        wire::fused::encode(fused, &mut self.encoded)?;
        Ok(fused.objects.len())
    }
}

/// Runs the load for its whole simulated time. `heap` returns what is used of the heap.
pub(super) fn run(
    load: Load,
    motion: MotionModel,
    seconds: i64,
    heap: fn() -> Heap,
) -> anyhow::Result<Measured> {
    let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
    let mut workload = Workload::new(load, start);
    let config = EngineConfig::new(HubId::new("hub")?, 1).with_tracking(|tracking| tracking.motion = motion);
    let mut engine = Engine::new(config);
    for agent in workload.agents() {
        engine.handle_description(agent, workload.description())?;
    }
    let unset = FrameId { agent: AgentId::new("unset")?, epoch: 0, sequence: 0 };
    let frame = DetectionFrame::empty(unset, start);
    let mut pipeline = Pipeline { engine, frame, encoded: Vec::new() };
    let mut tally = Tally::default();
    let mut due = start + PUBLISH_INTERVAL;
    for second in 1..=WARM_UP_S + seconds {
        // Generated before the measurement: the cost of agents and links is not a cost of the hub.
        let arrivals = workload.arrivals_before(start + Span::from_millis(1000 * second))?;
        if second == WARM_UP_S + 1 {
            tally = Tally::default();
        }
        tally.frame_us.reserve(arrivals.len());
        tally.publish_us.reserve(64);
        let (cpu, counted) = (thread_cpu_time(), heap().allocations);
        for arrival in &arrivals {
            while due <= arrival.received_at {
                let begun = v2x_common::clock::now();
                tally.objects += pipeline.publish(due)?;
                tally.publish_us.push(elapsed_us(begun));
                due += PUBLISH_INTERVAL;
            }
            let begun = v2x_common::clock::now();
            pipeline.take(arrival)?;
            tally.frame_us.push(elapsed_us(begun));
            tally.detections += arrival.n_detections;
        }
        tally.cpu = tally.cpu + (thread_cpu_time() - cpu);
        tally.allocations += heap().allocations - counted;
    }
    let held = heap().bytes;
    drop(pipeline);
    tally.bytes_held = held.saturating_sub(heap().bytes);
    tally.measured()
}

fn elapsed_us(begun: Timestamp) -> f64 {
    (v2x_common::clock::now() - begun).as_secs_f64() * 1e6
}

#[derive(Default)]
struct Tally {
    detections: u64,
    objects: usize,
    cpu: Span,
    allocations: u64,
    bytes_held: u64,
    frame_us: Vec<f64>,
    publish_us: Vec<f64>,
}

impl Tally {
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
    fn measured(self) -> anyhow::Result<Measured> {
        let objects_published = self.objects as f64 / self.publish_us.len().max(1) as f64;
        let nothing = || anyhow::anyhow!("nothing was measured: no detections, or less than a second");
        Ok(Measured {
            detections: self.detections,
            cpu: self.cpu,
            allocations: self.allocations,
            bytes_held: self.bytes_held,
            frame_us: Percentiles::of(self.frame_us).ok_or_else(nothing)?,
            publish_us: Percentiles::of(self.publish_us).ok_or_else(nothing)?,
            objects_published,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_taken_in_late_or_not_and_every_object_published() {
        for motion in [MotionModel::Cv, MotionModel::Imm] {
            let load = Load { agents: 4, rate_hz: 10, objects: 12, view: None, late_share: 0.2, seed: 3 };
            let measured = run(load, motion, 1, || Heap { allocations: 0, bytes: 0 }).unwrap();
            // 4 agents × 10 frames × 12 objects × 0.95, one standard deviation is 5.
            assert!((430..=480).contains(&measured.detections), "{}", measured.detections);
            assert!((measured.objects_published - 12.0).abs() < 0.5, "{}", measured.objects_published);
            assert!(measured.cpu > Span::ZERO && measured.frame_us.p50 > 0.0);
        }
    }
}
