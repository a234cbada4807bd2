//! Late fusion of bird's-eye-view detections: frames of many agents in, late and noisy, one list of objects out.
//!
//! [`Engine`] is pure: time is an argument, and the same calls give the same bits. It admits frames, corrects clocks and
//! poses of agents, and leaves fusing to a [`FusionMethod`]: to tracking ([`TrackingConfig`]), to a single-frame rule
//! ([`WindowConfig`]), or to a method of yours ([`Engine::with_fusion`]). [`hub`] (feature `net`) serves an engine on a
//! Zenoh network; its [`hub::Core`] (feature `core`) is pure, too.
//!
//! ```
//! use v2x_common::class::Class;
//! use v2x_common::covariance::{BoxCovariance, Covariance2};
//! use v2x_common::detection::{Detection, DetectionFrame};
//! use v2x_common::geometry::BevBox;
//! use v2x_common::id::{AgentId, FrameId, HubId};
//! use v2x_common::time::{Span, Timestamp};
//! use v2x_fusion_hub::{Disposition, Engine, EngineConfig};
//!
//! let mut engine = Engine::new(EngineConfig::new(HubId::new("hub")?, 1));
//! for tenth in 0..10_i32 {
//!     let captured_at = Timestamp::EPOCH + Span::from_millis(i64::from(100 * tenth));
//!     let id = FrameId { agent: AgentId::new("camera")?, epoch: 1, sequence: u64::try_from(tenth)? };
//!     let bev = BevBox { x: f64::from(tenth), y: 5.0, w: 1.8, d: 4.5, yaw: 0.0 }; // 10 m/s east
//!     let position = Covariance2::isotropic(0.04); // m²
//!     let covariance = BoxCovariance { position, ww: 0.04, dd: 0.04, yaw: 0.01 };
//!     let car = Detection { class: Class::Car, score: 0.9, bev, covariance, velocity: None, heading: v2x_common::detection::HeadingKind::Known, source_track: None };
//!     let frame = DetectionFrame { detections: vec![car], ..DetectionFrame::empty(id, captured_at) };
//!     let received_at = captured_at + Span::from_millis(60);
//!     assert!(matches!(engine.handle_frame(&frame, received_at), Disposition::Accepted { .. }));
//! }
//! let fused = engine.fused(Timestamp::EPOCH + Span::from_millis(1000));
//! assert_eq!(fused.objects.len(), 1);
//! assert!((fused.objects[0].bev.x - 10.0).abs() < 0.5 && (fused.objects[0].velocity.0 - 10.0).abs() < 2.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate's folders are its layers, lowest first: `values`, then `association` and `filter`, `baselines` and
//! `particles`, `track`, `tracker`, `duplicates`, `learning`, `publish` and `registration`, `fusion`, `engine`, `diagnosis` and `standby`, `hub`. ARCHITECTURE.md
//! says what is where. Modules that are hidden here serve the tests and benchmarks of this workspace.

#[doc(hidden)]
pub mod association;
#[doc(hidden)]
pub mod baselines;
pub mod diagnosis;
mod duplicates;
pub mod engine;
#[doc(hidden)]
pub mod filter;
pub mod fusion;
#[cfg(feature = "core")]
pub mod hub;
pub mod learning;
#[doc(hidden)]
pub mod parameters;
#[doc(hidden)]
pub mod particles;
mod publish;
pub mod registration;
#[cfg(feature = "core")]
mod standby;
#[doc(hidden)]
pub mod track;
mod tracker;
pub mod values;

pub use engine::{Disposition, Engine, EngineConfig, Refusal};
pub use fusion::{
    AdmittedFrame, FrameOutcome, Fusion, FusionMethod, ObjectList, TrackCounts, TrackingConfig, WindowConfig,
    preset,
};
#[cfg(feature = "core")]
pub use hub::HubSettings;
#[cfg(feature = "net")]
pub use hub::{HubError, HubSetup, serve};
