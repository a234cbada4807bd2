//! The network in Foxglove or Lichtblick, live: `v2x watch --foxglove`. The server is a feature, because it brings 38 crates.

mod address;
#[cfg(feature = "foxglove")]
mod server;

pub(crate) use address::FoxgloveArgs;
#[cfg(feature = "foxglove")]
pub(crate) use server::serve;

#[cfg(not(feature = "foxglove"))]
pub(crate) async fn serve(
    _: std::net::SocketAddr,
    _: &v2x_common::net::session::SessionOptions,
    _: (v2x_common::id::NetworkId, Option<v2x_common::id::HubId>),
    _: &tokio_util::sync::CancellationToken,
) -> anyhow::Result<()> {
    anyhow::bail!(
        "this v2x was built without Foxglove's server; run cargo run --release -p v2x --features foxglove -- watch \
         --foxglove, or open a recording (v2x record run.mcap) in Foxglove"
    )
}
