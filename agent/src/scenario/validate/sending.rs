//! What was typed of an agent's times: capturing, sensing, sending, its clock.

use v2x_common::time::Span;

use super::super::typed::{TypedClock, TypedPhase, TypedSend, TypedSensing, TypedTransmit};
use super::super::{Phase, ScenarioError};
use super::Field;
use crate::clock::ClockError;
use crate::link::Delay;
use crate::sending::{SendRule, Transmit};

/// Largest offset of a clock, ms.
const MAX_OFFSET_MS: f64 = 60_000.0;
/// Largest drift: ten times that of a bad quartz.
const MAX_DRIFT_PPM: f64 = 1000.0;

impl Field<'_> {
    /// The phase in the child `name`.
    pub(super) fn phase(&self, name: &str, typed: Option<TypedPhase>) -> Result<Phase, ScenarioError> {
        let millis = match typed {
            Some(TypedPhase::Random) => return Ok(Phase::Random),
            Some(TypedPhase::Millis(millis)) => millis,
            None => 0.0,
        };
        self.number(name, millis, (0.0..=60_000.0).contains(&millis), "0 to 60000 or \"random\"")?;
        Ok(Phase::Fixed(Span::from_secs_f64(millis / 1e3)))
    }

    pub(super) fn sensing(&self, typed: Option<TypedSensing>) -> Result<Delay, ScenarioError> {
        let millis = match typed {
            Some(TypedSensing::Named(delay)) => return Ok(delay),
            Some(TypedSensing::Millis(millis)) => millis,
            None => 0.0,
        };
        self.number("sensing_ms", millis, (0.0..=10_000.0).contains(&millis), "0 to 10000")?;
        Ok(Delay::constant(millis / 1e3))
    }

    pub(super) fn transmit(&self, typed: Option<TypedTransmit>) -> Result<Transmit, ScenarioError> {
        let Some(TypedTransmit::Slotted(typed)) = typed else { return Ok(Transmit::Immediately) };
        let period_ms = typed.period_ms;
        self.number("period_ms", period_ms, (1.0..=10_000.0).contains(&period_ms), "1 to 10000")?;
        let period = Span::from_secs_f64(period_ms / 1e3);
        Ok(Transmit::Slotted { period, phase: self.phase("phase_ms", typed.phase_ms)? })
    }

    pub(super) fn clock(&self, typed: &TypedClock) -> Result<ClockError, ScenarioError> {
        let offset_ms = typed.offset_ms.unwrap_or(0.0);
        self.number("offset_ms", offset_ms, offset_ms.abs() <= MAX_OFFSET_MS, "-60000 to 60000")?;
        let drift_ppm = typed.drift_ppm.unwrap_or(0.0);
        self.number("drift_ppm", drift_ppm, drift_ppm.abs() <= MAX_DRIFT_PPM, "-1000 to 1000")?;
        Ok(ClockError { offset: Span::from_secs_f64(offset_ms / 1e3), drift_ppm })
    }
}

pub(super) const fn send(typed: Option<TypedSend>) -> SendRule {
    match typed {
        None | Some(TypedSend::Periodic) => SendRule::Periodic,
        Some(TypedSend::Etsi) => SendRule::Etsi,
    }
}
