//! `v2x links`: the named links, with figures of random draws from them.

use crate::output;
use anyhow::Context;
use serde::Serialize;
use std::fmt::Write;
use v2x_agent::link::profiles::{self, PROFILES};
use v2x_agent::link::{Link, LinkConfig, Parcel, Transit};
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// Frames that the figures are drawn from.
const FRAMES: u64 = 100_000;
/// A frame of about fifty detections.
const BYTES: usize = 1500;
const RATE_HZ: i64 = 10;

/// List the named links, or print the delays and losses of given ones, from random draws
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
In a scenario a link is written as  link = \"lte-uu\"  in an agent's table, or as
a table of numbers. All names except trace: take loss=, burst= (mean length of a
burst of losses, frames), rate=, outage= with outage-every=, and reorder=; those
with a normal delay also delay= and jitter=, those with a log-normal one delay=
(its median). These are settings of an agent, not of its link: sensing_ms,
transmit, send, clock, pose_error (see crossing.toml).

Examples:
  v2x links
  v2x links lte-uu its-g5:loss=0.1,burst=4
  v2x links custom:delay=80ms,jitter=30ms,rate=1Mbps --bytes 20000
  v2x links --json | jq .")]
pub(crate) struct LinksArgs {
    /// The links to print [default: all named links]
    links: Vec<String>,
    /// Size of a message
    #[arg(long, default_value_t = BYTES)]
    bytes: usize,
    /// Seed of the draws
    #[arg(long, default_value_t = 1, value_parser = v2x_common::seed::parse_seed)]
    seed: u64,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// A link's figures.
#[derive(Clone, Debug, Serialize)]
struct Figures {
    link: String,
    mean_ms: f64,
    p50_ms: f64,
    p95_ms: f64,
    p99_ms: f64,
    loss: f64,
    mean_burst: f64,
    provenance: String,
}

pub(crate) fn run(args: &LinksArgs) -> anyhow::Result<()> {
    let all: Vec<Figures> = if args.links.is_empty() {
        let named = PROFILES.iter().filter(|profile| !profile.usage.starts_with("trace"));
        named.map(|profile| figures(profile.example, profile.provenance, args)).collect::<Result<_, _>>()?
    } else {
        args.links.iter().map(|link| figures(link, provenance(link), args)).collect::<Result<_, _>>()?
    };
    let text = if args.json { serde_json::to_string(&all)? + "\n" } else { table(&all, args) };
    output::print(&text).map(|_| ())
}

/// The figures as lines to read, each with its source below it.
fn table(all: &[Figures], args: &LinksArgs) -> String {
    let width = all.iter().map(|one| one.link.len()).max().unwrap_or(0).max(4);
    let mut text = format!("{:width$}  mean ms     p50     p95     p99    loss  burst\n", "link");
    for Figures { link, mean_ms, p50_ms, p95_ms, p99_ms, loss, mean_burst, provenance } in all {
        let loss_percent = 100.0 * loss;
        let _ = writeln!(
            text,
            "{link:width$}  {mean_ms:7.1} {p50_ms:7.1} {p95_ms:7.1} {p99_ms:7.1} {loss_percent:6.2}% {mean_burst:6.1}\n\
             {:width$}    {provenance}",
            ""
        );
    }
    let trace = PROFILES.iter().find(|profile| profile.usage.starts_with("trace"));
    if let Some(profile) = trace.filter(|_| args.links.is_empty()) {
        let _ = writeln!(text, "{}\n{:width$}    {}", profile.usage, "", profile.provenance);
    }
    let LinksArgs { bytes, seed, .. } = args;
    let _ =
        writeln!(text, "\nFrom random draws: {FRAMES} frames of {bytes} bytes at {RATE_HZ} Hz, seed {seed}.");
    text
}

fn provenance(link: &str) -> &'static str {
    let name = link.split(':').next().unwrap_or_default();
    let names = |usage: &str| usage.split('|').any(|one| one.trim().split(':').next() == Some(name));
    PROFILES.iter().find(|profile| names(profile.usage)).map_or("", |profile| profile.provenance)
}

fn figures(name: &str, provenance: &str, args: &LinksArgs) -> anyhow::Result<Figures> {
    let config: LinkConfig = profiles::parse(name, |path| std::fs::read_to_string(path))?;
    let agent = AgentId::new("agent").context("a legal name")?;
    let link = Link::new(config, args.seed, agent);
    let (mut delays_ms, mut lost) = (Vec::new(), Vec::new());
    for sequence in 0..FRAMES {
        let millis = 1000 / RATE_HZ * i64::try_from(sequence)?;
        let parcel = Parcel { sequence, since_start: Span::from_millis(millis), bytes: args.bytes };
        let transit = link.transit(parcel);
        lost.push(transit == Transit::Lost);
        if let Transit::Delivered { delay } = transit {
            delays_ms.push(delay.as_millis_f64());
        }
    }
    delays_ms.sort_unstable_by(f64::total_cmp);
    let quantile =
        |share: f64| delays_ms.get((share * delays_ms.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    let n_lost = lost.iter().filter(|lost| **lost).count() as f64;
    let n_bursts = lost.chunk_by(|a, b| a == b).filter(|run| run[0]).count() as f64;
    Ok(Figures {
        link: name.to_owned(),
        mean_ms: delays_ms.iter().sum::<f64>() / delays_ms.len() as f64,
        p50_ms: quantile(0.5),
        p95_ms: quantile(0.95),
        p99_ms: quantile(0.99),
        loss: n_lost / FRAMES as f64,
        mean_burst: if n_bursts > 0.0 { n_lost / n_bursts } else { 0.0 },
        provenance: provenance.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_links_figures_are_those_it_is_named_by() {
        let args = LinksArgs { links: Vec::new(), bytes: BYTES, seed: 1, json: false };
        let lte = figures("lte-uu:loss=0.1,burst=4", provenance("lte-uu:loss=0.1"), &args).unwrap();
        assert!((lte.p50_ms - 50.0).abs() < 0.2 && (lte.p95_ms - 60.0).abs() < 0.3, "{lte:?}");
        assert!((lte.loss - 0.1).abs() < 0.01 && (lte.mean_burst - 4.0).abs() < 0.2, "{lte:?}");
        assert!(lte.provenance.contains("Electronics"));
        let dair = figures("dair-async-2", provenance("dair-async-2"), &args).unwrap();
        assert_eq!((dair.mean_ms.round(), dair.loss), (200.0, 0.0));
        assert!(dair.provenance.contains("DAIR-V2X"));
    }
}
