//! A choice of scenes of nuScenes.

use std::fmt;
use std::str::FromStr;

/// The 150 scenes of the official validation list (nuscenes-devkit, `splits.py`), as ranges of their numbers.
const VAL: [(u16, u16); 26] = [
    (3, 3),
    (12, 18),
    (35, 36),
    (38, 39),
    (92, 110),
    (221, 221),
    (268, 278),
    (329, 332),
    (344, 346),
    (519, 524),
    (552, 565),
    (625, 627),
    (629, 630),
    (632, 638),
    (770, 771),
    (775, 775),
    (777, 778),
    (780, 784),
    (794, 800),
    (802, 802),
    (904, 917),
    (919, 931),
    (962, 963),
    (966, 969),
    (971, 972),
    (1059, 1073),
];

/// A choice of scenes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Split {
    /// The scenes of the official validation list.
    Val,
    /// All scenes.
    All,
    /// The scenes with these names.
    Named(Vec<String>),
}

impl Split {
    /// Whether it contains a scene of this name.
    pub fn has(&self, name: &str) -> bool {
        match self {
            Self::All => true,
            Self::Named(names) => names.iter().any(|one| one == name),
            Self::Val => {
                let number = name.strip_prefix("scene-").and_then(|number| number.parse::<u16>().ok());
                number.is_some_and(|number| VAL.iter().any(|(low, high)| (*low..=*high).contains(&number)))
            }
        }
    }
}

impl FromStr for Split {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "val" => Self::Val,
            "all" => Self::All,
            names => Self::Named(names.split(',').map(|name| name.trim().to_owned()).collect()),
        })
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Val => f.write_str("val"),
            Self::All => f.write_str("all"),
            Self::Named(names) => f.write_str(&names.join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_official_list_has_150_scenes() {
        let names = (0..=1110u16).map(|number| format!("scene-{number:04}"));
        assert_eq!(names.filter(|name| Split::Val.has(name)).count(), 150);
        assert!(Split::Val.has("scene-0103") && Split::Val.has("scene-0916"), "v1.0-mini's two");
        assert!(!Split::Val.has("scene-0061") && !Split::Val.has("scene-0918"));
    }

    #[test]
    fn scenes_are_named_with_commas() {
        let split: Split = "scene-0001, scene-0002".parse().unwrap();
        assert!(split.has("scene-0002") && !split.has("scene-0003"));
    }
}
