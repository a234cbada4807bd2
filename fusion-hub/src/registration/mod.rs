//! Clock and pose errors of agents, estimated from the objects that they share, and corrected: sensor registration.
//!
//! **Model.** An agent errs by b = (dx, dy, ψ, δ): its pose lies (dx, dy) off and is turned by ψ, its stamps are ahead
//! of the time by δ. For an object at p, detected from s, with velocity v and turn rate ω *at the stamp*
//! (`model.rs`; J turns by 90°):
//!
//! ```text
//! z − p = (dx, dy) + ψ J (z − s) − v δ + noise          heading: ψ − ω δ + noise
//! ```
//!
//! Two agents that report one track make a difference d = zₐ − z_b − v (tₐ − t_b) = Hₐ bₐ − H_b b_b + noise, in which
//! the object itself cancels: what is left is linear in both agents' errors. Each report is used once with each other
//! agent, with one partner when it comes ([`SharedObject`]). Corrections already applied are added back to the
//! differences, so that nothing is fed back.
//!
//! **Estimate** (`joint.rs`). All agents together, as in multisensor bias estimation since Dela Cruz, Alouani, Rice &
//! Blair (1992); the differences are the pseudo-measurements of Lin, Kirubarajan & Bar-Shalom (2005). Each error is an
//! Ornstein-Uhlenbeck process of the declared accuracy σ and a correlation time of [`MEMORY_S`]: without data it is
//! the declared accuracy again. In units of σ the prior is N(0, 1), and a step and a batch of differences (Λ, η) are
//!
//! ```text
//! m ← φ m,  P ← φ² P + (1 − φ²) 1,  φ = e^(−Δ/τ)        P ← (P⁻¹ + Λ)⁻¹,  m ← m + P (η − Λ m)
//! ```
//!
//! The pose may also have an error that is independent for each frame and common to its detections. Its share of the
//! declared variance is estimated as well (`whiteness.rs`), and a frame's information is what is left when it is
//! integrated out (`group.rs`).
//!
//! **Gauge.** A common error of all agents is not observable. An agent that declares at most [`REFERENCE`] is a
//! reference and never corrected; an agent without a chain of shared objects to a reference is *relative only* and is
//! not corrected either. Where all shared objects move alike, a clock error and a pose error have the same effect: the
//! two are *confounded*, and neither is corrected.
//!
//! **Correction** (`decision.rs`, `correct.rs`). Observable and significant errors are corrected in a frame before any
//! other step, never by more than was declared. What is left, the estimate's own uncertainty and what changes from frame
//! to frame, is common to all reports of an agent and no noise: tracks keep it apart (`values/pose_errors.rs`).

mod cholesky;
mod correct;
mod decision;
mod group;
mod joint;
mod links;
mod model;
mod pair;
mod pairs;
mod registered;
mod registrar;
mod report;
mod settings;
mod slot;
mod whiteness;

pub use correct::correct;
pub use model::{Bias, RegistrationReport, SharedObject, Source};
pub(crate) use pairs::PairFinder;
pub use registrar::Registrar;
pub use report::{AgentRegistration, Observable};
pub use settings::{
    LONGEST_GAP, MAX_SHARED_OF_FRAME, MEMORY_S, REFERENCE, REPORTS_FOR_VELOCITY, Registration,
};
pub use slot::{MAX_REGISTERED, RegistrationSlot};

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    [
        settings::listed(),
        registered::listed(),
        model::listed(),
        group::listed(),
        whiteness::listed(),
        links::listed(),
        decision::listed(),
    ]
    .concat()
}
