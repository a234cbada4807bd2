//! A hub and agents as real processes, and consumers and foreign clients in the test, over real Zenoh on
//! free ports.
//!
//! Every wait is for an event, mostly for the next fused frame. A hub publishes at least ten of them per second.

mod agents;
mod folder;
mod foreign;
mod hub_restart;
mod isolation;
mod link;
mod methods;
mod offline;
mod recorded;
mod refusals;
mod standby;
mod status;
mod sweep;
mod unread_answers;

mod support;
