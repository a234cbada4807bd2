//! What was typed of an agent, and what it means.

use std::f64::consts::{PI, TAU};

use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::id::AgentId;
use v2x_common::sensor::{FieldOfView, SensorKind, SizeNoiseLaw};

use super::super::typed::{
    TypedAgent, TypedFieldOfView, TypedLink, TypedNoise, TypedNoiseNumbers, TypedPose,
};
use super::super::{AgentConfig, Rate, Route, ScenarioError, Station, WorldConfig};
use super::{Field, sending};
use crate::link::{Delay, LinkConfig, Loss};
use crate::noise::{DEFAULT_SIZE_LOWER, NoiseLevel, NoiseModel};
use crate::pose_error::PoseError;

const DEFAULT_RATE_HZ: f64 = 10.0;
const DEFAULT_RANGE_M: f64 = 60.0;
/// A vehicle's own body hides what is nearer.
const DEFAULT_VEHICLE_BLIND_ZONE_M: f64 = 2.5;
const DEFAULT_DETECTION_PROBABILITY: f64 = 0.95;
const DEFAULT_CLUTTER_PER_FRAME: f64 = 0.5;
/// Smallest σ that a scenario may ask for, in m, degrees and as a share of sizes: the wire knows no zero.
pub(super) const MIN_SIGMA: f64 = 0.001;
/// Largest σ of a position at the end of the field of view, m: what is reported stays far below the wire's limit.
const MAX_POSITION_SIGMA_M: f64 = 20.0;

impl Field<'_> {
    pub(super) fn agent(&self, typed: TypedAgent, world: &WorldConfig) -> Result<AgentConfig, ScenarioError> {
        let id = AgentId::new(&typed.id);
        let id = id.map_err(|cause| self.child("id").error(format_args!("{:?}", typed.id), cause))?;
        let kind = typed.kind;
        let station = self.station(typed.pose, typed.route.as_deref(), kind, world)?;
        let rate_hz = typed.rate_hz.unwrap_or(DEFAULT_RATE_HZ);
        let rate =
            Rate::from_hz(rate_hz).ok_or_else(|| self.child("rate_hz").error(rate_hz, "0.1 to 1000"))?;
        let field_of_view = self.child("field_of_view").field_of_view(&typed.field_of_view, kind)?;
        let noise = self.child("noise").noise(typed.noise, field_of_view.range_max_m)?;
        let p = typed.detection_probability.unwrap_or(DEFAULT_DETECTION_PROBABILITY);
        self.number("detection_probability", p, (0.0..=1.0).contains(&p), "0 to 1")?;
        let clutter = typed.clutter_per_frame.unwrap_or(DEFAULT_CLUTTER_PER_FRAME);
        self.number("clutter_per_frame", clutter, (0.0..=100.0).contains(&clutter), "0 to 100")?;
        let (link, links_pose_error) = self.child("link").link(typed.link)?;
        let pose_error =
            typed.pose_error.map(|error| self.child("pose_error").pose_error(&error)).transpose()?;
        Ok(AgentConfig {
            id,
            kind,
            station,
            rate,
            phase: self.phase("phase_ms", typed.phase_ms)?,
            clock: self.child("clock").clock(&typed.clock)?,
            pose_error: pose_error.or(links_pose_error),
            noise,
            field_of_view,
            detection_probability: p,
            clutter_per_frame: clutter,
            accuracy: self.child("accuracy").accuracy(&typed.accuracy, kind)?,
            sensing: self.sensing(typed.sensing_ms)?,
            transmit: self.child("transmit").transmit(typed.transmit)?,
            send: sending::send(typed.send),
            link,
        })
    }

    fn station(
        &self,
        pose: Option<TypedPose>,
        route: Option<&str>,
        kind: SensorKind,
        world: &WorldConfig,
    ) -> Result<Station, ScenarioError> {
        match (pose, route) {
            (Some(pose), None) => self.child("pose").pose(&pose).map(Station::Fixed),
            (None, Some(name)) if kind == SensorKind::Vehicle => self.child("route").route(name, world),
            (None, Some(name)) => {
                Err(self.child("route").error(format_args!("{name:?}"), "none: only vehicles drive"))
            }
            (Some(_), Some(_)) => Err(self.error("with both pose and route", "one of them")),
            (None, None) => Err(self.error("without pose and route", "one of them")),
        }
    }

    fn pose(&self, typed: &TypedPose) -> Result<Pose, ScenarioError> {
        let limit = "-1e7 to 1e7";
        let x = self.number("x", typed.x, typed.x.abs() <= 1e7, limit)?;
        let y = self.number("y", typed.y, typed.y.abs() <= 1e7, limit)?;
        let yaw_deg = self.number("yaw_deg", typed.yaw_deg, typed.yaw_deg.abs() <= 360.0, "-360 to 360")?;
        Ok(Pose { x, y, yaw: wrap_angle(yaw_deg.to_radians()) })
    }

    fn route(&self, name: &str, world: &WorldConfig) -> Result<Station, ScenarioError> {
        match (Route::from_name(name), world) {
            (Some(route @ Route::Block(_)), WorldConfig::Crossing(_))
            | (Some(route @ Route::Service(_)), WorldConfig::Highway(_)) => Ok(Station::Driving(route)),
            (_, WorldConfig::Crossing(_)) => {
                Err(self.error(format_args!("{name:?}"), "block-ne, block-nw, block-sw or block-se"))
            }
            (_, WorldConfig::Highway(_)) => {
                Err(self.error(format_args!("{name:?}"), "service-south or service-north"))
            }
        }
    }

    fn field_of_view(
        &self,
        typed: &TypedFieldOfView,
        kind: SensorKind,
    ) -> Result<FieldOfView, ScenarioError> {
        let blind_zone_m = match kind {
            SensorKind::Vehicle => DEFAULT_VEHICLE_BLIND_ZONE_M,
            SensorKind::RoadsideUnit => 0.0,
        };
        let min = typed.range_min_m.unwrap_or(blind_zone_m);
        let max = typed.range_max_m.unwrap_or(DEFAULT_RANGE_M);
        self.number("range_min_m", min, min >= 0.0, "0 or more")?;
        self.number("range_max_m", max, max > min && max <= 1000.0, "more than range_min_m, at most 1000")?;
        let azimuth_deg = typed.azimuth_deg.unwrap_or(0.0);
        self.number("azimuth_deg", azimuth_deg, azimuth_deg.abs() <= 360.0, "-360 to 360")?;
        let width_deg = typed.width_deg.unwrap_or(360.0);
        self.number(
            "width_deg",
            width_deg,
            width_deg > 0.0 && width_deg <= 360.0,
            "more than 0, at most 360",
        )?;
        Ok(FieldOfView {
            range_min_m: min,
            range_max_m: max,
            azimuth_rad: azimuth_deg.to_radians(),
            width_rad: width_deg.to_radians().min(TAU),
        })
    }

    fn noise(&self, typed: Option<TypedNoise>, range_max_m: f64) -> Result<NoiseModel, ScenarioError> {
        let model = match typed {
            None => NoiseLevel::N1.model(),
            Some(TypedNoise::Level(level)) => level.model(),
            Some(TypedNoise::Numbers(numbers)) => self.noise_numbers(&numbers)?,
        };
        let sigma_m = model.position_sigma_m(range_max_m);
        if sigma_m > MAX_POSITION_SIGMA_M {
            let expected = format_args!("at most {MAX_POSITION_SIGMA_M} m there").to_string();
            return Err(self.error(format_args!("{sigma_m} m (σ of a position at range_max_m)"), expected));
        }
        let sigma_rad = model.yaw_sigma_rad(range_max_m);
        if sigma_rad > PI {
            let sigma_deg = sigma_rad.to_degrees();
            return Err(
                self.error(format_args!("{sigma_deg}° (σ of a heading at range_max_m)"), "at most 180°")
            );
        }
        Ok(model)
    }

    fn noise_numbers(&self, typed: &TypedNoiseNumbers) -> Result<NoiseModel, ScenarioError> {
        let sigma = |name, value| self.number(name, value, value >= MIN_SIGMA, "0.001 or more");
        let growth = |name, value: f64| self.number(name, value, (0.0..=0.5).contains(&value), "0 to 0.5");
        let size = self.number("size", typed.size, (MIN_SIGMA..=3.0).contains(&typed.size), "0.001 to 3")?;
        let lower = typed.size_lower.unwrap_or(DEFAULT_SIZE_LOWER);
        self.number("size_lower", lower, (0.01..1.0).contains(&lower), "0.01 to below 1")?;
        Ok(NoiseModel {
            position_m: sigma("position_m", typed.position_m)?,
            position_per_m: growth("position_per_m", typed.position_per_m)?,
            yaw_rad: sigma("yaw_deg", typed.yaw_deg)?.to_radians(),
            yaw_rad_per_m: growth("yaw_deg_per_m", typed.yaw_deg_per_m)?.to_radians(),
            size: SizeNoiseLaw { sigma: size, lower },
        })
    }

    /// The link, and the error of the pose that its profile brings.
    fn link(&self, typed: TypedLink) -> Result<(LinkConfig, Option<PoseError>), ScenarioError> {
        let typed = match typed {
            TypedLink::Named(link, pose_error) => return Ok((link, pose_error)),
            TypedLink::Numbers(numbers) => numbers,
        };
        let millis = |name, value: Option<f64>| {
            let value = value.unwrap_or(0.0);
            self.number(name, value, (0.0..=10_000.0).contains(&value), "0 to 10000")
        };
        let (loss, default) = (typed.loss.unwrap_or(0.0), LinkConfig::default());
        let rate = self.number("loss", loss, (0.0..=1.0).contains(&loss), "0 to 1")?;
        // Shorter bursts cannot lose that much.
        let shortest = (rate / (1.0 - rate)).clamp(1.0, 1e6);
        let burst = |burst: f64| {
            self.number(
                "burst",
                burst,
                (shortest..=1e6).contains(&burst),
                &format!("{shortest:.3} to 1000000"),
            )
        };
        let kbps = |kbps: f64| self.number("rate_kbps", kbps, (0.001..=1e9).contains(&kbps), "0.001 to 1e9");
        let delay = Delay::Normal {
            mean_s: millis("delay_ms", typed.delay_ms)? / 1e3,
            sigma_s: millis("jitter_ms", typed.jitter_ms)? / 1e3,
        };
        let link = LinkConfig {
            delay,
            loss: Loss { rate, burst: typed.burst.map(burst).transpose()? },
            rate_bps: typed.rate_kbps.map(kbps).transpose()?.map(|kbps| 1e3 * kbps),
            reorder: typed.reorder.unwrap_or(default.reorder),
            ..default
        };
        Ok((link, None))
    }
}
