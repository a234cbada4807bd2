//! The time of the engine's own call, for `benches/handle.py`, which writes the frames.
//!
//! Usage: handle FRAMES, a file of payloads of the compact format, each behind its arrival (ns) and its length, both as
//! integers of eight bytes, little-endian. Prints the time of each call in ns, one a line.

use std::error::Error;
use std::fmt::Write;
use std::time::Instant;
use v2x_common::id::HubId;
use v2x_common::time::Timestamp;
use v2x_common::wire::detections::decode;
use v2x_fusion_hub::{Disposition, Engine, EngineConfig};

#[expect(clippy::disallowed_methods, clippy::print_stdout, reason = "a measurement")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: handle FRAMES")?;
    let bytes = std::fs::read(path)?;
    let mut rest = bytes.as_slice();
    let mut frames = Vec::new();
    while !rest.is_empty() {
        let (head, more) = rest.split_at_checked(16).ok_or("truncated")?;
        let arrival = i64::from_le_bytes(head[..8].try_into()?);
        let length = usize::try_from(u64::from_le_bytes(head[8..].try_into()?))?;
        let (payload, more) = more.split_at_checked(length).ok_or("truncated")?;
        frames.push((Timestamp::from_nanos(arrival), decode(payload)?));
        rest = more;
    }
    let mut engine = Engine::new(EngineConfig::new(HubId::new("hub")?, 1));
    let mut times = String::new();
    for (now, frame) in &frames {
        let begin = Instant::now();
        let disposition = engine.handle_frame(frame, *now);
        writeln!(times, "{}", begin.elapsed().as_nanos())?;
        if let Disposition::Refused(refusal) = disposition {
            return Err(refusal.into());
        }
    }
    print!("{times}");
    Ok(())
}
