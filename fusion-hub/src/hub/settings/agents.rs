//! The `[hub.agents.…]` tables: what is assumed of single agents, and how they write their frames.

use super::checks::{check_report_defaults, check_sensing};
use crate::fusion::SettingsError;
use crate::values::SensingDefaults;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use v2x_common::class::Class;
use v2x_common::conventions::{Conventions, CoordinateFrame, YawConvention};
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::id::AgentId;
use v2x_common::tile::{Geodetic, LocalPlane, MAX_LATITUDE_DEG};
use v2x_common::time::Span;
use v2x_common::wire::Writing;
use v2x_common::wire::json::ReportDefaults;

/// The largest angle in degrees that is not more than a turn.
const MOST_DEGREES: f64 = 360.0;

/// As it is typed; what is not there is as for all agents.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct AgentTable {
    sigma_position_m: Option<f64>,
    sigma_position_per_m: Option<f64>,
    sigma_yaw_rad: Option<f64>,
    sigma_size_relative: Option<f64>,
    sigma_typical_size_relative: Option<f64>,
    detection_probability: Option<f64>,
    clutter_per_m2: Option<f64>,
    frame: FrameName,
    pose: Option<Pose>,
    origin: Option<Geodetic>,
    yaw: YawConvention,
    sizes: SizeOrder,
    classes: BTreeMap<String, String>,
    time_offset_ms: f64,
}

/// The frame of positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FrameName {
    #[default]
    Map,
    Sensor,
    Ego,
    Wgs84,
    #[serde(rename = "wgs84-lat-lon")]
    Wgs84LatLon,
}

/// Which of w and d is along the heading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SizeOrder {
    #[default]
    DAlong,
    WAlong,
}

/// What is assumed of one agent, and how it writes its frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AgentSettings {
    /// Where a JSON frame leaves a value out.
    pub report_defaults: ReportDefaults,
    /// Whether they say the standard deviation of its positions, which is then no mere assumption.
    #[serde(default)]
    pub says_sigma: bool,
    /// How it writes its frames.
    pub conventions: Conventions,
    /// As long as it describes no sensor; `None`: as for all agents.
    pub sensing: Option<SensingDefaults>,
}

impl AgentSettings {
    /// How it writes, for others that read its frames.
    pub fn writing(&self) -> Writing {
        Writing { report_defaults: self.report_defaults, conventions: self.conventions.clone() }
    }
}

/// What single agents take over where their table has nothing.
pub(super) struct ForAll<'a> {
    pub(super) report_defaults: &'a ReportDefaults,
    pub(super) sensing: &'a SensingDefaults,
    /// The place of the map frame on the earth, where `[hub.tiles]` says it.
    pub(super) plane: Option<LocalPlane>,
}

/// Whether these are others than what is assumed where nobody says anything.
pub(super) fn says_sigma(defaults: &ReportDefaults) -> bool {
    let assumed = ReportDefaults::default();
    let of = |it: &ReportDefaults| [it.sigma_position_m.to_bits(), it.sigma_position_per_m.to_bits()];
    of(defaults) != of(&assumed)
}

impl AgentTable {
    /// The settings of this agent.
    ///
    /// # Errors
    /// Names the agent, the field and the value.
    pub(super) fn check(self, agent: &AgentId, for_all: &ForAll<'_>) -> Result<AgentSettings, SettingsError> {
        let wrong = |problem: String| SettingsError::Agent { agent: *agent, problem };
        let report_defaults = self.report_defaults(for_all.report_defaults);
        check_report_defaults(&report_defaults).map_err(|error| wrong(field_of(&error)))?;
        let sensing = self.sensing(for_all.sensing);
        if let Some(sensing) = &sensing {
            check_sensing(sensing).map_err(|error| wrong(field_of(&error)))?;
        }
        if self.time_offset_ms.is_nan() || self.time_offset_ms.abs() > 60_000.0 {
            return Err(wrong(format!(
                "time_offset_ms is {}, expected -60000 to 60000",
                self.time_offset_ms
            )));
        }
        let conventions = Conventions {
            frame: self.frame(for_all.plane).map_err(wrong)?,
            yaw: self.yaw,
            sizes_swapped: self.sizes == SizeOrder::WAlong,
            classes: self.classes().map_err(wrong)?,
            time_offset: Span::from_secs_f64(self.time_offset_ms * 1e-3),
        };
        let says_sigma = says_sigma(&report_defaults) || self.sigma_position_m.is_some();
        Ok(AgentSettings { report_defaults, says_sigma, conventions, sensing })
    }

    fn report_defaults(&self, for_all: &ReportDefaults) -> ReportDefaults {
        ReportDefaults {
            sigma_position_m: self.sigma_position_m.unwrap_or(for_all.sigma_position_m),
            sigma_position_per_m: self.sigma_position_per_m.unwrap_or(for_all.sigma_position_per_m),
            sigma_yaw_rad: self.sigma_yaw_rad.unwrap_or(for_all.sigma_yaw_rad),
            sigma_size_relative: self.sigma_size_relative.unwrap_or(for_all.sigma_size_relative),
            sigma_typical_size_relative: self
                .sigma_typical_size_relative
                .unwrap_or(for_all.sigma_typical_size_relative),
        }
    }

    fn sensing(&self, for_all: &SensingDefaults) -> Option<SensingDefaults> {
        let is_given = self.detection_probability.is_some() || self.clutter_per_m2.is_some();
        is_given.then(|| SensingDefaults {
            detection_probability: self.detection_probability.unwrap_or(for_all.detection_probability),
            clutter_per_m2: self.clutter_per_m2.unwrap_or(for_all.clutter_per_m2),
            ..*for_all
        })
    }

    fn frame(&self, plane: Option<LocalPlane>) -> Result<CoordinateFrame, String> {
        let (has_pose, has_origin) = (self.pose.is_some(), self.origin.is_some());
        if has_pose && self.frame != FrameName::Sensor {
            return Err("pose is for frame = \"sensor\"".to_owned());
        }
        let plane = || {
            let needed =
                "frame = \"wgs84\" needs origin = { latitude_deg = …, longitude_deg = … }, or [hub.tiles]";
            match self.origin {
                None => Ok(plane.ok_or(needed)?),
                Some(origin) => on_earth(origin).map(LocalPlane::new),
            }
        };
        if has_origin && !matches!(self.frame, FrameName::Wgs84 | FrameName::Wgs84LatLon) {
            return Err("origin is for frame = \"wgs84\"".to_owned());
        }
        Ok(match self.frame {
            FrameName::Map => CoordinateFrame::Map,
            FrameName::Ego => CoordinateFrame::Ego,
            FrameName::Sensor => {
                let pose =
                    self.pose.ok_or("frame = \"sensor\" needs pose = { x = …, y = …, yaw = … } (m, rad)")?;
                if ![pose.x, pose.y, pose.yaw].iter().all(|value| value.is_finite() && value.abs() <= 1e8) {
                    return Err(format!("pose is {pose:?}, expected finite numbers up to 1e8 m"));
                }
                check_turn(pose.yaw)?;
                CoordinateFrame::Sensor(Pose { yaw: wrap_angle(pose.yaw), ..pose })
            }
            FrameName::Wgs84 => CoordinateFrame::Geodetic(plane()?),
            FrameName::Wgs84LatLon => CoordinateFrame::LatitudeFirst(plane()?),
        })
    }

    fn classes(&self) -> Result<BTreeMap<String, Class>, String> {
        let class = |(name, ours): (&String, &String)| match Class::from_name(ours) {
            Some(class) => Ok((name.clone(), class)),
            None if Class::from_name(name).is_some() => Err(format!(
                "classes.{name:?} is {ours:?}, which is no class: the agent's own name is on the left, and ours on the right: write \
                 {ours:?} = {name:?}"
            )),
            None => {
                Err(format!("classes.{name:?} is {ours:?}, which is no class; there are {}", known_classes()))
            }
        };
        self.classes.iter().map(class).collect()
    }
}

/// A pose that is turned by more than once is of degrees: read as radians it would put every object in a second place.
fn check_turn(yaw: f64) -> Result<(), String> {
    if yaw.abs() <= TAU {
        return Ok(());
    }
    let meant = match yaw.abs() <= MOST_DEGREES {
        true => format!("; {yaw} looks like degrees: write {:.4}", yaw.to_radians()),
        false => String::new(),
    };
    Err(format!("pose.yaw is {yaw}, expected radians, -2π to 2π{meant}"))
}

fn known_classes() -> String {
    Class::ALL.map(Class::name).join(", ")
}

fn on_earth(origin: Geodetic) -> Result<Geodetic, String> {
    let Geodetic { latitude_deg, longitude_deg } = origin;
    let is_on_it = latitude_deg.abs() <= MAX_LATITUDE_DEG && longitude_deg.abs() <= 180.0;
    if is_on_it {
        Ok(origin)
    } else {
        Err(format!(
            "origin is {latitude_deg}, {longitude_deg}: latitude -85.05 to 85.05, longitude -180 to 180"
        ))
    }
}

/// The problem without the table's name.
fn field_of(error: &SettingsError) -> String {
    match error {
        SettingsError::OutOfRange { field, value, expected } => {
            let field = field.rsplit('.').next().unwrap_or(field);
            format!("{field} is {value}, expected {expected}")
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hub::HubSettings;
    use v2x_common::conventions::{AngleUnit, TurnDirection, YawOrigin};

    fn cam(text: &str) -> Result<AgentSettings, SettingsError> {
        let settings = HubSettings::from_table(text.parse().expect("valid TOML"))?;
        Ok(settings.of_agent(&AgentId::new("cam").unwrap()).clone())
    }

    #[test]
    fn conventions_are_as_typed() {
        let cam = cam("[agents.cam]\nframe = \"wgs84\"\norigin = { latitude_deg = 48.1, longitude_deg = 11.5 }\n\
             yaw = { unit = \"deg\", from = \"north\", turn = \"cw\" }\nsizes = \"w-along\"\ntime_offset_ms = 300\n\
             classes = { Auto = \"car\" }\nsigma_position_m = 0.2\nsigma_position_per_m = 0.01\n\
             detection_probability = 0.9")
        .unwrap();
        let Conventions { frame, yaw, sizes_swapped, classes, time_offset } = cam.conventions;
        assert!(matches!(frame, CoordinateFrame::Geodetic(_)) && sizes_swapped);
        let compass = YawConvention { unit: AngleUnit::Deg, from: YawOrigin::North, turn: TurnDirection::Cw };
        assert_eq!((yaw, time_offset), (compass, Span::from_millis(300)));
        assert_eq!(classes["Auto"], Class::Car);
        assert_eq!(cam.report_defaults.sigma_position_per_m, 0.01);
        assert_eq!(cam.sensing.map(|sensing| sensing.detection_probability), Some(0.9));
    }

    #[test]
    fn a_pose_may_be_turned_by_as_much_as_a_whole_turn() {
        let cam = cam("[agents.cam]\nframe = \"sensor\"\npose = { x = 1, y = 2, yaw = 4.712 }").unwrap();
        let CoordinateFrame::Sensor(pose) = cam.conventions.frame else { panic!("{cam:?}") };
        assert!((pose.yaw - (4.712 - TAU)).abs() < 1e-9, "{pose:?}");
    }

    #[test]
    fn what_an_agent_has_not_is_as_for_all_agents() {
        let cam =
            cam("report_defaults = { sigma_position_m = 2.0 }\n[agents.cam]\nsigma_yaw_rad = 0.3").unwrap();
        assert_eq!((cam.report_defaults.sigma_position_m, cam.report_defaults.sigma_yaw_rad), (2.0, 0.3));
        assert_eq!((cam.conventions, cam.sensing), (Conventions::default(), None));
    }

    #[test]
    fn the_place_of_the_tiles_is_the_place_of_the_map() {
        let cam =
            cam("tiles = { latitude_deg = 48.1, longitude_deg = 11.5 }\n[agents.cam]\nframe = \"wgs84\"")
                .unwrap();
        assert!(matches!(cam.conventions.frame, CoordinateFrame::Geodetic(_)));
    }

    #[test]
    fn errors_name_the_agent_the_field_and_what_is_expected() {
        for (text, named) in [
            ("frame = \"sensor\"", "needs pose"),
            ("frame = \"wgs84\"", "needs origin"),
            ("frame = \"utm\"", "expected one of `map`, `sensor`, `ego`, `wgs84`, `wgs84-lat-lon`"),
            ("pose = { x = 1, y = 2 }", "pose is for frame = \"sensor\""),
            (
                "frame = \"sensor\"\npose = { x = 1, y = 2, yaw = 145 }",
                "pose.yaw is 145, expected radians, -2π to 2π; 145 looks like degrees: write 2.5307",
            ),
            ("frame = \"sensor\"\npose = { x = 1, y = 2, yaw = -90 }", "write -1.5708"),
            (
                "frame = \"sensor\"\npose = { x = 1, y = 2, yaw = 1e5 }",
                "pose.yaw is 100000, expected radians",
            ),
            ("origin = { latitude_deg = 91, longitude_deg = 0 }\nframe = \"wgs84\"", "origin is 91"),
            ("classes = { Auto = \"spaceship\" }", "\"spaceship\", which is no class; there are"),
            ("classes = { car = \"PKW\" }", "write \"PKW\" = \"car\""),
            ("yaw = { unit = \"gon\" }", "expected `rad` or `deg`"),
            ("time_offset_ms = 1e9", "time_offset_ms is 1000000000"),
            ("detection_probability = 2", "detection_probability is 2, expected 0.01 to 1"),
            ("sigma_position_m = 0", "sigma_position_m is 0"),
            ("sigma_position_per_m = 2", "sigma_position_per_m is 2, expected 0 to 1"),
        ] {
            let message = cam(&format!("[agents.cam]\n{text}")).unwrap_err().to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
        let message = cam("[agents.cam]\nframe = \"sensor\"").unwrap_err().to_string();
        assert!(message.contains("hub.agents.cam"), "{message}");
    }
}
