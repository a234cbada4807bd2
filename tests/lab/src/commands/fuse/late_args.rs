//! Options of `lab fuse` for frames that arrive later than they did.

use crate::data::detection_log::Delay;
use v2x_common::duration::parse_millis;
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// More is no delay of a network, ms.
const MOST_MS: f64 = 60_000.0;

/// How much later frames arrive than the log says.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct LateArgs {
    /// Frames arrive later than in the log by so much, such as 200ms or 1s (a plain number is ms), or by a time up to UP_TO that is
    /// drawn for each; those of one sensor as SENSOR=… May be repeated
    #[arg(long, value_name = "[SENSOR=]DURATION[,UP_TO]", value_parser = delay)]
    pub late: Vec<Delay>,
    /// Seed of the times that are drawn
    #[arg(long, value_name = "N", default_value_t = 1, requires = "late")]
    pub late_seed: u64,
}

fn delay(text: &str) -> Result<Delay, String> {
    let (sensor, figures) = match text.split_once('=') {
        Some((sensor, figures)) => (Some(AgentId::new(sensor).map_err(|error| error.to_string())?), figures),
        None => (None, text),
    };
    let time = |text: &str| {
        let ms = parse_millis(text).ok().filter(|ms| (0.0..=MOST_MS).contains(ms));
        ms.map(|ms| Span::from_secs_f64(ms / 1e3))
            .ok_or_else(|| format!("{text:?} is no delay of 0 to {MOST_MS} ms, such as 200, 200ms or 1s"))
    };
    let (least, most) = figures.split_once(',').unwrap_or((figures, figures));
    let (least, most) = (time(least)?, time(most)?);
    if most < least {
        return Err(format!("{figures:?} begins with the longer delay: write the shorter one first"));
    }
    Ok(Delay { sensor, least, most })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_constant_or_drawn_of_all_sensors_or_of_one() {
        let ms = Span::from_millis;
        assert_eq!(delay("200"), Ok(Delay { sensor: None, least: ms(200), most: ms(200) }));
        assert_eq!(delay("200ms,1.5s"), Ok(Delay { sensor: None, least: ms(200), most: ms(1500) }));
        let rsu = AgentId::new("rsu").unwrap();
        assert_eq!(delay("rsu=50, 250"), Ok(Delay { sensor: Some(rsu), least: ms(50), most: ms(250) }));
        for wrong in ["", "x", "-1", "100,50", "1,2,3", "a/b=1", "rsu=", "nan", "inf", "70000"] {
            assert!(delay(wrong).is_err(), "{wrong:?}");
        }
    }
}
