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
//! with one partner when it comes ([`SharedObject`]). Differences are made good for what was corrected, so that nothing is fed
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
