//! Only those with a certificate take part, and each says only what it may say.

mod folder;
mod handshakes;
mod network;
mod spoofing;
mod standby;
mod who;
