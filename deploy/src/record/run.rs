//! The recorder's loop.

use super::args::RecordArgs;
use super::counts::Counts;
use super::journals::Journals;
use anyhow::Context;
use std::io::{IsTerminal, Write};
use std::time::Duration;
use tokio::time::MissedTickBehavior;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::net::events;
use v2x_common::recording::{Entry, RecordingFile};
use v2x_common::time::Timestamp;
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};
use v2x_lab::loopback::hub_status;

/// Samples that may wait for the disk.
const WAITING: usize = 1 << 16;
/// What was received is readable for everybody after this; it is also the time between two lines of progress.
const TICK: Duration = Duration::from_millis(500);
/// Ticks between two progress events of a launcher.
const TICKS_OF_EVENT: u32 = 2;

/// Records everything on a network until shutdown.
pub(crate) async fn run(args: &RecordArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    record(args, Traffic::Recording, shutdown).await
}

/// Records this traffic until shutdown, or until `--count` lists have come.
pub(crate) async fn record(
    args: &RecordArgs,
    traffic: Traffic,
    shutdown: &CancellationToken,
) -> anyhow::Result<()> {
    let written = args.options()?;
    RecordingFile::check_free(&args.file, &written)?;
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let options = args.session_options();
    let subscription = Subscription { network: args.network, traffic, hub: args.hub, capacity: WAITING };
    let connected = Consumer::connect(&options, subscription, timeout, shutdown).await;
    let Some(consumer) = connected.context("start a hub with `v2x up crossing`, or give --connect")? else {
        return Ok(());
    };
    // Not before: a file of nothing would be in the way of the next try, or in place of an older recording.
    let file = RecordingFile::create(&args.file, written)?;
    if file.path() != args.file {
        tracing::info!(file = %file.path().display(), "recording; files that are there stay");
    }
    if args.events {
        events::emit("ready", &serde_json::json!({}));
    }
    let began_at = clock::now();
    let journals = Journals::default();
    let mut recorder =
        Recorder { args, file, journals, counts: Counts::default(), began_at, has_warned: false };
    // A hub says how agents write; where none answers, scenes show what they send.
    if let Ok(Some(writings)) = hub_status::writings(consumer.session(), args.network, args.hub).await {
        recorder.file.read_by(&writings);
    }
    let recorded = recorder.follow(&consumer, shutdown).await;
    let dropped = consumer.dropped();
    consumer.close().await?;
    recorder.end(recorded, dropped)
}

struct Recorder<'a> {
    args: &'a RecordArgs,
    file: RecordingFile,
    journals: Journals,
    counts: Counts,
    began_at: Timestamp,
    /// Whether it has warned of samples that are recorded without their keys.
    has_warned: bool,
}

impl Recorder<'_> {
    fn is_done(&self) -> bool {
        let lasted_s = (clock::now() - self.began_at).as_secs_f64();
        self.args.count.is_some_and(|count| self.counts.fused_frames >= count)
            || self.args.duration.is_some_and(|duration_s| lasted_s >= duration_s)
    }

    async fn follow(&mut self, consumer: &Consumer, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let mut tick = tokio::time::interval(TICK);
        // After a slow disk samples come first, not the ticks that it has cost.
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut n_ticks = 0_u32;
        while !self.is_done() {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                _ = tick.tick() => {
                    n_ticks = n_ticks.wrapping_add(1);
                    self.file.flush(clock::now())?;
                    self.show(consumer.dropped(), n_ticks);
                }
                entry = consumer.next() => self.take(&entry)?,
            }
            for hub in self.journals.take_due(clock::now()) {
                consumer.ask_for_journal(&hub).await?;
            }
        }
        while !self.is_done()
            && let Some(entry) = consumer.try_next()
        {
            self.take(&entry)?;
        }
        Ok(())
    }

    fn take(&mut self, entry: &Entry) -> anyhow::Result<()> {
        if self.counts.add(entry)
            && let Ok(frame) = v2x_common::wire::fused::decode(&entry.payload)
        {
            self.counts.objects = frame.objects.len();
        }
        self.journals.note(entry);
        if self.file.write(entry)? {
            tracing::info!(file = %self.file.path().display(), "a further file begins");
            self.journals.renew();
        }
        if self.file.unsorted() > 0 && !std::mem::replace(&mut self.has_warned, true) {
            tracing::warn!(
                "samples come under too many keys: those of further ones are recorded without them"
            );
        }
        Ok(())
    }

    /// Progress: events for a launcher, else one line in a terminal.
    #[expect(clippy::print_stderr, reason = "one line of progress that is written over")]
    fn show(&self, dropped: u64, n_ticks: u32) {
        if self.args.events {
            if n_ticks.is_multiple_of(TICKS_OF_EVENT) {
                events::emit("progress", &self.counts.to_json(dropped));
            }
        } else if std::io::stderr().is_terminal() {
            eprint!("\r\x1b[K{}", self.progress(dropped));
            let _ = std::io::stderr().flush();
        }
    }

    fn progress(&self, dropped: u64) -> String {
        let Counts { samples, fused_frames, .. } = self.counts;
        #[expect(clippy::cast_precision_loss, reason = "for people")]
        let megabytes = self.file.bytes() as f64 / 1e6;
        let seconds = (clock::now() - self.began_at).as_secs_f64();
        let journal = if self.journals.are_whole() { "with the journal" } else { "without a whole journal" };
        let lost =
            if dropped > 0 { format!(", {dropped} LOST: the disk is too slow") } else { String::new() };
        let unsorted = match self.file.unsorted() {
            0 => String::new(),
            count => format!(", {count} without their keys, which are too many or too long"),
        };
        format!(
            "{seconds:.0} s, {samples} messages ({fused_frames} lists), {megabytes:.1} MB, {journal}{unsorted}{lost}"
        )
    }

    #[expect(clippy::print_stderr, reason = "the last line of progress")]
    fn end(self, recorded: anyhow::Result<()>, dropped: u64) -> anyhow::Result<()> {
        let line = self.progress(dropped);
        let path = self.file.path().display().to_string();
        if self.args.events {
            events::emit("stopped", &self.counts.to_json(dropped));
        } else {
            let clear = if std::io::stderr().is_terminal() { "\r\x1b[K" } else { "" };
            eprintln!("{clear}recorded {line}, into {path}");
        }
        recorded.context("what was recorded until a second before is readable")?;
        self.file.finish()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(clap::Parser)]
    struct Cli {
        #[command(flatten)]
        record: RecordArgs,
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn without_a_hub_no_file_is_left_and_a_recording_that_is_there_is_kept() {
        let file = std::env::temp_dir().join(format!("v2x-record-{}.mcap", std::process::id()));
        let name = file.to_str().unwrap();
        // A port that nobody listens on: it was free a moment ago.
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        let tried = async |options: &[&str]| {
            let words = ["record", name, "--wait", "300ms", "--connect", &endpoint];
            let args = Cli::parse_from(words.iter().chain(options)).record;
            run(&args, &CancellationToken::new()).await.unwrap_err().to_string()
        };
        for _ in 0..2 {
            let refused = tried(&[]).await;
            assert!(refused.contains("start a hub") && !file.exists(), "{refused}");
        }
        std::fs::write(&file, "an older recording").unwrap();
        let exists = tried(&[]).await;
        let forced = tried(&["--force"]).await;
        let kept = std::fs::read_to_string(&file).unwrap();
        std::fs::remove_file(&file).unwrap();
        assert!(exists.contains("exists") && forced.contains("start a hub"), "{exists}; {forced}");
        assert_eq!(kept, "an older recording");
    }
}
