//! Options of `lab fuse`.

use super::late_args::LateArgs;
use crate::drive::replay::Declared;
use crate::score::offline::Region;
use anyhow::{Context, ensure};
use std::path::PathBuf;
use v2x_agent::noise::DEFAULT_SIZE_LOWER;
use v2x_common::duration::parse_millis;
use v2x_common::id::AgentId;
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind, SizeNoiseLaw};
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::PRESETS;
use v2x_fusion_hub::hub::HubSettings;
use v2x_fusion_hub::hub::{hub_table, hub_table_if_any};
use v2x_fusion_hub::values::SensingDefaults;

/// Fuse a log of detections offline with the engine of the hub; with ground truth, score the result
///
/// Fused objects are published every 0.1 s of arrival time (t_arr), from the first arrival to the last one. Each
/// publication uses only detections that have arrived by then.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Detections: a CSV file with a row for each, in order of arrival, in the columns
  t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st
        and, where known, sensor_x,sensor_y,sensor_yaw
in seconds of any epoch, metres and radians; t_arr is when it arrived, t when it
was measured, sx to st are standard deviations (sw and sd in metres). Rows of
equal t_arr, t and sensor_id are one frame. A row with an empty class is a frame
in which the sensor saw nothing (more). Optional columns: score (0 to 1),
vx,vy,svx,svy (a measured velocity), source_track (of a sender that tracks).
heading (known; axis: the front may be at the other end; unknown; an empty cell
is known where yaw is given). Other columns are ignored. Impossible rows (a size
of 0, nan) are dropped and counted. An empty cell of w to st is assumed, as in a
JSON frame. How a sensor writes (its own frame, degrees and so on) is said by
[hub.agents.SENSOR_ID] in --hub-config.

Truth: t,object_id,class,x,y,vx,vy,w,d,yaw in any order; between two rows of an
object it is interpolated.

Fused: t,track_id,class,x,y,vx,vy,w,d,yaw,existence,sx,sy,svx,svy,sw,sd,st,
  heading,classes,conflict
st is the standard deviation of yaw, and heading (known, axis or unknown) what
is known of it; classes are probabilities, such as
vehicle.car:0.83;vehicle.truck:0.12;unknown:0.05, and conflict (0 to 1) says how
much the sensors contradict each other about them.

Examples:
  lab fuse --detections log.csv --out fused.csv
  lab fuse --detections log.csv --out fused.csv \\
      --truth truth.csv --method csba-wls --json
  lab fuse --detections log.csv --out fused.csv \\
      --range 50 --detection-probability 0.9 --clutter-per-frame 0.5
  lab fuse --detections log.csv --out fused.csv \\
      --accuracy 0.3,0.5,20 --accuracy rsu=0.05
  lab fuse --detections log.csv --out fused.csv --hub-config crossing.toml
  lab fuse --detections log.csv --out fused.csv --late rsu=200 --late ego=20,80
  lab fuse --detections log.csv --out fused.csv --lagged-out smoothed.csv
  lab fuse --detections log.csv --out fused.csv --report log.html")]
pub struct FuseArgs {
    /// The detections (CSV)
    #[arg(long, value_name = "FILE.csv")]
    pub detections: PathBuf,
    /// The fused objects (CSV)
    #[arg(long, value_name = "FUSED.csv")]
    pub out: PathBuf,
    /// A second list (CSV), in the same columns: the same objects smoothed over a lag, by all that arrived until half a
    /// second later, or the time in `lagged = { lag_ms = … }` of the settings. With the truth it is scored, too [default: with
    /// `lagged` in the settings a file beside FUSED.csv, FUSED.lagged.csv]
    #[arg(long, value_name = "LAGGED.csv")]
    pub lagged_out: Option<PathBuf>,
    /// The ground truth (CSV)
    #[arg(long, value_name = "TRUTH.csv")]
    pub truth: Option<PathBuf>,
    /// Where the truth is complete: a rectangle, or a distance from any sensor (needs sensor_x,sensor_y), m. Outside of it
    /// nothing counts, neither false objects nor misses
    #[arg(
        long,
        value_name = "X_MIN,Y_MIN,X_MAX,Y_MAX|R",
        requires = "truth",
        value_parser = region,
        allow_hyphen_values = true
    )]
    pub truth_region: Option<Region>,
    /// The settings of the hub.
    #[command(flatten)]
    pub rules: RuleArgs,
    /// The description of the sensors.
    #[command(flatten)]
    pub sensor: SensorArgs,
    /// Delays.
    #[command(flatten)]
    pub late: LateArgs,
    /// A page of the log (HTML): what looks wrong, sensors, NIS over time, latencies, and pictures from above. It has no scores
    #[arg(long, value_name = "PAGE.html")]
    pub report: Option<PathBuf>,
    /// Print all results as one line of JSON
    #[arg(long)]
    pub json: bool,
}

/// The settings of a hub as options.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct RuleArgs {
    /// Fusion method, as in the settings of a hub: ours, unikf-paper, csba-wls, nms and so on [default: ours]
    #[arg(long, value_name = "KEY", value_parser = method)]
    pub method: Option<String>,
    /// Motion model [default: the method's]
    #[arg(long, value_parser = ["cv", "imm"])]
    pub motion: Option<String>,
    /// Frames older than this on arrival are refused, such as 300ms or 1s; a plain number is ms [default: 500ms]
    #[arg(long, value_name = "DURATION", value_parser = parse_millis)]
    pub delta_max_ms: Option<f64>,
    /// Number of association hypotheses
    #[arg(long, value_name = "N")]
    pub association_particles: Option<u32>,
    /// A TOML file with the settings of a hub in its `[hub]` table; the options above override it
    #[arg(long, value_name = "FILE.toml")]
    pub hub_config: Option<PathBuf>,
}

/// One description for all sensors of a log. The settings of the hub hold the assumptions for what is not given.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct SensorArgs {
    /// Range of the sensors in all directions, m (from sensor_x,sensor_y); an object in range without a report counts
    /// as absent or as a missed detection
    #[arg(long, value_name = "M")]
    pub range: Option<f64>,
    /// Probability that a sensor detects an object in its range
    #[arg(long, value_name = "P", requires = "range")]
    pub detection_probability: Option<f64>,
    /// Expected number of false detections of a sensor per frame, in its range
    #[arg(long, value_name = "N", requires = "range")]
    pub clutter_per_frame: Option<f64>,
    /// The same as a density: false detections of a sensor per frame and m²
    #[arg(long, value_name = "DENSITY", conflicts_with = "clutter_per_frame")]
    pub clutter_per_m2: Option<f64>,
    /// Accuracy (1 σ) of the sensors' pose and clock: m, degrees and ms, the last two 0 where left out; of one sensor as
    /// SENSOR=… With it clock and pose errors are estimated and corrected (needs sensor_x,sensor_y). May be repeated
    #[arg(long, value_name = "[SENSOR=]M[,DEG[,MS]]", value_parser = accuracy)]
    pub accuracy: Vec<DeclaredAccuracy>,
    /// Reported sizes are true sizes times a normal factor of mean 1 and this σ, truncated below [LOWER: 0.1]
    #[arg(long, value_name = "SIGMA[:LOWER]", value_parser = size_noise)]
    pub size_noise: Option<SizeNoiseLaw>,
}

/// The accuracy of one sensor, or of all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeclaredAccuracy {
    /// Which sensor; `None` for those that are not named.
    pub sensor: Option<AgentId>,
    /// Its accuracy.
    pub accuracy: Accuracy,
}

pub(super) fn accuracy(text: &str) -> Result<DeclaredAccuracy, String> {
    let (sensor, figures) = match text.split_once('=') {
        Some((sensor, figures)) => (Some(AgentId::new(sensor).map_err(|error| error.to_string())?), figures),
        None => (None, text),
    };
    let number = |text: &str| {
        let number = text.trim().parse().ok().filter(|sigma: &f64| sigma.is_finite() && *sigma >= 0.0);
        number.ok_or_else(|| format!("{text:?} is no standard deviation of 0 or more"))
    };
    let figures = figures.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    let (position_m, yaw_deg, clock_ms) = match figures.as_slice() {
        [m] => (*m, 0.0, 0.0),
        [m, deg] => (*m, *deg, 0.0),
        [m, deg, ms] => (*m, *deg, *ms),
        _ => return Err("expected metres, degrees, milliseconds, such as 0.3,0.5,20".to_owned()),
    };
    let accuracy = Accuracy { position_m, yaw_rad: f64::to_radians(yaw_deg), clock_s: clock_ms / 1e3 };
    Ok(DeclaredAccuracy { sensor, accuracy })
}

fn region(text: &str) -> Result<Region, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    match numbers.as_deref() {
        Some([radius_m]) if *radius_m > 0.0 => Ok(Region::AroundSensors { radius_m: *radius_m }),
        Some([x_min, y_min, x_max, y_max]) if x_min < x_max && y_min < y_max => {
            Ok(Region::Rectangle { min: [*x_min, *y_min], max: [*x_max, *y_max] })
        }
        _ => Err("expected X_MIN,Y_MIN,X_MAX,Y_MAX or a distance in m".to_owned()),
    }
}

fn method_keys() -> Vec<String> {
    PRESETS.iter().map(|preset| preset.key.to_owned()).collect()
}

fn method(text: &str) -> Result<String, String> {
    let keys = method_keys();
    let is_there = keys.iter().any(|key| key == text);
    if is_there { Ok(text.to_owned()) } else { Err(format!("expected one of {}", keys.join(", "))) }
}

fn size_noise(text: &str) -> Result<SizeNoiseLaw, String> {
    let (sigma, lower) = match text.split_once(':') {
        Some((sigma, lower)) => (sigma, Some(lower)),
        None => (text, None),
    };
    let number = |text: &str| text.parse::<f64>().map_err(|_| format!("{text:?} is no number"));
    Ok(SizeNoiseLaw { sigma: number(sigma)?, lower: lower.map_or(Ok(DEFAULT_SIZE_LOWER), number)? })
}

impl FuseArgs {
    /// The settings of a hub, which has a second list where one is asked for.
    pub(super) fn settings(&self) -> anyhow::Result<HubSettings> {
        let mut table = self.rules.table()?;
        if self.lagged_out.is_some() {
            table.entry("lagged").or_insert_with(|| toml::Table::new().into());
        }
        checked(table)
    }

    /// The file of the second list; none beside an output that is no file.
    pub(super) fn lagged_path(&self) -> Option<PathBuf> {
        let is_device = self.out.metadata().is_ok_and(|metadata| !metadata.is_file());
        let beside = (!is_device).then(|| self.out.with_extension("lagged.csv"));
        self.lagged_out.clone().or(beside)
    }
}

fn checked(table: toml::Table) -> anyhow::Result<HubSettings> {
    HubSettings::from_table(table).context("the settings of the hub")
}

impl RuleArgs {
    /// The settings of a hub.
    pub fn settings(&self) -> anyhow::Result<HubSettings> {
        checked(self.table()?)
    }

    /// The `[hub]` table with these options.
    fn table(&self) -> anyhow::Result<toml::Table> {
        let mut table = match &self.hub_config {
            Some(path) => hub_table(path)?,
            None => toml::Table::new(),
        };
        let texts = [("method", &self.method), ("motion", &self.motion)];
        table.extend(
            texts.into_iter().filter_map(|(name, text)| Some((name.to_owned(), text.clone()?.into()))),
        );
        table.extend(self.delta_max_ms.map(|ms| ("delta_max_ms".to_owned(), ms.into())));
        let particles = self.association_particles.map(i64::from);
        table.extend(particles.map(|n| ("association_particles".to_owned(), n.into())));
        Ok(table)
    }

    /// The settings of the engine. Track ids start at 0.
    pub fn engine(&self) -> anyhow::Result<EngineConfig> {
        Ok(EngineConfig { lineage: 0, ..self.settings()?.engine })
    }

    /// Name of the method.
    pub fn method_key(&self) -> anyhow::Result<String> {
        let of_file = match (&self.method, &self.hub_config) {
            (None, Some(path)) => {
                let table = hub_table_if_any(path)?.unwrap_or_default();
                table.get("method").and_then(|key| key.as_str().map(str::to_owned))
            }
            (method, _) => method.clone(),
        };
        Ok(of_file.unwrap_or_else(|| "ours".to_owned()))
    }
}

impl SensorArgs {
    /// What is declared of the sensors of the log.
    pub(crate) fn declared(&self, defaults: &SensingDefaults) -> anyhow::Result<Declared> {
        let of_all = self.accuracy.iter().rev().find(|one| one.sensor.is_none());
        let of_one = |one: &DeclaredAccuracy| Some((one.sensor?, one.accuracy));
        Ok(Declared {
            description: self.description(defaults)?,
            accuracy: of_all.map(|one| one.accuracy),
            accuracies: self.accuracy.iter().filter_map(of_one).collect(),
        })
    }

    /// The description of every sensor of the log; `None` without any option but the accuracy.
    fn description(&self, defaults: &SensingDefaults) -> anyhow::Result<Option<SensorDescription>> {
        if *self == (Self { accuracy: self.accuracy.clone(), ..Self::default() }) {
            return Ok(None);
        }
        // Without a range nothing is in view.
        let field_of_view = FieldOfView::omnidirectional(0.0, self.range.unwrap_or(f64::MIN_POSITIVE));
        let per_frame = self.clutter_per_frame.map(|per_frame| per_frame / field_of_view.area_m2());
        let description = SensorDescription {
            revision: 1,
            kind: SensorKind::Vehicle,
            field_of_view,
            detection_probability: self.detection_probability.unwrap_or(defaults.detection_probability),
            clutter_per_m2: per_frame.or(self.clutter_per_m2).unwrap_or(defaults.clutter_per_m2),
            size_noise: self.size_noise,
            body: None,
            accuracy: Accuracy { position_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 },
            // Part of the message, but without influence.
            rate_hz: 10.0,
        };
        description.validate()?;
        ensure!(self.clutter_per_frame.is_none_or(f64::is_finite), "--clutter-per-frame is no number");
        Ok(Some(description))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Span;
    use v2x_fusion_hub::fusion::{Fusion, MotionModel};
    use v2x_fusion_hub::values::Coast;

    fn motion(engine: &EngineConfig) -> Option<MotionModel> {
        match engine.fusion {
            Fusion::Tracking(tracking) => Some(tracking.motion),
            Fusion::Window(_) => None,
        }
    }

    #[test]
    fn every_method_of_the_hub_has_its_key() {
        for preset in PRESETS {
            let rules = RuleArgs { method: Some(preset.key.to_owned()), ..RuleArgs::default() };
            let expected = RuleArgs::default().engine().unwrap().with_preset(preset);
            assert_eq!(rules.engine().unwrap(), expected, "{}", preset.key);
        }
    }

    #[test]
    fn options_override_the_settings_file() {
        let folder = std::env::temp_dir().join(format!("lab-fuse-args-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("hub.toml");
        std::fs::write(&path, "[hub]\nmethod = \"unikf-paper\"\ncoast_ms = 700\n").unwrap();
        let of_file = RuleArgs { hub_config: Some(path), ..RuleArgs::default() };
        let engine = of_file.engine().unwrap();
        assert_eq!(
            (motion(&engine), engine.coast),
            (Some(MotionModel::Cv), Coast::Fixed(Span::from_millis(700)))
        );
        assert_eq!(of_file.method_key().unwrap(), "unikf-paper");
        let both = RuleArgs { method: Some("ours".to_owned()), ..of_file };
        let engine = both.engine().unwrap();
        assert_eq!(
            (motion(&engine), engine.coast),
            (Some(MotionModel::Imm), Coast::Fixed(Span::from_millis(700)))
        );
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn invalid_settings_are_errors_with_their_name() {
        let message = |rules: RuleArgs| format!("{:#}", rules.engine().unwrap_err());
        let rules = RuleArgs { delta_max_ms: Some(-1.0), ..RuleArgs::default() };
        assert!(message(rules).contains("delta_max_ms is -1, expected 1 to 60000"));
        let rules = RuleArgs { association_particles: Some(1), ..RuleArgs::default() };
        assert!(message(rules).contains("association_particles is 1"));
    }

    #[test]
    fn sensors_are_described_by_the_given_options_and_without_options_not_at_all() {
        let defaults = SensingDefaults::default();
        assert_eq!(SensorArgs::default().description(&defaults).unwrap(), None);
        let law = SensorArgs { size_noise: Some(size_noise("0.5").unwrap()), ..SensorArgs::default() };
        let described = law.description(&defaults).unwrap().unwrap();
        assert_eq!(described.size_noise, Some(SizeNoiseLaw { sigma: 0.5, lower: 0.1 }));
        assert_eq!(described.detection_probability, 0.7);
        let all = SensorArgs {
            range: Some(10.0),
            detection_probability: Some(0.8),
            clutter_per_frame: Some(0.5),
            ..SensorArgs::default()
        };
        let described = all.description(&defaults).unwrap().unwrap();
        assert!((described.clutter_per_m2 - 0.5 / (std::f64::consts::PI * 100.0)).abs() < 1e-15);
        for wrong in [
            SensorArgs { detection_probability: Some(1.5), ..all.clone() },
            SensorArgs { range: Some(-1.0), ..all.clone() },
            SensorArgs { clutter_per_frame: Some(f64::NAN), ..all },
            SensorArgs { clutter_per_m2: Some(-1.0), ..SensorArgs::default() },
        ] {
            assert!(wrong.description(&defaults).is_err(), "{wrong:?}");
        }
        assert!(size_noise("0.5:x").is_err() && size_noise("a").is_err());
    }

    #[test]
    fn clutter_is_a_number_per_frame_or_a_density() {
        let density = SensorArgs { clutter_per_m2: Some(2e-4), ..SensorArgs::default() };
        let described = density.declared(&SensingDefaults::default()).unwrap().description.unwrap();
        assert_eq!(described.clutter_per_m2, 2e-4);
    }

    #[test]
    fn the_accuracy_of_a_sensor_by_name_is_before_that_of_all() {
        let of = |text: &str| accuracy(text).unwrap();
        let args = SensorArgs {
            accuracy: vec![of("0.3,0.5,20"), of("rsu=0.05"), of("ego=1,2")],
            ..SensorArgs::default()
        };
        let declared = args.declared(&SensingDefaults::default()).unwrap();
        assert_eq!(declared.description, None, "an accuracy says nothing of what a sensor misses");
        let expected = Accuracy { position_m: 0.3, yaw_rad: 0.5_f64.to_radians(), clock_s: 0.02 };
        assert_eq!(declared.accuracy, Some(expected));
        let rsu = declared.accuracies[&AgentId::new("rsu").unwrap()];
        assert_eq!(rsu, Accuracy { position_m: 0.05, yaw_rad: 0.0, clock_s: 0.0 });
        for wrong in ["", "x", "-1", "1,2,3,4", "a/b=1", "rsu=", "nan", "1,inf"] {
            assert!(accuracy(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn a_region_is_a_rectangle_or_a_distance() {
        assert_eq!(region("50"), Ok(Region::AroundSensors { radius_m: 50.0 }));
        let rectangle = Region::Rectangle { min: [-10.0, -5.5], max: [10.0, 5.0] };
        assert_eq!(region("-10, -5.5,10,5"), Ok(rectangle));
        for wrong in ["", "0", "-3", "1,2", "10,0,-10,5", "1,2,3,x", "nan"] {
            assert!(region(wrong).is_err(), "{wrong:?}");
        }
    }
}
