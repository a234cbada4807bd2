//! Only those with a certificate take part, and each says only what it may say.

mod flood;
mod folder;
mod handshakes;
mod network;
mod pinned;
mod spoofing;
mod standby;
mod who;
