//! Writes the golden files of this wire version: `cargo run -p v2x-common --no-default-features --example golden`.
//!
//! A file that exists is left alone, and in the end is an error: golden bytes remain for ever.

#[path = "../it/fixture.rs"]
mod fixture;

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use v2x_common::wire::{self, WireError, json};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("it/golden/v{}", wire::VERSION));
    fs::create_dir_all(&folder)?;
    let detections = fixture::detection_frame();
    let sensor = fixture::sensor_description();
    let fused = fixture::fused_frame();
    let delta = fixture::delta_frame();
    let files = [
        ("detections.bin", bytes(|buffer| wire::detections::encode(&detections, buffer))?),
        ("detections.json", line(json::encode_detections(&detections)?)),
        ("sensor.bin", bytes(|buffer| wire::sensor::encode(&sensor, buffer))?),
        ("sensor.json", line(json::encode_sensor(&sensor)?)),
        ("fused.bin", bytes(|buffer| wire::fused::encode(&fused, buffer))?),
        ("fused.json", line(json::encode_fused(&fused)?)),
        ("delta.bin", bytes(|buffer| wire::delta::encode(&delta, buffer))?),
        ("delta.json", line(json::encode_delta(&delta)?)),
    ];
    let mut outcome = Ok(());
    for (name, content) in files {
        let path = folder.join(name);
        match File::create_new(&path) {
            Ok(mut file) => file.write_all(&content)?,
            Err(error) => outcome = Err(format!("{}: {error}", path.display()).into()),
        }
    }
    outcome
}

fn bytes(encode: impl Fn(&mut Vec<u8>) -> Result<(), WireError>) -> Result<Vec<u8>, WireError> {
    let mut buffer = Vec::new();
    encode(&mut buffer)?;
    Ok(buffer)
}

fn line(mut json: Vec<u8>) -> Vec<u8> {
    json.push(b'\n');
    json
}
