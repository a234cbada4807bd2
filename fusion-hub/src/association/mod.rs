//! Which detection is of which track: gate, cost, optimal assignment.

pub mod assignment;
mod associator;
mod candidates;
mod class_cost;
mod config;
pub mod csba;
pub(crate) mod gate;
mod grid;
pub mod likelihood;
mod tail;
#[cfg(test)]
mod tests;

pub use associator::Associator;
pub(crate) use class_cost::is_confusable;
#[cfg(test)]
pub(crate) use class_cost::listed as classes_listed;
pub use config::{AssociationConfig, AssociationCost, ClassRule, EUCLIDEAN_REACH_M};
