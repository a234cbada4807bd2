//! SUMO's network, for pictures: the lanes of `<net>`, and where a configuration says that it is.

use std::io::BufRead;

use super::error::TrafficError;
use super::xml::{Next, Xml};

/// More lanes are too many for a picture.
const MOST: usize = 5000;
/// SUMO's width of a lane without one, m.
const WIDTH_M: f64 = 3.2;
/// Edges that are no roads for vehicles.
const OTHER: [&str; 2] = ["crossing", "walkingarea"];

/// One lane.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Its middle, m.
    pub points: Vec<(f64, f64)>,
    /// m.
    pub width_m: f64,
}

/// The network file that a configuration (`.sumocfg`) names, relative to it.
pub fn read_net_file(config: impl BufRead) -> Result<Option<String>, TrafficError> {
    read_option(config, &["net-file", "net", "n"])
}

/// The time at which a configuration begins, s; `None` where it does not say.
pub fn read_begin(config: impl BufRead) -> Result<Option<f64>, TrafficError> {
    Ok(read_option(config, &["begin", "b"])?.as_deref().and_then(time_s))
}

/// The value of an option of a configuration, which has several names.
fn read_option(config: impl BufRead, names: &[&str]) -> Result<Option<String>, TrafficError> {
    let mut xml = Xml::new(config);
    while let Next::Element(element) = xml.next()? {
        if names.contains(&element.name.as_str()) {
            return Ok(element.attribute("value").or(element.attribute("v")).map(str::to_owned));
        }
    }
    Ok(None)
}

/// A time of SUMO: seconds, or `[days:]hours:minutes:seconds`.
fn time_s(text: &str) -> Option<f64> {
    let parts = text.trim().split(':').map(|part| part.parse::<f64>().ok());
    let mut parts = parts.collect::<Option<Vec<_>>>()?.into_iter().rev();
    let units_s = [1.0, 60.0, 3600.0, 86_400.0];
    let time_s: f64 = units_s.into_iter().zip(parts.by_ref()).map(|(unit_s, part)| unit_s * part).sum();
    (parts.next().is_none() && (0.0..=9e9).contains(&time_s)).then_some(time_s)
}

/// The lanes of a network; none where it has too many for a picture.
pub fn read_lanes(net: impl BufRead) -> Result<Vec<Lane>, TrafficError> {
    let mut xml = Xml::new(net);
    let (mut lanes, mut is_road) = (Vec::new(), true);
    while let Next::Element(element) = xml.next()? {
        match element.name.as_str() {
            "edge" => {
                is_road = element.attribute("function").is_none_or(|function| !OTHER.contains(&function));
            }
            "lane" if is_road => {
                let shape = element.attribute("shape").unwrap_or_default();
                let points: Option<Vec<_>> = shape.split_whitespace().map(point).collect();
                let points = points.ok_or_else(|| element.wrong("shape", "places x,y"))?;
                let width_m =
                    element.attribute("width").and_then(|width| width.parse().ok()).unwrap_or(WIDTH_M);
                lanes.push(Lane { points, width_m });
            }
            _ => {}
        }
        if lanes.len() > MOST {
            return Ok(Vec::new());
        }
    }
    Ok(lanes)
}

/// A place, perhaps with a height.
fn point(text: &str) -> Option<(f64, f64)> {
    let mut numbers =
        text.split(',').map(|number| number.parse::<f64>().ok().filter(|value| value.abs() < 1e8));
    Some((numbers.next()??, numbers.next()??))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_for_vehicles_are_read_and_crossings_are_not() {
        let net = r#"<net><edge id="a"><lane id="a_0" shape="0,1 2.5,3,9" width="3"/></edge>
            <edge id=":c" function="crossing"><lane id=":c_0" shape="0,0 1,1"/></edge>
            <edge id=":m" function="internal"><lane id=":m_0" shape="5,5 6,6"/></edge></net>"#;
        let lanes = read_lanes(net.as_bytes()).unwrap();
        assert_eq!(lanes[0], Lane { points: vec![(0.0, 1.0), (2.5, 3.0)], width_m: 3.0 });
        assert_eq!((lanes.len(), lanes[1].width_m), (2, WIDTH_M));
        let message = read_lanes(net.replace("5,5", "5;5").as_bytes()).unwrap_err().to_string();
        assert!(message.starts_with("line 3, attribute shape of <lane>: \"5;5 6,6\""), "{message}");
    }

    #[test]
    fn a_configuration_names_its_network() {
        let config = r#"<configuration><input><net-file value="a.net.xml"/></input></configuration>"#;
        assert_eq!(read_net_file(config.as_bytes()).unwrap().as_deref(), Some("a.net.xml"));
        assert_eq!(read_net_file(&b"<configuration/>"[..]).unwrap(), None);
    }

    #[test]
    fn a_configuration_says_when_it_begins() {
        let begin = |text: &str| {
            let config = format!(r#"<configuration><time><begin value="{text}"/></time></configuration>"#);
            read_begin(config.as_bytes()).unwrap()
        };
        assert_eq!(
            (begin("25200"), begin("7:00:30"), begin("1:0:0:0")),
            (Some(25_200.0), Some(25_230.0), Some(86_400.0))
        );
        assert_eq!((begin("soon"), begin("1:1:1:1:1"), begin("-1")), (None, None, None));
        assert_eq!(read_begin(&b"<configuration/>"[..]).unwrap(), None);
    }
}
