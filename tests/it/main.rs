//! Multi-process tests over real Zenoh.
