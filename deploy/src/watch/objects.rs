//! The table of objects as text: the order of its rows, and the columns that fit a width.

use v2x_common::fused::FusedObject;

/// What the objects are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SortKey {
    /// The track id: the oldest first
    #[default]
    Track,
    /// The class, by name
    Class,
    /// From west to east
    X,
    /// From south to north
    Y,
    /// The most uncertain position first
    Sigma,
    /// The fastest first
    Speed,
    /// The most probable first
    Existence,
    /// The longest tracked first
    Age,
    /// Those of most agents first
    Agents,
}

impl SortKey {
    const ALL: [Self; 9] = [
        Self::Track,
        Self::Class,
        Self::X,
        Self::Y,
        Self::Sigma,
        Self::Speed,
        Self::Existence,
        Self::Age,
        Self::Agents,
    ];

    /// The one after this; after the last one the first.
    pub(super) fn next(self) -> Self {
        let place = Self::ALL.iter().position(|key| *key == self).unwrap_or(0);
        Self::ALL[(place + 1) % Self::ALL.len()]
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Track => "track",
            Self::Class => "class",
            Self::X => "x",
            Self::Y => "y",
            Self::Sigma => "sigma",
            Self::Speed => "speed",
            Self::Existence => "existence",
            Self::Age => "age",
            Self::Agents => "agents",
        }
    }

    const fn starts_with_the_largest(self) -> bool {
        matches!(self, Self::Sigma | Self::Speed | Self::Existence | Self::Age | Self::Agents)
    }

    fn value(self, object: &FusedObject) -> f64 {
        match self {
            Self::Track | Self::Class => 0.0,
            Self::X => object.bev.x,
            Self::Y => object.bev.y,
            Self::Sigma => sigma(object),
            Self::Speed => speed(object),
            Self::Existence => object.existence,
            Self::Age => object.age.as_secs_f64(),
            Self::Agents => f64::from(u32::try_from(object.contributors.len()).unwrap_or(u32::MAX)),
        }
    }
}

/// The order of the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Order {
    pub(super) key: SortKey,
    pub(super) is_reversed: bool,
}

impl Order {
    /// The objects in this order; those that are equal in it by track id.
    pub(super) fn sorted(self, objects: &[FusedObject]) -> Vec<&FusedObject> {
        let mut sorted: Vec<_> = objects.iter().collect();
        sorted.sort_by(|a, b| {
            let by_key = match self.key {
                SortKey::Class => a.class.to_string().cmp(&b.class.to_string()),
                SortKey::Track => a.track.cmp(&b.track),
                key => key.value(a).total_cmp(&key.value(b)),
            };
            let by_key = if self.is_descending() { by_key.reverse() } else { by_key };
            by_key.then(a.track.cmp(&b.track))
        });
        sorted
    }

    pub(super) const fn is_descending(self) -> bool {
        self.key.starts_with_the_largest() != self.is_reversed
    }
}

/// A column of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Track,
    Class,
    X,
    Y,
    Sigma,
    Speed,
    Yaw,
    Size,
    Existence,
    Age,
    Agents,
}

impl Column {
    const ALL: [Self; 11] = [
        Self::Track,
        Self::Class,
        Self::X,
        Self::Y,
        Self::Sigma,
        Self::Speed,
        Self::Yaw,
        Self::Size,
        Self::Existence,
        Self::Age,
        Self::Agents,
    ];

    /// Where room is short the last ones are left out; track and position never are.
    const BY_IMPORTANCE: [Self; 11] = [
        Self::Track,
        Self::X,
        Self::Y,
        Self::Class,
        Self::Speed,
        Self::Agents,
        Self::Existence,
        Self::Sigma,
        Self::Yaw,
        Self::Size,
        Self::Age,
    ];
    const ALWAYS_SHOWN: usize = 3;

    pub(super) const fn title(self) -> &'static str {
        match self {
            Self::Track => "track",
            Self::Class => "class",
            Self::X => "x m",
            Self::Y => "y m",
            Self::Sigma => "± m",
            Self::Speed => "m/s",
            Self::Yaw => "yaw °",
            Self::Size => "w × d m",
            Self::Existence => "exist",
            Self::Age => "age s",
            Self::Agents => "agents",
        }
    }

    pub(super) const fn is_text(self) -> bool {
        matches!(self, Self::Track | Self::Class | Self::Agents)
    }

    pub(super) const fn sort_key(self) -> Option<SortKey> {
        Some(match self {
            Self::Track => SortKey::Track,
            Self::Class => SortKey::Class,
            Self::X => SortKey::X,
            Self::Y => SortKey::Y,
            Self::Sigma => SortKey::Sigma,
            Self::Speed => SortKey::Speed,
            Self::Existence => SortKey::Existence,
            Self::Age => SortKey::Age,
            Self::Agents => SortKey::Agents,
            Self::Yaw | Self::Size => return None,
        })
    }

    /// Room that is kept for usual values, so that columns stay where they are while values change.
    const fn usual_width(self) -> usize {
        match self {
            Self::X | Self::Y => 7,
            Self::Sigma | Self::Speed => 5,
            Self::Yaw => 6,
            Self::Size => 12,
            Self::Track | Self::Class | Self::Agents | Self::Existence | Self::Age => 5,
        }
    }

    /// Least room for a text that may be cut.
    const fn least_width(self) -> Option<usize> {
        match self {
            Self::Class => Some(3),
            Self::Agents => Some(9),
            _ => None,
        }
    }

    fn cell(self, object: &FusedObject) -> String {
        let FusedObject { bev, .. } = object;
        match self {
            // The number that JSON has, so that one can be searched for in the other.
            Self::Track => object.track.0.to_string(),
            Self::Class => object.class.to_string(),
            Self::X => fixed(bev.x, 2),
            Self::Y => fixed(bev.y, 2),
            Self::Sigma => format!("{:.2}", sigma(object)),
            Self::Speed => format!("{:.1}", speed(object)),
            Self::Yaw => fixed(bev.yaw.to_degrees(), 1),
            Self::Size => format!("{:.2} × {:.2}", bev.w, bev.d),
            Self::Existence => format!("{:.3}", object.existence),
            Self::Age => format!("{:.1}", object.age.as_secs_f64()),
            Self::Agents => {
                let agents =
                    object.contributors.iter().map(|measurement| measurement.frame.agent.to_string());
                agents.collect::<Vec<_>>().join(" ")
            }
        }
    }
}

/// The columns that fit, and the cells of each row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ObjectTable {
    pub(super) columns: Vec<(Column, usize)>,
    pub(super) rows: Vec<Vec<String>>,
}

impl ObjectTable {
    /// A table at most so wide; of the whole content where there is no limit.
    pub(super) fn fit(objects: &[&FusedObject], width: Option<usize>) -> Self {
        let cells: Vec<_> =
            objects.iter().map(|object| Column::ALL.map(|column| column.cell(object))).collect();
        let needs = Column::ALL.map(|column| {
            let place = column as usize;
            let content = cells.iter().map(|row| row[place].chars().count()).max().unwrap_or(0);
            content.max(column.usual_width()).max(column.title().chars().count())
        });
        let mut widths = needs;
        if let Some(width) = width {
            let short = cells.iter().map(|row| last_name(&row[Column::Class as usize]).chars().count());
            widths = fitted(&needs, short.max().unwrap_or(0).max(5), width);
        }
        let columns: Vec<_> = Column::ALL.into_iter().zip(widths).filter(|(_, width)| *width > 0).collect();
        let class = Column::Class as usize;
        let is_class_short = widths[class] < needs[class];
        let cell = |row: &[String; 11], column: Column, width| match column {
            Column::Class if is_class_short => last_name(&row[class]).chars().take(width).collect(),
            _ => shortened(&row[column as usize], width),
        };
        let row =
            |row: &[String; 11]| columns.iter().map(|&(column, width)| cell(row, column, width)).collect();
        Self { rows: cells.iter().map(row).collect(), columns }
    }
}

/// The width of each column, 0 where it is left out.
fn fitted(needs: &[usize; 11], short_class: usize, width: usize) -> [usize; 11] {
    let mut widths = [0; 11];
    let mut left = width + 1;
    for (rank, column) in Column::BY_IMPORTANCE.into_iter().enumerate() {
        let full = if column == Column::Class { short_class } else { needs[column as usize] };
        let least = column.least_width().map_or(full, |least| least.min(full));
        // What is cut is given more below.
        let taken = if column == Column::Class { full.min(left.saturating_sub(1)).max(least) } else { least };
        if rank < Column::ALWAYS_SHOWN || taken < left {
            widths[column as usize] = taken;
            left = left.saturating_sub(taken + 1);
        }
    }
    for column in [Column::Agents, Column::Class].map(|column| column as usize) {
        if widths[column] > 0 {
            let more = needs[column].saturating_sub(widths[column]).min(left);
            // A class has its full name or its last part, nothing between.
            if column != Column::Class as usize || widths[column] + more == needs[column] {
                widths[column] += more;
                left -= more;
            }
        }
    }
    widths
}

/// The text, with `…` for what has no room.
pub(super) fn shortened(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept: String = text.chars().take(width.saturating_sub(1)).collect();
    if width == 0 { String::new() } else { kept.trim_end().to_owned() + "…" }
}

fn last_name(class: &str) -> &str {
    class.rsplit('.').next().unwrap_or(class)
}

/// With so many digits; what is rounded to zero has no sign.
fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let is_zero = text.bytes().all(|byte| matches!(byte, b'-' | b'0' | b'.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

fn sigma(object: &FusedObject) -> f64 {
    ((object.kinematic_covariance[0] + object.kinematic_covariance[4]) / 2.0).sqrt()
}

pub(super) fn speed(object: &FusedObject) -> f64 {
    let (vx, vy) = object.velocity;
    (vx * vx + vy * vy).sqrt()
}
