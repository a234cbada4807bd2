//! The times of an agent: capturing, sensing, sending, its clock.

use v2x_common::time::Span;

use super::field::Field;
use crate::clock::ClockError;
use crate::link::Delay;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlClock, TomlPhase, TomlSend, TomlSensing, TomlTransmit};
use crate::sending::{SendRule, Transmit};
use crate::timing::Phase;

/// Largest offset of a clock, ms.
const MAX_OFFSET_MS: f64 = 60_000.0;
/// Largest drift: ten times that of a bad quartz.
const MAX_DRIFT_PPM: f64 = 1000.0;

/// The phase in the child `name`.
pub(super) fn phase(field: &Field<'_>, name: &str, file: Option<TomlPhase>) -> Result<Phase, ScenarioError> {
    let millis = match file {
        Some(TomlPhase::Random) => return Ok(Phase::Random),
        Some(TomlPhase::Millis(millis)) => millis,
        None => 0.0,
    };
    field.number(name, millis, (0.0..=60_000.0).contains(&millis), "0 to 60000 or \"random\"")?;
    Ok(Phase::Fixed(Span::from_secs_f64(millis / 1e3)))
}

pub(super) fn sensing(field: &Field<'_>, file: Option<TomlSensing>) -> Result<Delay, ScenarioError> {
    let millis = match file {
        Some(TomlSensing::Named(delay)) => return Ok(delay),
        Some(TomlSensing::Millis(millis)) => millis,
        None => 0.0,
    };
    field.number("sensing_ms", millis, (0.0..=10_000.0).contains(&millis), "0 to 10000")?;
    Ok(Delay::constant(millis / 1e3))
}

pub(super) fn transmit(field: &Field<'_>, file: Option<TomlTransmit>) -> Result<Transmit, ScenarioError> {
    let Some(TomlTransmit::Slotted(file)) = file else { return Ok(Transmit::Immediately) };
    let period_ms = file.period_ms;
    field.number("period_ms", period_ms, (1.0..=10_000.0).contains(&period_ms), "1 to 10000")?;
    let period = Span::from_secs_f64(period_ms / 1e3);
    Ok(Transmit::Slotted { period, phase: phase(field, "phase_ms", file.phase_ms)? })
}

pub(super) fn clock(field: &Field<'_>, file: &TomlClock) -> Result<ClockError, ScenarioError> {
    let offset_ms = file.offset_ms.unwrap_or(0.0);
    field.number("offset_ms", offset_ms, offset_ms.abs() <= MAX_OFFSET_MS, "-60000 to 60000")?;
    let drift_ppm = file.drift_ppm.unwrap_or(0.0);
    field.number("drift_ppm", drift_ppm, drift_ppm.abs() <= MAX_DRIFT_PPM, "-1000 to 1000")?;
    Ok(ClockError { offset: Span::from_secs_f64(offset_ms / 1e3), drift_ppm })
}

pub(super) const fn rule(file: Option<TomlSend>) -> SendRule {
    match file {
        None | Some(TomlSend::Periodic) => SendRule::Periodic,
        Some(TomlSend::Etsi) => SendRule::Etsi,
    }
}
