//! The live view: a page on this machine that shows a network in a browser.

mod address;
mod browsers;
mod errors;
mod feed;
mod guard;
mod http;
mod mailbox;
mod message;
mod page;
mod picture;
mod presence;
mod rounding;
mod scene;
mod site;
mod source;

pub(crate) use address::WebArgs;
pub(crate) use scene::Scene;
pub(crate) use site::{Live, Site};
pub(crate) use source::Source;
