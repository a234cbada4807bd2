//! Recordings into files of a folder.

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
    assert!(matches!(error, Some(RecordingError::Unfinished { index }) if index == found.len()), "{error:?}");
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
