//! What is probably wrong with what agents send, as the numbers show it: in sentences that say what to change.
//!
//! A [`Survey`] takes in every frame that arrives and every list that is published, and gathers statistics over ten seconds;
//! [`Survey::diagnose`] judges them together with what the engine counts and learns. Nothing here changes what is fused. The hub has
//! one for its status and its warnings, `v2x check` one of its own where no hub answers.
//!
//! - `arrivals`, `intervals`, `streams`, `contents`, `copies`, `feedback`, `own_tracks`, `writing`, `sizes`, `paces`, `scatter`, `stale`, `coasting`, `views`, `headings`, `velocities`, `speeds`, `alignment`: statistics, each of one kind;
//!   `steps`: an agent's own detections, followed over three frames.
//! - `judge`: what they mean, in words.

mod alignment;
mod arrivals;
mod coasting;
mod contents;
mod copies;
mod feedback;
mod finding;
mod headings;
mod intervals;
mod judge;
mod observation;
mod own_tracks;
mod paces;
mod scatter;
mod sizes;
mod speeds;
mod stale;
mod steps;
mod streams;
mod survey;
mod velocities;
mod views;
mod window;
mod writing;

pub use arrivals::Transport;
pub use finding::{Code, Finding, Severity};
pub use observation::Observation;
pub use survey::Survey;
pub use window::{Source, Surroundings, Tokens};
