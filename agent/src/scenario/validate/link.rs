//! The link of an agent.

use super::field::Field;
use crate::link::{Delay, LinkConfig, Loss};
use crate::pose_error::PoseError;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::TomlLink;

/// The link, and the pose error that belongs to its profile.
pub(super) fn link(
    field: &Field<'_>,
    file: TomlLink,
) -> Result<(LinkConfig, Option<PoseError>), ScenarioError> {
    let file = match file {
        TomlLink::Named(link, pose_error) => return Ok((link, pose_error)),
        TomlLink::Numbers(numbers) => numbers,
    };
    let millis = |name, value: Option<f64>| {
        let value = value.unwrap_or(0.0);
        field.number(name, value, (0.0..=10_000.0).contains(&value), "0 to 10000")
    };
    let (loss, default) = (file.loss.unwrap_or(0.0), LinkConfig::default());
    let rate = field.number("loss", loss, (0.0..=1.0).contains(&loss), "0 to 1")?;
    // Shorter bursts cannot lose that much.
    let shortest = (rate / (1.0 - rate)).clamp(1.0, 1e6);
    let burst = |burst: f64| {
        field.number("burst", burst, (shortest..=1e6).contains(&burst), &format!("{shortest:.3} to 1000000"))
    };
    let kbps = |kbps: f64| field.number("rate_kbps", kbps, (0.001..=1e9).contains(&kbps), "0.001 to 1e9");
    let delay = Delay::Normal {
        mean_s: millis("delay_ms", file.delay_ms)? / 1e3,
        sigma_s: millis("jitter_ms", file.jitter_ms)? / 1e3,
    };
    let link = LinkConfig {
        delay,
        loss: Loss { rate, burst: file.burst.map(burst).transpose()? },
        rate_bps: file.rate_kbps.map(kbps).transpose()?.map(|kbps| 1e3 * kbps),
        reorder: file.reorder.unwrap_or(default.reorder),
        ..default
    };
    Ok((link, None))
}
