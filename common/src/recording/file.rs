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
    /// Bytes of the files before, and messages without a channel of their own in them.
    bytes_before: u64,
    unsorted_before: u64,
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
    /// Whether [`Self::create`] would refuse a file that is there; it makes none, so that it can be asked before there is anything to
    /// record.
    ///
    /// # Errors
    /// Where it would.
    pub fn check_free(path: &Path, options: &RecordingOptions) -> Result<(), FileError> {
        if path.exists() && !options.overwrite && !options.goes_on() {
            return Err(FileError::Exists(path.to_owned()));
        }
        Ok(())
    }

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
        Ok(Self {
            first_path: path.to_owned(),
            options,
            part,
            number,
            scenes,
            bytes_before: 0,
            unsorted_before: 0,
        })
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

    /// Samples that are in a channel for all others, without their key: there are too many keys, or theirs is too long.
    pub const fn unsorted(&self) -> u64 {
        self.unsorted_before + self.part.writer.unsorted()
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
        self.unsorted_before += self.part.writer.unsorted();
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
mod tests;
