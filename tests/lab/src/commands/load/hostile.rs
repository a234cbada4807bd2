//! Agents that are legal by the wire and take more than their share.

use anyhow::anyhow;
use serde::Serialize;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::class::Class;
use v2x_common::clock;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind, MAX_DETECTIONS};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use zenoh::Session;

/// Its name.
pub(super) const NAME: &str = "hostile";
/// Boxes of a frame whose positions hardly say anything, and their standard deviation, m.
const VAGUE_BOXES: usize = 500;
const VAGUE_SIGMA_M: f64 = 60.0;
/// Size of a JSON text, bytes.
const JSON_BYTES: usize = 9_000_000;
/// Sensor descriptions in a tenth of a second.
const DESCRIPTIONS: usize = 2000;

/// How it misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Hostile {
    /// 4096 boxes a frame, 10 Hz
    Boxes,
    /// 500 boxes a frame whose positions are unknown by 60 m, 10 Hz
    Sigma,
    /// JSON texts of 9 MB, 10 Hz
    Json,
    /// 20,000 sensor descriptions a second
    Descriptions,
    /// Frames of 50 boxes, a thousand times a second
    Rate,
}

impl Hostile {
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::Boxes => "4096 boxes a frame",
            Self::Sigma => "500 boxes with σ 60 m",
            Self::Json => "JSON of 9 MB",
            Self::Descriptions => "20,000 descriptions a second",
            Self::Rate => "1000 frames a second",
        }
    }
}

/// Misbehaves until the end.
pub(super) async fn run(
    kind: Hostile,
    options: SessionOptions,
    keys: Keys,
    end: CancellationToken,
) -> anyhow::Result<()> {
    let session = session::open(session::client_config(&options)?).await?;
    let agent = AgentId::new(NAME)?;
    let text = vec![b' '; JSON_BYTES];
    let mut tick = tokio::time::interval(Duration::from_millis(100));
    for round in 0_u64.. {
        tokio::select! {
            _ = tick.tick() => {}
            () = end.cancelled() => break,
        }
        match kind {
            Hostile::Boxes => put_boxes(&session, &keys, round, (MAX_DETECTIONS, 0.3)).await?,
            Hostile::Sigma => put_boxes(&session, &keys, round, (VAGUE_BOXES, VAGUE_SIGMA_M)).await?,
            Hostile::Rate => {
                for k in 0..100 {
                    put_boxes(&session, &keys, 100 * round + k, (50, 0.3)).await?;
                }
            }
            Hostile::Json => put(&session, keys.detections(&agent), ENCODING_JSON, &text).await?,
            Hostile::Descriptions => {
                for _ in 0..DESCRIPTIONS {
                    put(&session, keys.sensor(&agent), ENCODING_JSON, b"{\"revision\": 1}").await?;
                }
            }
        }
    }
    session::close(session).await?;
    Ok(())
}

async fn put_boxes(
    session: &Session,
    keys: &Keys,
    sequence: u64,
    (count, sigma_m): (usize, f64),
) -> anyhow::Result<()> {
    let agent = AgentId::new(NAME)?;
    let id = FrameId { agent, epoch: 1, sequence };
    let detections = (0..count).map(|k| one_box(k, sigma_m)).collect();
    let pose = Some(Pose { x: 0.0, y: 0.0, yaw: 0.0 });
    let frame = DetectionFrame { sensor_pose: pose, detections, ..DetectionFrame::empty(id, clock::now()) };
    let mut bytes = Vec::new();
    wire::detections::encode(&frame, &mut bytes)?;
    put(session, keys.detections(&agent), ENCODING_POSTCARD, &bytes).await
}

/// Boxes on a lattice among those of the others.
fn one_box(k: usize, sigma_m: f64) -> Detection {
    let place = |k: usize| 12.0 * k as f64 - 100.0;
    let bev = BevBox { x: place(k % 64), y: place(k / 64), w: 1.8, d: 4.5, yaw: 0.0 };
    Detection {
        class: Class::Car,
        score: 0.9,
        bev,
        covariance: BoxCovariance { position: Covariance2::isotropic(sigma_m), ww: 0.04, dd: 0.2, yaw: 0.01 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

async fn put(session: &Session, key: String, encoding: &'static str, bytes: &[u8]) -> anyhow::Result<()> {
    session.put(key, bytes).encoding(encoding).await.map_err(|error| anyhow!("{error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_sends_is_legal() {
        for sigma_m in [0.3, VAGUE_SIGMA_M] {
            (0..MAX_DETECTIONS).for_each(|k| one_box(k, sigma_m).validate(None).unwrap());
        }
    }
}
