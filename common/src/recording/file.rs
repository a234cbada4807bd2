//! A recording that is being written into files.

use super::entry::Entry;
use super::mcap_writer::McapWriter;
use super::scene::Scenes;
use crate::id::HubId;
use crate::keys::Topic;
use crate::time::{Span, Timestamp};
use crate::wire::Writings;
use crate::wire::journal::{Batch, Item};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// What is written is readable at least this long after.
const FLUSHED_EVERY: Span = Span::from_millis(500);

/// Why a recording cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// There is a file of this name.
    #[error("{} exists; choose another name, or give --force to overwrite it", .0.display())]
    Exists(PathBuf),
    /// The file cannot be made.
    #[error("making {}: {cause}", .path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// It cannot be written, for lack of room for example. What was written up to a second before is readable.
    #[error("writing {}: {}", .path.display(), innermost(.cause))]
    Write {
        /// The file.
        path: PathBuf,
        /// The error.
        cause: mcap::McapError,
    },
}

/// The cause in words: the system's, where there is one.
fn innermost(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(cause) => cause.to_string(),
        other => other.to_string(),
    }
}

/// How a recording is written.
#[derive(Clone, Debug)]
pub struct RecordingOptions {
    /// Whether a file of the same name is overwritten.
    pub overwrite: bool,
    /// The next file begins when one has this many bytes; never where it is `None`. A recording of several files goes on beside
    /// those that are there, with the number after the last one.
    pub rotate_bytes: Option<u64>,
    /// The next file begins when one is this old; never where it is `None`.
    pub rotate_after: Option<Span>,
    /// Least time between two scenes of a topic for Foxglove's viewers; no scenes where it is `None`.
    pub scene_interval: Option<Span>,
    /// What the recording says of itself.
    pub facts: BTreeMap<String, String>,
    /// Files that belong to it, by name: the scenario of a simulated network, for example. Each file of the recording has them.
    pub attachments: BTreeMap<String, Vec<u8>>,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self {
            overwrite: false,
            rotate_bytes: None,
            rotate_after: None,
            scene_interval: Some(Span::from_millis(200)),
            facts: BTreeMap::new(),
            attachments: BTreeMap::new(),
        }
    }
}

impl RecordingOptions {
    /// Whether it goes on beside files that are there.
    const fn goes_on(&self) -> bool {
        !self.overwrite && (self.rotate_bytes.is_some() || self.rotate_after.is_some())
    }
}

/// A recording that is being written.
pub struct RecordingFile {
    first_path: PathBuf,
    options: RecordingOptions,
    part: Part,
    /// The number of the file, from 1.
    number: u32,
    /// Where scenes are wanted.
    scenes: Option<Scenes>,
    /// Bytes of the files before.
    bytes_before: u64,
}

/// One file of it.
struct Part {
    path: PathBuf,
    writer: McapWriter<BufWriter<File>>,
    began_at: Option<Timestamp>,
    flushed_at: Timestamp,
    bytes: u64,
    /// Hubs whose settings it has.
    hubs: BTreeSet<HubId>,
}

impl RecordingFile {
    /// Makes the first file: where a recording of several files is not to overwrite anything, the one after those that are there.
    ///
    /// # Errors
    /// Where it exists and is neither to be overwritten nor one of several, or cannot be made.
    pub fn create(path: &Path, options: RecordingOptions) -> Result<Self, FileError> {
        let (part, number) = if options.goes_on() {
            Part::create_after(path, last_number(path) + 1, &options)?
        } else {
            (Part::create(path.to_owned(), &options)?, 1)
        };
        let scenes = options.scene_interval.map(Scenes::new);
        Ok(Self { first_path: path.to_owned(), options, part, number, scenes, bytes_before: 0 })
    }

    /// For its scenes: from now on agents write so.
    pub fn read_by(&mut self, writings: &Writings) {
        self.scenes.iter_mut().for_each(|scenes| scenes.read_by(writings.clone()));
    }

    /// The file that is being written.
    pub fn path(&self) -> &Path {
        &self.part.path
    }

    /// Bytes of all files, a little behind.
    pub const fn bytes(&self) -> u64 {
        self.bytes_before + self.part.bytes
    }

    /// Appends a sample. `true` where a new file began before it: whoever can repeat what is needed at the begin of a file, does
    /// it now.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&mut self, entry: &Entry) -> Result<bool, FileError> {
        let is_new = self.rotate_before(entry)?;
        let part = &mut self.part;
        part.began_at.get_or_insert(entry.received_at);
        part.writer.write(entry).map_err(|cause| part.error(cause))?;
        part.bytes += entry.payload.len() as u64 + ENTRY_OVERHEAD;
        self.write_settings(entry)?;
        self.write_scene(entry)?;
        if entry.received_at - self.part.flushed_at >= FLUSHED_EVERY {
            self.flush(entry.received_at)?;
        }
        Ok(is_new)
    }

    /// Makes what was written readable for everybody, at `now`.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn flush(&mut self, now: Timestamp) -> Result<(), FileError> {
        self.part.flushed_at = now;
        self.part.writer.flush().map_err(|cause| self.part.error(cause))
    }

    /// Takes a recording back of which nothing was written: whoever is started again and again leaves no empty files.
    pub fn discard(self) {
        if self.bytes() == 0 {
            // Where it cannot be deleted, an empty recording stays, which harms nobody.
            let _ = std::fs::remove_file(&self.part.path);
        }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// Where the end cannot be written.
    pub fn finish(mut self) -> Result<(), FileError> {
        self.part.finish()
    }

    fn rotate_before(&mut self, entry: &Entry) -> Result<bool, FileError> {
        let RecordingOptions { rotate_bytes, rotate_after, .. } = self.options;
        let age = self.part.began_at.map_or(Span::ZERO, |began_at| entry.received_at - began_at);
        let is_full = rotate_bytes.is_some_and(|limit| self.part.bytes >= limit)
            || rotate_after.is_some_and(|limit| age >= limit);
        if !is_full {
            return Ok(false);
        }
        self.part.finish()?;
        self.bytes_before += self.part.bytes;
        (self.part, self.number) = Part::create_after(&self.first_path, self.number + 1, &self.options)?;
        self.scenes.iter_mut().for_each(Scenes::clear);
        Ok(true)
    }

    /// Where the journal of a hub starts: the hub's settings as metadata, for whoever reads no journals.
    fn write_settings(&mut self, entry: &Entry) -> Result<(), FileError> {
        let Some(Topic::Journal(hub)) = Topic::of(&entry.key) else { return Ok(()) };
        let part = &mut self.part;
        if part.hubs.contains(&hub) {
            return Ok(());
        }
        let Ok(batch) = Batch::decode(&entry.payload) else { return Ok(()) };
        let mut items = batch.items().flatten();
        let start = items.find_map(|item| if let Item::Start(start) = item { Some(start) } else { None });
        let Some(start) = start else { return Ok(()) };
        part.hubs.insert(hub);
        let facts = [
            ("hub", hub.to_string()),
            ("version", start.version.to_owned()),
            ("commit", start.commit.to_owned()),
            ("settings", start.settings.to_owned()),
        ];
        let facts = facts.map(|(key, value)| (key.to_owned(), value)).into();
        part.writer.write_facts("v2x.hub", facts).map_err(|cause| part.error(cause))
    }

    fn write_scene(&mut self, entry: &Entry) -> Result<(), FileError> {
        // What cannot be read has no scene; the recording holds it all the same.
        let Some(scene) = self.scenes.as_mut().and_then(|scenes| scenes.of(entry)) else { return Ok(()) };
        let part = &mut self.part;
        part.bytes += scene.json.len() as u64 + ENTRY_OVERHEAD;
        part.writer
            .write_scene(&scene.topic, entry.received_at, &scene.json)
            .map_err(|cause| part.error(cause))
    }
}

/// Bytes of a message beside its payload: its own head, and its place in the index.
const ENTRY_OVERHEAD: u64 = 47;

impl Part {
    /// The file of this number, or of the next one that is free where it exists and is not to be overwritten.
    fn create_after(
        first: &Path,
        mut number: u32,
        options: &RecordingOptions,
    ) -> Result<(Self, u32), FileError> {
        loop {
            match Self::create(numbered(first, number), options) {
                Err(FileError::Exists(_)) if number < u32::MAX => number += 1,
                made => return Ok((made?, number)),
            }
        }
    }

    fn create(path: PathBuf, options: &RecordingOptions) -> Result<Self, FileError> {
        let mut open = OpenOptions::new();
        open.write(true);
        if options.overwrite {
            open.create(true).truncate(true)
        } else {
            open.create_new(true)
        };
        let file = open.open(&path).map_err(|cause| match cause.kind() {
            io::ErrorKind::AlreadyExists => FileError::Exists(path.clone()),
            _ => FileError::Create { path: path.clone(), cause },
        })?;
        let out = BufWriter::with_capacity(1 << 16, file);
        let writer = McapWriter::new(out, &options.facts, &options.attachments)
            .map_err(|cause| FileError::Write { path: path.clone(), cause })?;
        Ok(Self { path, writer, began_at: None, flushed_at: Timestamp::MIN, bytes: 0, hubs: BTreeSet::new() })
    }

    fn finish(&mut self) -> Result<(), FileError> {
        self.writer.finish().map_err(|cause| self.error(cause))
    }

    fn error(&self, cause: mcap::McapError) -> FileError {
        FileError::Write { path: self.path.clone(), cause }
    }
}

/// The name of a file by its number: `run.mcap`, and `run-2.mcap` after it.
fn numbered(first: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return first.to_owned();
    }
    let stem = first.file_stem().unwrap_or_default().to_string_lossy();
    let name = match first.extension() {
        Some(extension) => format!("{stem}-{number}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    first.with_file_name(name)
}

/// The largest number of the files that are there; 0 where there is none. Gaps are not filled: later files have larger numbers.
fn last_number(first: &Path) -> u32 {
    let folder = match first.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let Some(stem) = first.file_stem().map(|stem| stem.to_string_lossy()) else { return 0 };
    // What cannot be listed is found when the file is made.
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let number = |name: &std::ffi::OsStr| {
        let name = Path::new(name);
        let of_name = name.file_stem()?.to_str()?;
        let number = match of_name.strip_prefix(&*stem)? {
            "" => 1,
            rest => rest.strip_prefix('-')?.parse().ok()?,
        };
        (name.extension() == first.extension()).then_some(number)
    };
    names.filter_map(|name| number(&name)).max().unwrap_or(0).min(u32::MAX - 1)
}

#[cfg(test)]
mod tests {
    use super::super::{Recording, RecordingError};
    use super::*;

    /// A folder that is deleted at the end of the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("v2x-recording-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            std::fs::remove_dir_all(&self.0).unwrap();
        }
    }

    fn entry(ms: i64) -> Entry {
        Entry {
            received_at: Timestamp::EPOCH + Span::from_millis(ms),
            key: format!("v2x/demo/agent/a{}/detections", ms % 3),
            encoding: if ms % 2 == 0 { "application/json" } else { "application/vnd.v2x.postcard" }.into(),
            payload: vec![7; 100],
        }
    }

    fn record(path: &Path, options: RecordingOptions, entries: &[Entry]) -> RecordingFile {
        let mut file = RecordingFile::create(path, options).unwrap();
        for entry in entries {
            file.write(entry).unwrap();
        }
        file
    }

    fn read(path: &Path) -> (Vec<Entry>, Option<RecordingError>) {
        let mut entries = Vec::new();
        for entry in Recording::open(path).unwrap() {
            match entry {
                Ok(entry) => entries.push(entry),
                Err(error) => return (entries, Some(error)),
            }
        }
        (entries, None)
    }

    #[test]
    fn samples_are_read_as_they_were_written_with_what_the_recorder_knew() {
        let folder = Folder::new("whole");
        let path = folder.0.join("run.mcap");
        let entries: Vec<_> = (0..50).map(entry).collect();
        let facts = BTreeMap::from([("commit".to_owned(), "abc".to_owned())]);
        let attachments = BTreeMap::from([("scenario.toml".to_owned(), b"name = 'a'".to_vec())]);
        let options = RecordingOptions {
            facts: facts.clone(),
            attachments: attachments.clone(),
            ..RecordingOptions::default()
        };
        record(&path, options, &entries).finish().unwrap();
        let mut recording = Recording::open(&path).unwrap();
        assert_eq!(recording.next().unwrap().unwrap(), entries[0]);
        assert_eq!((recording.facts(), recording.attachments()), (facts, attachments));
        let (read, error) = read(&path);
        assert_eq!((read, error.is_none()), (entries, true));
    }

    #[test]
    fn a_recording_whose_recorder_was_killed_has_all_but_the_last_second_and_says_so() {
        let folder = Folder::new("killed");
        let path = folder.0.join("run.mcap");
        let entries: Vec<_> = (0..5000).step_by(10).map(entry).collect();
        // Forgotten, as by a process that is killed: nothing is written after.
        std::mem::forget(record(&path, RecordingOptions::default(), &entries));
        let (found, error) = read(&path);
        assert!(
            matches!(error, Some(RecordingError::Unfinished { index }) if index == found.len()),
            "{error:?}"
        );
        assert_eq!(found, entries[..found.len()]);
        let last = found.last().unwrap().received_at - Timestamp::EPOCH;
        assert!(last >= Span::from_millis(4000), "{last:?}");
        for end in [9, 100, 1000, 20_000] {
            let cut = folder.0.join("cut.mcap");
            std::fs::write(&cut, &std::fs::read(&path).unwrap()[..end]).unwrap();
            let (found, error) = read(&cut);
            assert!(error.is_some() && found == entries[..found.len()], "cut at {end}: {error:?}");
        }
    }

    #[test]
    fn a_new_file_begins_by_size_or_age_and_is_numbered() {
        let folder = Folder::new("rotated");
        let path = folder.0.join("run.mcap");
        let entries: Vec<_> = (0..100).map(entry).collect();
        let by_size = RecordingOptions { rotate_bytes: Some(5000), ..RecordingOptions::default() };
        record(&path, by_size, &entries).finish().unwrap();
        let mut all = read(&path).0;
        all.extend(read(&folder.0.join("run-2.mcap")).0);
        all.extend(read(&folder.0.join("run-3.mcap")).0);
        assert_eq!(all, entries);
        let path = folder.0.join("old.mcap");
        let by_age =
            RecordingOptions { rotate_after: Some(Span::from_millis(60)), ..RecordingOptions::default() };
        record(&path, by_age, &entries).finish().unwrap();
        assert_eq!((read(&path).0.len(), read(&folder.0.join("old-2.mcap")).0.len()), (60, 40));
    }

    #[test]
    fn a_file_that_exists_is_overwritten_only_where_that_is_said() {
        let folder = Folder::new("exists");
        let path = folder.0.join("run.mcap");
        std::fs::write(&path, "mine").unwrap();
        let error = RecordingFile::create(&path, RecordingOptions::default()).err().unwrap();
        assert!(error.to_string().contains("exists"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
        let overwrite = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
        record(&path, overwrite, &[entry(0)]).finish().unwrap();
        assert_eq!(read(&path).0.len(), 1);
    }

    #[test]
    fn a_recording_of_several_files_goes_on_after_those_that_are_there_and_touches_none_of_them() {
        let folder = Folder::new("goes-on");
        let path = folder.0.join("run.mcap");
        let by_size = || RecordingOptions { rotate_bytes: Some(5000), ..RecordingOptions::default() };
        let names = ["run.mcap", "run-2.mcap", "run-7.mcap", "run-x.mcap", "run-9.txt"];
        names.iter().for_each(|name| std::fs::write(folder.0.join(name), "mine").unwrap());
        let entries: Vec<_> = (0..100).map(entry).collect();
        let mut file = RecordingFile::create(&path, by_size()).unwrap();
        assert_eq!(file.path(), folder.0.join("run-8.mcap"));
        // Somebody else's file comes in the way.
        std::fs::write(folder.0.join("run-9.mcap"), "mine").unwrap();
        for entry in &entries {
            file.write(entry).unwrap();
        }
        file.finish().unwrap();
        let all: Vec<_> =
            [8, 10, 11].iter().flat_map(|n| read(&folder.0.join(format!("run-{n}.mcap"))).0).collect();
        assert_eq!(all, entries);
        for name in names.iter().chain(&["run-9.mcap"]) {
            assert_eq!(std::fs::read_to_string(folder.0.join(name)).unwrap(), "mine", "{name}");
        }
    }

    #[test]
    fn a_recording_that_never_began_leaves_no_file() {
        let folder = Folder::new("discarded");
        let path = folder.0.join("run.mcap");
        RecordingFile::create(&path, RecordingOptions::default()).unwrap().discard();
        assert!(!path.exists());
        record(&path, RecordingOptions::default(), &[entry(0)]).discard();
        assert!(path.exists());
    }

    #[test]
    fn a_leftover_in_the_way_of_a_later_file_ends_no_recording() {
        let folder = Folder::new("leftover");
        let path = folder.0.join("run.mcap");
        let by_age =
            RecordingOptions { rotate_after: Some(Span::from_millis(60)), ..RecordingOptions::default() };
        let mut file = RecordingFile::create(&path, by_age).unwrap();
        std::fs::write(folder.0.join("run-2.mcap"), "mine").unwrap();
        for entry in (0..100).map(entry) {
            file.write(&entry).unwrap();
        }
        assert_eq!(file.path(), folder.0.join("run-3.mcap"));
        file.finish().unwrap();
        assert_eq!(read(&folder.0.join("run-3.mcap")).0.len(), 40);
        assert_eq!(std::fs::read_to_string(folder.0.join("run-2.mcap")).unwrap(), "mine");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_an_error_that_names_the_file() {
        let overwrite = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
        let outcome = RecordingFile::create(Path::new("/dev/full"), overwrite)
            .and_then(|mut file| file.write(&entry(0)).and_then(|_| file.flush(Timestamp::EPOCH)));
        let error = outcome.err().unwrap().to_string();
        assert!(error.contains("/dev/full") && error.contains("No space"), "{error}");
    }
}
