//! Replays the inputs that the fuzz targets have kept (`tests/fuzz/corpus`): each reaches code that the others do not, or
//! was a fault once.

use crate::abuse;
use std::path::Path;

#[path = "../../tests/fuzz/checks/codec.rs"]
mod codec;

/// The files of a target's corpus, in the order of their names.
fn corpus(target: &str) -> std::io::Result<Vec<Vec<u8>>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/corpus").join(target);
    let mut files: Vec<_> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.sort();
    assert!(files.len() >= 10, "{target} has only {} files", files.len());
    files.iter().map(std::fs::read).collect()
}

#[test]
fn the_codec_keeps_the_meaning_of_every_input_of_the_corpus() -> std::io::Result<()> {
    corpus("codec")?.iter().for_each(|bytes| codec::run(bytes));
    Ok(())
}

#[test]
fn the_engine_survives_every_fault_of_the_corpus() -> std::io::Result<()> {
    let accepted: usize = corpus("engine")?.iter().map(|bytes| abuse::run(bytes).1).sum();
    assert!(accepted > 10, "only {accepted} frames of the corpus reach the engine");
    Ok(())
}
