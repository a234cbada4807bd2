//! The links that have a name.

/// A link that can be named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    /// Its name with its settings.
    pub usage: &'static str,
    /// Source of its numbers.
    pub provenance: &'static str,
    /// A text that can be parsed, as an example.
    pub example: &'static str,
}

/// All links that can be named.
pub const PROFILES: [Profile; 12] = [
    Profile { usage: "ideal", provenance: "no delay, no loss", example: "ideal" },
    Profile {
        usage: "its-g5",
        provenance: "fit: mean 4 ms in line of sight (802.11p field test); no loss figure published",
        example: "its-g5",
    },
    Profile {
        usage: "pc5",
        provenance: "fit: median below 20 ms, packet errors below 10 % to 1200 m (PC5 trial, Electronics 14(22):4509); \
                     taken as 18 ms and 5 %",
        example: "pc5",
    },
    Profile {
        usage: "lte-uu",
        provenance: "fit: median 50 ms, p95 below 60 ms (LTE-Uu trial, Electronics 14(22):4509)",
        example: "lte-uu",
    },
    Profile {
        usage: "5g-mec",
        provenance: "fit: half of 5g-cloud (TARGET-X 2026: edge computing halves it)",
        example: "5g-mec",
    },
    Profile {
        usage: "5g-cloud",
        provenance: "fit: 40 to 50 ms of service latency, 5G NSA (TARGET-X 2026)",
        example: "5g-cloud",
    },
    Profile {
        usage: "cell-gamma:min=50ms,exp=150ms",
        provenance: "Eclipse MOSAIC, cellular: min + Gamma(2, 2) (exp - min) / 4; the numbers of its demo",
        example: "cell-gamma:min=50ms,exp=150ms",
    },
    Profile {
        usage: "v2xvit-noisy",
        provenance: "V2X-ViT's and OpenCOOD's noisy setting: always 100 ms; in a scenario it brings their \
                     pose noise too (0.2 m, 0.2°, anew in each frame) where the agent has no pose_error",
        example: "v2xvit-noisy",
    },
    Profile {
        usage: "cobevflow:p=0.3",
        provenance: "CoBEVFlow: Binomial(10, p) frames of 100 ms",
        example: "cobevflow:p=0.3",
    },
    Profile {
        usage: "dair-async-1 | dair-async-2",
        provenance: "DAIR-V2X's asynchronous sets: one or two frames of 100 ms",
        example: "dair-async-1",
    },
    Profile {
        usage: "trace:FILE",
        provenance: "your recording: CSV with the columns t (s), delay (s) and perhaps lost (0 or 1)",
        example: "ideal",
    },
    Profile {
        usage: "custom:delay=80ms,jitter=30ms,loss=0.01,burst=3,rate=2Mbps",
        provenance: "your numbers: a normal delay truncated at 0, bursts of losses (Gilbert-Elliott), a finite rate",
        example: "custom:delay=80ms,jitter=30ms,loss=0.01,burst=3,rate=2Mbps",
    },
];
