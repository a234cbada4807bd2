//! SUMO's floating-car data: `<timestep time><vehicle id x y angle type/></timestep>`.
//!
//! SUMO's x and y of a vehicle are those of the middle of its front bumper, and its angle is in degrees clockwise from
//! north (<https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html>).

use std::f64::consts::FRAC_PI_2;
use std::io::BufRead;

use v2x_common::class::Class;
use v2x_common::detection::MAX_COORDINATE_M;

use super::builder::{At, Builder, Kind, Row};
use super::error::TrafficError;
use super::names::Names;
use super::options::ReadOptions;
use super::traffic::{Format, Traffic};
use super::xml::{Element, Next, Xml};

pub(super) const ROOT: &str = "fcd-export";

/// Reads the output of `sumo --fcd-output FILE` after its root.
pub(super) fn read(mut xml: Xml<impl BufRead>, options: &ReadOptions) -> Result<Traffic, TrafficError> {
    let mut builder = Builder::new(options);
    let (mut t_s, mut degrees, mut names) = (None, Degrees::default(), Names::default());
    let is_whole = loop {
        let element = match xml.next()? {
            Next::Element(element) => element,
            Next::End(is_whole) => break is_whole,
        };
        match element.name.as_str() {
            "timestep" => {
                let is_time = |t: f64| (0.0..=9e9).contains(&t);
                t_s = Some(element.number(
                    "time",
                    "a time in s (run sumo without --human-readable-time)",
                    is_time,
                )?);
            }
            name @ ("vehicle" | "person" | "container") => {
                let t_s = t_s.ok_or_else(|| TrafficError::Xml {
                    line: element.line,
                    cause: format!("<{}> outside of a <timestep>", element.name),
                })?;
                degrees.add(&element);
                let row = row(&element, t_s)?;
                let name = match name {
                    "vehicle" => names.of("vehicle", row.id),
                    "person" => names.of("person", row.id),
                    _ => names.of("container", row.id),
                };
                builder.add(&Row { id: &name, ..row })?;
            }
            _ => {}
        }
    };
    if !is_whole {
        builder.remarks.warnings.push("the file ends in the middle; what came before is used".to_owned());
    }
    if degrees.are_likely() {
        builder
            .remarks
            .warnings
            .push("x and y look like longitude and latitude: run sumo without --fcd-output.geo".to_owned());
    }
    builder.finish(Format::SumoFcd)
}

fn row(element: &Element, t_s: f64) -> Result<Row<'_>, TrafficError> {
    let is_vehicle = element.name == "vehicle";
    let fallback = match element.name.as_str() {
        "vehicle" => Class::Car,
        "person" => Class::Adult,
        _ => Class::Unknown,
    };
    let coordinate =
        |name| element.number(name, "a coordinate in m", |value: f64| value.abs() <= MAX_COORDINATE_M);
    let angle_deg = element.number("angle", "an angle in degrees", f64::is_finite)?;
    // Older versions and some attribute lists leave the type out.
    let kind = element.attribute("type").unwrap_or("DEFAULT_VEHTYPE");
    let kind = if is_vehicle || element.attribute("type").is_some() { kind } else { "DEFAULT_PEDTYPE" };
    Ok(Row {
        line: element.line,
        t_s,
        id: element.text("id", "an id")?,
        kind: Kind::Sumo(kind, fallback),
        at: At {
            x: coordinate("x")?,
            y: coordinate("y")?,
            yaw: FRAC_PI_2 - angle_deg.to_radians(),
            is_front: is_vehicle,
        },
        size: (None, None),
    })
}

/// Whether coordinates are degrees: within the range of them, and many with a speed that they do not show.
#[derive(Default)]
struct Degrees {
    n: u32,
    /// Extents of x and y.
    low: Option<(f64, f64)>,
    high: (f64, f64),
    /// Sum of the speeds, m/s.
    speeds_mps: f64,
}

impl Degrees {
    fn add(&mut self, element: &Element) {
        let number = |name: &str| element.attribute(name).and_then(|text| text.parse::<f64>().ok());
        let (Some(x), Some(y), Some(speed_mps)) = (number("x"), number("y"), number("speed")) else { return };
        self.n = self.n.saturating_add(1);
        self.speeds_mps += speed_mps;
        let low = self.low.get_or_insert((x, y));
        (low.0, low.1) = (low.0.min(x), low.1.min(y));
        self.high = if self.n == 1 { (x, y) } else { (self.high.0.max(x), self.high.1.max(y)) };
    }

    /// A minute's drive in the whole extent, and all of it within a hundredth of a degree or so.
    fn are_likely(&self) -> bool {
        let Some(low) = self.low else { return false };
        let extent = (self.high.0 - low.0).max(self.high.1 - low.1);
        self.n >= 20 && self.speeds_mps / f64::from(self.n) > 1.0 && extent < 1.0 && low.0.abs() <= 180.0
    }
}
