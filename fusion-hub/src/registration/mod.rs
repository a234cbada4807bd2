//! Clock and pose errors of agents, estimated from the objects that they share, and taken out: sensor registration.
//!
//! **Model.** An agent errs by b = (dx, dy, ψ, δ): its pose lies (dx, dy) off and is turned by ψ, its stamps are ahead
//! of the time by δ. For an object at p, seen from s, with velocity v and turn rate ω *at the stamp*
//! (`model.rs`; J turns by 90°):
//!
//! ```text
//! z − p = (dx, dy) + ψ J (z − s) − v δ + noise          heading: ψ − ω δ + noise
//! ```
//!
//! Two agents that report one track make a difference d = zₐ − z_b − v (tₐ − t_b) = Hₐ bₐ − H_b b_b + noise, in which the
//! object itself has gone: what is left is linear in both agents' errors. Each report is used once with each other agent,
//! with one partner when it comes ([`Shared`]). Differences are made good for what was corrected, so that nothing is fed
//! back.
//!
//! **Estimate** (`joint.rs`). All agents together, as multisensor bias estimation has it since Dela Cruz, Alouani, Rice &
//! Blair (1992); the differences are the pseudo-measurements of Lin, Kirubarajan & Bar-Shalom (2005). Each error is an
//! Ornstein-Uhlenbeck process of the declared accuracy σ and a correlation time of [`MEMORY_S`]: without data it is
//! anything that was declared again. In units of σ the prior is N(0, 1), and a step and a batch of differences (Λ, η) are
//!
//! ```text
//! m ← φ m,  P ← φ² P + (1 − φ²) 1,  φ = e^(−Δ/τ)        P ← (P⁻¹ + Λ)⁻¹,  m ← m + P (η − Λ m)
//! ```
//!
//! The pose may err anew in each frame, too, and alike for all that the frame reports. How much of what is declared that
//! is, is estimated beside it (`whiteness.rs`), and a frame's information is what is left when it is integrated out
//! (`group.rs`).
//!
//! **Gauge.** A common error of all shows in no difference. An agent that declares at most [`REFERENCE`] is a reference
//! and never corrected; who shares no object with one, nor with somebody who does, is *relative only* and is not
//! corrected either. Where all shared objects move alike, a clock that is ahead looks like a pose that lies behind: the
//! two are *confounded*, and neither is corrected.
//!
//! **Correction** (`decision.rs`, `correct.rs`). What is observable and significant is taken out of a frame before anything
//! else is done with it, never more than was declared. The estimate's own uncertainty is added nowhere: it is less than
//! half of the declared error, for which nothing is added either, and being common to all reports of an agent it would be
//! averaged away if it were added to each.

mod cholesky;
mod correct;
mod decision;
mod group;
mod joint;
mod links;
mod model;
mod registrar;
mod report;
mod roll;
mod whiteness;

pub use correct::correct;
pub use model::{Bias, Shared, Sighting, Source};
pub use registrar::Registrar;
pub use report::{AgentRegistration, Observable};
pub use roll::{MAX_REGISTERED, Slot};

use serde::{Deserialize, Serialize};
use v2x_common::sensor::Accuracy;
use v2x_common::time::Span;

/// Correlation time of an agent's errors, s. Clocks and poses drift within minutes.
pub const MEMORY_S: f64 = 60.0;
/// Reports further apart in time are not compared: half a period at 3 Hz.
pub const LONGEST_GAP: Span = Span::from_millis(150);
/// Shared objects of one frame that are compared at most: more tell little of an error that the frame has in common.
pub const MAX_SHARED_OF_FRAME: usize = 8;
/// Reports of a track after which its velocity is believed.
pub const REPORTS_FOR_VELOCITY: u32 = 5;
/// Who declares no more than this is a reference: it has been surveyed (0.1 m, 0.1°, 1 ms).
pub const REFERENCE: Accuracy =
    Accuracy { position_m: 0.1, yaw_rad: 0.1 / 57.295_779_513_082_32, clock_s: 1e-3 };

/// What is done about agents' clock and pose errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Registration {
    /// Nothing.
    Off,
    /// They are estimated and told.
    Estimate,
    /// They are estimated, and taken out where that is sure.
    #[default]
    Correct,
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    let general = [
        ("registration.memory_s", MEMORY_S.to_string()),
        ("registration.longest_gap_s", LONGEST_GAP.as_secs_f64().to_string()),
        ("registration.shared_of_frame", MAX_SHARED_OF_FRAME.to_string()),
        ("registration.reports_for_velocity", REPORTS_FOR_VELOCITY.to_string()),
        ("registration.reference", format!("{REFERENCE:?}")),
    ];
    [
        general.to_vec(),
        roll::listed(),
        model::listed(),
        group::listed(),
        whiteness::listed(),
        links::listed(),
        decision::listed(),
    ]
    .concat()
}
