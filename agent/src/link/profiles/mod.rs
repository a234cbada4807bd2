//! Links by name.
//!
//! The radio profiles are engineering fits to a few published moments, not measured distributions; each names the
//! source of its moments.

mod error;
mod settings;
mod table;

use super::delay::Delay;
use super::loss::Loss;
use super::trace::Trace;
use super::transit::LinkConfig;
use crate::pose_error::PoseError;
use settings::Settings;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use error::ProfileError;
pub use table::{PROFILES, Profile};

/// σ of position and heading in V2X-ViT's and OpenCOOD's noisy setting, m and degrees.
const V2XVIT_POSITION_M: f64 = 0.2;
const V2XVIT_YAW_DEG: f64 = 0.2;

/// σ of the logarithm such that 95 % lie below `p95` where half lie below `median`.
fn sigma_ln(median: f64, p95: f64) -> f64 {
    const Z95: f64 = 1.644_853_626_951_472;
    libm::log(p95 / median) / Z95
}

const fn log_normal(median_s: f64, sigma_ln: f64) -> Delay {
    Delay::LogNormal { median_s, sigma_ln }
}

/// The link of a name such as `lte-uu`, `cell-gamma:min=50ms,exp=150ms`, or `its-g5:loss=0.1,burst=4`. Any of them can
/// be given `loss`, `burst`, `rate`, `outage-every`, `outage` and `reorder`. `read` reads a file.
pub fn parse(
    text: &str,
    read: impl Fn(&Path) -> std::io::Result<String>,
) -> Result<LinkConfig, ProfileError> {
    let (name, settings) = text.trim().split_once(':').unwrap_or((text.trim(), ""));
    if name == "trace" {
        return trace(settings.into(), read);
    }
    let mut settings = Settings::of(name, settings)?;
    let delay = match name {
        "ideal" | "custom" => Delay::constant(0.0),
        "its-g5" => Delay::Gamma { min_s: 0.001, expected_s: 0.004 },
        "pc5" => log_normal(0.018, sigma_ln(0.018, 0.04)),
        "lte-uu" => log_normal(0.05, sigma_ln(0.05, 0.06)),
        "5g-mec" => log_normal(0.0225, sigma_ln(0.0225, 0.025)),
        "5g-cloud" => log_normal(0.045, sigma_ln(0.045, 0.05)),
        "v2xvit-noisy" | "dair-async-1" => Delay::constant(0.1),
        "dair-async-2" => Delay::constant(0.2),
        "cell-gamma" => Delay::Gamma {
            min_s: settings.seconds("min")?.unwrap_or(0.05),
            expected_s: settings.seconds("exp")?.unwrap_or(0.15),
        },
        "cobevflow" => Delay::Frames { p: settings.share("p")?.unwrap_or(0.3), frame_s: 0.1 },
        _ => return Err(ProfileError::Unknown { name: name.to_owned() }),
    };
    if let Delay::Gamma { min_s, expected_s } = delay
        && expected_s < min_s
    {
        return Err(ProfileError::Value {
            key: "exp",
            value: expected_s.to_string(),
            expected: "at least min",
        });
    }
    let (mean_s, jitter_s) = (settings.seconds("delay")?, settings.seconds("jitter")?);
    let delay = delay.with(mean_s, jitter_s).ok_or_else(|| settings.refused("delay or jitter"))?;
    let published_loss = if name == "pc5" { 0.05 } else { 0.0 };
    let link = LinkConfig {
        delay,
        loss: settings.loss(published_loss)?,
        rate_bps: settings.rate()?,
        outage: settings.outage()?,
        reorder: settings.flag("reorder")?.unwrap_or(true),
    };
    settings.end()?;
    Ok(link)
}

/// A delay by a link's name, such as `custom:delay=60ms,jitter=10ms`; refused where the link does more than delay.
pub fn parse_delay(
    text: &str,
    read: impl Fn(&Path) -> std::io::Result<String>,
) -> Result<Delay, ProfileError> {
    let link = parse(text, read)?;
    let loses = matches!(&link.delay, Delay::Trace(trace) if trace.loses());
    let is_delay_alone = link.loss == Loss::default() && link.rate_bps.is_none() && link.outage.is_none();
    if is_delay_alone && link.reorder && !loses {
        return Ok(link.delay);
    }
    let expected = "a delay alone: without loss, rate, outage or reorder";
    Err(ProfileError::Value { key: "sensing", value: text.to_owned(), expected })
}

/// The pose error that belongs to a link of this name, where its source publishes both.
pub fn pose_error(text: &str) -> Option<PoseError> {
    let name = text.split(':').next().unwrap_or_default().trim();
    (name == "v2xvit-noisy").then(|| PoseError {
        position_m: V2XVIT_POSITION_M,
        yaw_rad: V2XVIT_YAW_DEG.to_radians(),
        ..PoseError::default()
    })
}

fn trace(path: PathBuf, read: impl Fn(&Path) -> std::io::Result<String>) -> Result<LinkConfig, ProfileError> {
    let text = match read(&path) {
        Ok(text) => text,
        Err(source) => return Err(ProfileError::File { path, source }),
    };
    let trace = Trace::from_csv(&text).map_err(|source| ProfileError::Trace { path, source })?;
    Ok(LinkConfig { delay: Delay::Trace(Arc::new(trace)), ..LinkConfig::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Span;

    fn link(text: &str) -> Result<LinkConfig, ProfileError> {
        parse(text, |_| Ok("t,delay\n0,0.25\n".to_owned()))
    }

    #[test]
    fn every_profile_can_be_named() {
        for profile in PROFILES {
            assert!(link(profile.example).is_ok(), "{}", profile.example);
        }
        assert!(matches!(link("trace:any.csv").unwrap().delay, Delay::Trace(_)));
    }

    #[test]
    fn a_trace_that_cannot_be_read_names_the_file_and_keeps_the_systems_error() {
        let missing = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
        let error = parse("trace:night.csv", missing).unwrap_err();
        assert!(error.to_string().starts_with("trace night.csv: "), "{error}");
        assert!(
            matches!(error, ProfileError::File { source, .. } if source.kind() == std::io::ErrorKind::NotFound)
        );
    }

    #[test]
    fn settings_replace_those_of_the_profile() {
        let custom = link("custom:delay=80ms,jitter=30ms,loss=0.01,burst=3,rate=2Mbps").unwrap();
        assert_eq!(custom.delay, Delay::Normal { mean_s: 0.08, sigma_s: 0.03 });
        assert_eq!((custom.loss, custom.rate_bps), (Loss { rate: 0.01, burst: Some(3.0) }, Some(2e6)));
        let radio = link("its-g5:loss=0.1,burst=4,reorder=false,outage=1s,outage-every=10s").unwrap();
        assert_eq!(radio.delay, link("its-g5").unwrap().delay);
        assert_eq!((radio.loss.rate, radio.reorder), (0.1, false));
        assert_eq!(radio.outage.unwrap().length, Span::from_millis(1000));
    }

    #[test]
    fn errors_name_the_setting_and_its_value() {
        for (text, named) in [
            ("6g", "no link \"6g\""),
            ("custom:delay=80", "delay is \"80\", expected a time"),
            ("custom:loss=2", "loss is \"2\", expected 0 to 1"),
            ("custom:speed=3", "speed cannot be set"),
            ("custom:loss=0.1,loss=0.2", "loss cannot be set here, or twice"),
            ("cobevflow:delay=10ms", "delay or jitter cannot be set"),
            ("cell-gamma:min=200ms,exp=100ms", "exp is \"0.1\", expected at least min"),
            ("custom:loss=0.9,burst=2", "burst is \"2\""),
            ("custom:outage=3s", "both"),
            ("custom:fast", "key=value"),
        ] {
            let message = link(text).unwrap_err().to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
    }
}
