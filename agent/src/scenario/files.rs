//! The files that a scenario names.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::ScenarioError;
use super::place;
use crate::trajectories::{
    Lane, ReadOptions, Traffic, TrafficError, VehicleType, read, read_lanes, read_net_file, read_tables,
    read_vehicle_types,
};

/// Keys of the `[world]` table that name files.
pub(super) const KEYS: [&str; 2] = ["file", "vtypes"];

/// Where the files of a scenario are. What was read once is not read again for another scenario.
#[derive(Debug, Default)]
pub struct Files {
    folder: PathBuf,
    read: RefCell<Vec<(PathBuf, ReadOptions, Arc<Traffic>)>>,
}

impl Files {
    /// Paths are relative to this folder; by default to the present one.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), read: RefCell::default() }
    }

    /// Paths are relative to the folder of this file.
    pub fn beside(file: &Path) -> Self {
        Self::in_folder(file.parent().unwrap_or(Path::new("")))
    }

    /// Where a file is.
    pub(super) fn path(&self, file: &str) -> PathBuf {
        self.folder.join(file)
    }

    /// The files beside a missing one that could be meant, as words.
    pub(super) fn others(&self, path: &Path) -> String {
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let is_meant = |name: &String| {
            name.ends_with(".csv") || name.ends_with(".xml") || folder_of_tables(&folder.join(name)).is_ok()
        };
        let mut names: Vec<_> = names.filter(is_meant).collect();
        names.sort_unstable();
        names.truncate(8);
        if names.is_empty() { "none there".to_owned() } else { names.join(", ") }
    }

    pub(super) fn traffic(&self, path: PathBuf, options: ReadOptions) -> Result<Arc<Traffic>, ScenarioError> {
        let known = self.read.borrow().iter().find_map(|(file, with, traffic)| {
            (*file == path && *with == options).then(|| Arc::clone(traffic))
        });
        if let Some(traffic) = known {
            return Ok(traffic);
        }
        let traffic = open_traffic(&path, &options);
        let traffic = Arc::new(traffic.map_err(|cause| refused(&path, cause))?);
        self.read.borrow_mut().push((path, options, Arc::clone(&traffic)));
        Ok(traffic)
    }

    /// The lanes of the network that SUMO's configuration names; none where they cannot be read, of which SUMO itself speaks.
    pub(super) fn lanes(config: &Path) -> Vec<Lane> {
        let net = open(config).and_then(read_net_file).ok().flatten();
        let net = net.map(|net| config.parent().unwrap_or(Path::new("")).join(net));
        net.and_then(|net| open(&net).and_then(read_lanes).ok()).unwrap_or_default()
    }

    pub(super) fn vehicle_types(path: &Path) -> Result<BTreeMap<String, VehicleType>, ScenarioError> {
        open_vehicle_types(path).map_err(|cause| refused(path, cause))
    }
}

/// Longest script that is looked into.
const MAX_SCRIPT_BYTES: u64 = 1 << 16;

/// What a line of a script has that writes the file which it names.
const WRITES: [&str; 11] =
    ["write", "Write", "to_csv", "savetxt", "-output", "--out", "-o ", "\"w\"", "'w'", "\"wb\"", "tee "];

/// Whether a line of a script names this file as one that is written.
fn is_written_by(line: &str, name: &str) -> bool {
    let Some((before, after)) = line.split_once(name) else { return false };
    let is_redirected = before.trim_end_matches(['"', '\'', '/', '.']).trim_end().ends_with('>');
    is_redirected || WRITES.iter().any(|word| before.contains(word) || after.contains(word))
}

/// The script beside a missing file that writes it: one that plainly says so.
fn maker_of(missing: &Path) -> Option<PathBuf> {
    let name = missing.file_name()?.to_str()?;
    let folder = missing.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let is_script = |path: &PathBuf| path.extension().is_some_and(|suffix| suffix == "py" || suffix == "sh");
    let names_it = |path: &PathBuf| {
        let is_short = path.metadata().is_ok_and(|metadata| metadata.len() <= MAX_SCRIPT_BYTES);
        is_short
            && std::fs::read_to_string(path)
                .is_ok_and(|text| text.lines().any(|line| is_written_by(line, name)))
    };
    let scripts = entries.map(|entry| entry.path()).filter(|path| is_script(path) && names_it(path));
    scripts.min()
}

/// What to run for a missing file, in words; empty where nothing is known that writes it.
pub fn maker_in_words(missing: &Path) -> String {
    let maker = maker_of(missing).map(|script| {
        let runs = if script.extension().is_some_and(|suffix| suffix == "sh") { "sh" } else { "python3" };
        format!("; it is written by  {runs} {}", script.display())
    });
    maker.unwrap_or_default()
}

/// Reads recorded traffic: a file, or the folder of nuScenes' tables. It is read twice where a part of it is wanted and its first
/// row is not the earliest.
pub fn open_traffic(path: &Path, options: &ReadOptions) -> Result<Traffic, TrafficError> {
    let read_by = |options: &ReadOptions| -> Result<Traffic, TrafficError> {
        if !path.is_dir() {
            return read(open(path)?, options);
        }
        let folder = folder_of_tables(path)?;
        read_tables(&|table| table_in(&folder, table), options)
    };
    match read_by(options) {
        Err(TrafficError::EarlierRow { earliest_s }) => {
            read_by(&ReadOptions { earliest_s: Some(earliest_s), ..options.clone() })
        }
        traffic => traffic,
    }
}

/// Reads SUMO's vehicle types.
pub fn open_vehicle_types(path: &Path) -> Result<BTreeMap<String, VehicleType>, TrafficError> {
    read_vehicle_types(open(path)?)
}

/// Opens a table of nuScenes in its folder.
pub fn table_in(folder: &Path, table: &str) -> io::Result<Box<dyn BufRead>> {
    let path = folder.join(table).with_extension("json");
    match File::open(&path) {
        Ok(file) => Ok(Box::new(BufReader::with_capacity(1 << 16, file))),
        Err(cause) => Err(io::Error::new(cause.kind(), format!("{}: {cause}", path.display()))),
    }
}

/// The folder with nuScenes' tables: this one, or the only one in it that has some, such as `v1.0-mini`.
pub fn folder_of_tables(folder: &Path) -> Result<PathBuf, TrafficError> {
    let has_tables = |folder: &Path| folder.join("scene.json").is_file();
    if has_tables(folder) {
        return Ok(folder.to_owned());
    }
    let entries = std::fs::read_dir(folder)?.flatten();
    let mut found: Vec<_> = entries.map(|entry| entry.path()).filter(|path| has_tables(path)).collect();
    found.sort_unstable();
    match &found[..] {
        [one] => Ok(one.clone()),
        [] => Err(TrafficError::Folder("no scene.json is in it, or in a folder of it".to_owned())),
        several => {
            let names = several.iter().filter_map(|path| path.file_name()?.to_str());
            let names = names.collect::<Vec<_>>().join(", ");
            Err(TrafficError::Folder(format!("several folders of it have one: name one of {names}")))
        }
    }
}

fn open(path: &Path) -> Result<BufReader<File>, TrafficError> {
    Ok(BufReader::with_capacity(1 << 16, File::open(path)?))
}

fn refused(path: &Path, cause: TrafficError) -> ScenarioError {
    ScenarioError::Traffic { path: path.to_owned(), cause: Box::new(cause) }
}

/// A scenario's text in which the files of the world have other paths, by their keys and present ones; as it is where it
/// names none.
pub fn with_paths(text: &str, path_of: impl Fn(&str, &str) -> Option<PathBuf>) -> String {
    let mut text = text.to_owned();
    for key in KEYS {
        let value = text.parse::<toml::Table>().ok().and_then(|table| {
            let file = table.get("world")?.get(key)?.as_str()?;
            path_of(key, file)
        });
        let (Some(path), Some(span)) = (value, place::span_of(&text, &format!("world.{key}"))) else {
            continue;
        };
        // JSON writes a text with the same escapes as TOML.
        text.replace_range(span, &serde_json::Value::from(path.display().to_string()).to_string());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_file_counts_from_its_earliest_time_whatever_the_order_of_its_rows() {
        let path = std::env::temp_dir().join(format!("v2x-unsorted-{}.csv", std::process::id()));
        let rows = |id: &str, from: u32| -> String {
            (from..from + 10).map(|t| format!("{t},{id},car,{t},0\n")).collect()
        };
        // Ordered by object: the first one comes five seconds after the second one.
        std::fs::write(&path, format!("t,id,class,x,y\n{}{}", rows("a", 105), rows("b", 100))).unwrap();
        let part = |from_s, to_s| {
            let options = ReadOptions { from_s, to_s, ..ReadOptions::default() };
            open_traffic(&path, &options).map(|traffic| (traffic.first_s, traffic.length.as_secs_f64()))
        };
        let (all, late, early) = (part(None, None), part(Some(5.0), None), part(None, Some(5.0)));
        std::fs::remove_file(&path).unwrap();
        assert_eq!([all, late, early].map(Result::unwrap), [(100.0, 14.0), (105.0, 9.0), (100.0, 5.0)]);
    }

    #[test]
    fn a_script_that_only_reads_a_file_is_not_taken_for_the_one_that_writes_it() {
        for (line, is_written) in [
            ("Usage: python3 make.py > t.csv", true),
            ("table.to_csv(\"t.csv\")", true),
            ("with open('t.csv', 'w') as out:", true),
            ("\"--fcd-output\", \"t.csv\", \"--no-step-log\"], cwd=HERE)", true),
            ("rows = list(csv.reader(open(\"t.csv\")))", false),
            ("# t.csv is missing today", false),
            ("def rows(path=\"t.csv\") -> list:", false),
            ("sort t.txt >\"./t.csv\"", true),
            ("print(\"written\") # nothing of it", false),
        ] {
            assert_eq!(is_written_by(line, "t.csv"), is_written, "{line}");
        }
    }

    #[test]
    fn a_path_is_replaced_and_all_else_stays_as_it_was() {
        let text = "[world] # of mine\nfile = \"a.csv\" # recorded\n";
        let moved = with_paths(text, |_, file| Some(Path::new("/runs \"1\"").join(file)));
        let table: toml::Table = moved.parse().unwrap();
        assert_eq!(table["world"]["file"].as_str(), Some("/runs \"1\"/a.csv"));
        assert!(moved.starts_with("[world] # of mine\n") && moved.ends_with(" # recorded\n"), "{moved}");
        assert_eq!(
            with_paths("[world]\nkind = \"crossing\"\n", |_, _| None),
            "[world]\nkind = \"crossing\"\n"
        );
    }
}
