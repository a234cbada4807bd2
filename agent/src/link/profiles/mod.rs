//! Links by name.
//!
//! The radio profiles are engineering fits to a few published moments, not measured distributions; each says where
//! its moments come from.

use super::trace::{Trace, TraceError};
use super::{Delay, LinkConfig, Loss, Outage};
use crate::pose_error::PoseError;
use std::path::PathBuf;
use std::sync::Arc;
use v2x_common::time::Span;

/// σ of position and heading in V2X-ViT's and OpenCOOD's noisy setting, m and degrees.
const V2XVIT_POSITION_M: f64 = 0.2;
const V2XVIT_YAW_DEG: f64 = 0.2;

/// A link that can be named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    /// Its name, with what must or may be told.
    pub usage: &'static str,
    /// Where its figures come from.
    pub provenance: &'static str,
    /// A text that can be parsed, as an example.
    pub example: &'static str,
}

/// All links that can be named.
pub const PROFILES: [Profile; 12] = [
    Profile { usage: "ideal", provenance: "no delay, no loss", example: "ideal" },
    Profile {
        usage: "its-g5",
        provenance: "fit: mean 4 ms in line of sight (802.11p field test); no loss figure published",
        example: "its-g5",
    },
    Profile {
        usage: "pc5",
        provenance: "fit: median below 20 ms, packet errors below 10 % to 1200 m (PC5 trial, Electronics 14(22):4509); \
                     taken as 18 ms and 5 %",
        example: "pc5",
    },
    Profile {
        usage: "lte-uu",
        provenance: "fit: median 50 ms, p95 below 60 ms (LTE-Uu trial, Electronics 14(22):4509)",
        example: "lte-uu",
    },
    Profile {
        usage: "5g-mec",
        provenance: "fit: half of 5g-cloud (TARGET-X 2026: edge computing halves it)",
        example: "5g-mec",
    },
    Profile {
        usage: "5g-cloud",
        provenance: "fit: 40 to 50 ms of service latency, 5G NSA (TARGET-X 2026)",
        example: "5g-cloud",
    },
    Profile {
        usage: "cell-gamma:min=50ms,exp=150ms",
        provenance: "Eclipse MOSAIC, cellular: min + Gamma(2, 2) (exp - min) / 4; the numbers of its demo",
        example: "cell-gamma:min=50ms,exp=150ms",
    },
    Profile {
        usage: "v2xvit-noisy",
        provenance: "V2X-ViT's and OpenCOOD's noisy setting: always 100 ms; in a scenario it brings their \
                     pose noise too (0.2 m, 0.2°, anew in each frame) where the agent has no pose_error",
        example: "v2xvit-noisy",
    },
    Profile {
        usage: "cobevflow:p=0.3",
        provenance: "CoBEVFlow: Binomial(10, p) frames of 100 ms",
        example: "cobevflow:p=0.3",
    },
    Profile {
        usage: "dair-async-1 | dair-async-2",
        provenance: "DAIR-V2X's asynchronous sets: one or two frames of 100 ms",
        example: "dair-async-1",
    },
    Profile {
        usage: "trace:FILE",
        provenance: "your recording: CSV with the columns t (s), delay (s) and perhaps lost (0 or 1)",
        example: "ideal",
    },
    Profile {
        usage: "custom:delay=80ms,jitter=30ms,loss=0.01,burst=3,rate=2Mbps",
        provenance: "your numbers: a normal delay truncated at 0, bursts of losses (Gilbert-Elliott), a finite rate",
        example: "custom:delay=80ms,jitter=30ms,loss=0.01,burst=3,rate=2Mbps",
    },
];

/// A link's name cannot be understood.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// No such link.
    #[error(
        "no link {name:?}; there are ideal, its-g5, pc5, lte-uu, 5g-mec, 5g-cloud, cell-gamma:, v2xvit-noisy, cobevflow:, dair-async-1, dair-async-2, trace:, custom: (see v2x links)"
    )]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// A setting that this link has not, or that is told twice.
    #[error("{name}: {key} cannot be set here, or twice; expected {expected}")]
    Setting {
        /// The link.
        name: String,
        /// The setting.
        key: String,
        /// What may be set.
        expected: &'static str,
    },
    /// A value that cannot be.
    #[error("{key} is {value:?}, expected {expected}")]
    Value {
        /// The setting.
        key: &'static str,
        /// What it holds.
        value: String,
        /// What it may hold.
        expected: &'static str,
    },
    /// A file that cannot be read.
    #[error("trace {}: {reason}", .path.display())]
    File {
        /// Which one.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A recording that cannot be used.
    #[error("trace {}: {source}", .path.display())]
    Trace {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: TraceError,
    },
}

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
    read: impl Fn(&PathBuf) -> Result<String, String>,
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

/// A delay by a link's name, such as `custom:delay=60ms,jitter=10ms`, for what takes time and nothing else.
pub fn parse_delay(
    text: &str,
    read: impl Fn(&PathBuf) -> Result<String, String>,
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

/// The error of an agent's pose that comes with a link of this name: published settings go together.
pub fn pose_error(text: &str) -> Option<PoseError> {
    let name = text.split(':').next().unwrap_or_default().trim();
    (name == "v2xvit-noisy").then(|| PoseError {
        position_m: V2XVIT_POSITION_M,
        yaw_rad: V2XVIT_YAW_DEG.to_radians(),
        ..PoseError::default()
    })
}

fn trace(
    path: PathBuf,
    read: impl Fn(&PathBuf) -> Result<String, String>,
) -> Result<LinkConfig, ProfileError> {
    let text = read(&path).map_err(|reason| ProfileError::File { path: path.clone(), reason })?;
    let trace = Trace::from_csv(&text).map_err(|source| ProfileError::Trace { path, source })?;
    Ok(LinkConfig { delay: Delay::Trace(Arc::new(trace)), ..LinkConfig::default() })
}

/// What is set, `key=value` with commas between.
struct Settings<'a> {
    name: &'a str,
    left: Vec<(&'a str, &'a str)>,
}

const EXPECTED: &str = "delay, jitter, loss, burst, rate, outage, outage-every or reorder, once each";

impl<'a> Settings<'a> {
    fn of(name: &'a str, text: &'a str) -> Result<Self, ProfileError> {
        let parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
        let pair = |part: &'a str| part.split_once('=').map(|(key, value)| (key.trim(), value.trim()));
        let left: Option<Vec<_>> = parts.map(pair).collect();
        let bare = || ProfileError::Value { key: "a setting", value: text.to_owned(), expected: "key=value" };
        Ok(Self { name, left: left.ok_or_else(bare)? })
    }

    fn take(&mut self, key: &str) -> Option<&'a str> {
        let place = self.left.iter().position(|(one, _)| *one == key)?;
        Some(self.left.remove(place).1)
    }

    fn refused(&self, key: &str) -> ProfileError {
        ProfileError::Setting { name: self.name.to_owned(), key: key.to_owned(), expected: EXPECTED }
    }

    fn end(self) -> Result<(), ProfileError> {
        self.left.first().map_or(Ok(()), |(key, _)| Err(self.refused(key)))
    }

    fn number(
        &mut self,
        key: &'static str,
        units: &[(&str, f64)],
        (range, expected): (std::ops::RangeInclusive<f64>, &'static str),
    ) -> Result<Option<f64>, ProfileError> {
        let Some(text) = self.take(key) else { return Ok(None) };
        let unit = units.iter().find(|(unit, _)| text.ends_with(unit));
        let (digits, factor) =
            unit.map_or((text, None), |(unit, factor)| (&text[..text.len() - unit.len()], Some(factor)));
        // Without a unit nobody knows what is meant, but for pure numbers.
        let factor = if units.is_empty() { Some(&1.0) } else { factor };
        let value = factor.and_then(|factor| Some(digits.trim().parse::<f64>().ok()? * factor));
        let value = value.filter(|value| range.contains(value));
        value.map(Some).ok_or_else(|| ProfileError::Value { key, value: text.to_owned(), expected })
    }

    fn seconds(&mut self, key: &'static str) -> Result<Option<f64>, ProfileError> {
        let expected = "a time from 0 to 600 s, such as 80ms or 0.5s";
        self.number(key, &[("us", 1e-6), ("ms", 1e-3), ("s", 1.0)], (0.0..=600.0, expected))
    }

    fn share(&mut self, key: &'static str) -> Result<Option<f64>, ProfileError> {
        self.number(key, &[], (0.0..=1.0, "0 to 1"))
    }

    fn flag(&mut self, key: &'static str) -> Result<Option<bool>, ProfileError> {
        let Some(text) = self.take(key) else { return Ok(None) };
        let expected = "true or false";
        text.parse().map(Some).map_err(|_| ProfileError::Value { key, value: text.to_owned(), expected })
    }

    fn loss(&mut self, published: f64) -> Result<Loss, ProfileError> {
        let rate = self.share("loss")?.unwrap_or(published);
        let burst = self.number("burst", &[], (1.0..=1e6, "1 to 1000000 frames"))?;
        // Good times are at least as long as bursts can let them be.
        if let Some(burst) = burst
            && rate < 1.0
            && rate / (burst * (1.0 - rate)) > 1.0
        {
            let expected = "at least loss / (1 - loss): shorter bursts cannot lose that much";
            return Err(ProfileError::Value { key: "burst", value: burst.to_string(), expected });
        }
        Ok(Loss { rate, burst })
    }

    fn rate(&mut self) -> Result<Option<f64>, ProfileError> {
        let units = [("kbps", 1e3), ("Mbps", 1e6), ("Gbps", 1e9), ("bps", 1.0)];
        self.number("rate", &units, (1.0..=1e12, "a rate such as 500kbps or 6Mbps"))
    }

    fn outage(&mut self) -> Result<Option<Outage>, ProfileError> {
        let (length, every) = (self.seconds("outage")?, self.seconds("outage-every")?);
        match (length, every) {
            (None, None) => Ok(None),
            (Some(length), Some(every)) if length <= every && every > 0.0 => {
                let [length, every] = [length, every].map(Span::from_secs_f64);
                Ok(Some(Outage { every, length }))
            }
            _ => Err(ProfileError::Value {
                key: "outage",
                value: length.map_or(String::new(), |length| length.to_string()),
                expected: "a time no longer than outage-every, and both",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn settings_replace_what_a_profile_has() {
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
