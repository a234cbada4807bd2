//! The agents' coverage and errors of detection: the paper's, or those of real sensors.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_agent::detector::Profile;
use v2x_common::sensor::FieldOfView;

/// Conditions of an evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "lab", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Conditions {
    /// As in the paper: every agent reports every object exactly once, without clutter
    #[default]
    Paper,
    /// Every agent covers its own surroundings, misses one object in ten, and reports clutter
    Sensors,
    /// The same with detectors that err as those on lidars do: misses and clutter that last, turned headings, wrong classes,
    /// errors that are correlated over time, scores
    Lidar,
    /// The same as those on cameras do
    Camera,
}

/// Beyond every object of every scene, m.
const UNLIMITED_M: f64 = 1000.0;
/// Both agents' range under [`Conditions::Sensors`], m: about the range of lidar detectors on nuScenes (50 m for
/// vehicles).
const RANGE_M: f64 = 50.0;
/// Distance between them, m: half of what one agent covers is not covered by the other.
const APART_M: f64 = 40.0;

impl Conditions {
    /// How the detectors err beside noise.
    pub const fn profile(self) -> Profile {
        match self {
            Self::Paper | Self::Sensors => Profile::Paper,
            Self::Lidar => Profile::Lidar,
            Self::Camera => Profile::Camera,
        }
    }

    /// Probability that an agent reports an object in its view.
    pub const fn detection_probability(self) -> f64 {
        match self {
            Self::Paper => 1.0,
            Self::Sensors => 0.9,
            // The mean of the profiles over the range, hidden objects included; the detectors themselves go by range.
            Self::Lidar => 0.75,
            Self::Camera => 0.6,
        }
    }

    /// Expected number of clutter detections of an agent in a frame.
    pub const fn clutter_per_frame(self) -> f64 {
        match self {
            Self::Paper => 0.0,
            Self::Sensors => 0.5,
            Self::Lidar | Self::Camera => self.profile().clutter_per_frame(),
        }
    }

    /// Range of the agents' sensors, m.
    pub const fn range_m(self) -> f64 {
        match self {
            Self::Paper => UNLIMITED_M,
            Self::Sensors | Self::Lidar | Self::Camera => RANGE_M,
        }
    }

    /// Constant distance from agent 1 to agent 2, m; `None` where the place of agent 2 is drawn for every frame.
    pub const fn apart_m(self) -> Option<f64> {
        match self {
            Self::Paper => None,
            Self::Sensors | Self::Lidar | Self::Camera => Some(APART_M),
        }
    }

    /// The agents' field of view.
    pub const fn field_of_view(self) -> FieldOfView {
        FieldOfView::omnidirectional(0.0, self.range_m())
    }

    /// Clutter detections of an agent per frame and m².
    pub const fn clutter_per_m2(self) -> f64 {
        self.clutter_per_frame() / (PI * self.range_m() * self.range_m())
    }

    /// Area that at least one of both agents covers, m²: two discs less their intersection.
    pub fn area_of_both_m2(self) -> f64 {
        let (range_m, apart_m) = (self.range_m(), self.apart_m().unwrap_or(0.0));
        let half_m = apart_m / 2.0;
        let chord_m = libm::sqrt(range_m * range_m - half_m * half_m);
        let common = 2.0 * (range_m * range_m * libm::acos(half_m / range_m) - half_m * chord_m);
        2.0 * PI * range_m * range_m - common
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_in_view_of_both_agents_are_counted_once() {
        let one = |conditions: Conditions| PI * conditions.range_m() * conditions.range_m();
        assert!((Conditions::Paper.area_of_both_m2() / one(Conditions::Paper) - 1.0).abs() < 1e-12);
        // Count the points of a grid of 0.1 m.
        let (range, apart) = (RANGE_M, APART_M);
        let is_seen = |x: f64, y: f64| {
            x * x + y * y < range * range || (x - apart) * (x - apart) + y * y < range * range
        };
        let places = |n: i32| (-n..n).map(|k| (f64::from(k) + 0.5) * 0.1);
        let count = places(1000)
            .flat_map(|x| places(600).map(move |y| (x, y)))
            .filter(|(x, y)| is_seen(*x, *y))
            .count();
        let counted = f64::from(u32::try_from(count).unwrap()) * 0.01;
        assert!((Conditions::Sensors.area_of_both_m2() / counted - 1.0).abs() < 1e-3);
    }
}
