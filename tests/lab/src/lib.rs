//! The laboratory: running ([`loopback`]), driving, scoring and reporting cooperative-perception networks.

#[cfg(feature = "lab")]
pub mod commands;
#[cfg(feature = "lab")]
pub mod data;
#[cfg(feature = "lab")]
pub mod drive;
#[cfg(feature = "loopback")]
pub mod loopback;
#[cfg(feature = "lab")]
pub mod report;
#[cfg(feature = "lab")]
pub mod score;
