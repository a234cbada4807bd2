//! Late fusion of a single instant, the published rules: the reports of several agents at one time become one list,
//! without memory and without motion. The rules of the paper's comparison (Table II; deploy/docs/methods.md).
//!
//! All rules are class-aware: reports of incompatible classes are never of one object (deploy/docs/methods.md). Where a
//! rule takes two lists, further agents are fused one after another into the list so far.

pub mod csba_wls;
pub mod dair_v2x;
pub mod infradet3d;
mod mean;
pub mod nms;
mod pairing;
pub mod psa;
mod report;
mod rule;
#[cfg(test)]
mod testing;
pub mod wbf;

pub use psa::Ties;
pub use report::{Fused, Member, Report};
pub use rule::Rule;
