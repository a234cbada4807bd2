//! The wire by its public interface: resolution, sizes, damaged bytes, golden files, JSON twin, schemas; and what
//! consumers make of it: followed lists, tiles.

#[cfg(test)]
mod damage;
#[cfg(test)]
mod fixture;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod json_twin;
#[cfg(test)]
mod layout;
#[cfg(test)]
mod lists;
#[cfg(test)]
mod refusals;
#[cfg(test)]
mod round_trip;
#[cfg(test)]
mod schemas;
#[cfg(test)]
mod sizes;
#[cfg(test)]
mod strategy;
#[cfg(test)]
mod tiles;
