//! The link between an agent and the hub: whether and when a frame arrives.

mod delay;
mod loss;
mod outbox;
pub mod profiles;
pub mod trace;
mod transit;

pub use delay::Delay;
pub use loss::Loss;
pub use outbox::Outbox;
pub use transit::{Link, LinkConfig, Outage, Parcel, Transit};
