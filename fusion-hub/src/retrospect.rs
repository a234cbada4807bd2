//! What is told of an earlier time, by everything that is known by now.

use crate::config::EngineConfig;
use crate::filter::Filter;
use crate::publish::{Publisher, Told, blank, name_contributors, note_sizes, write_down};
use crate::track::{Records, Retrospect, Retrospection, Track};
use v2x_common::fused::FusedObject;
use v2x_common::time::Timestamp;

/// History is older than what is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RetrospectError {
    /// It is not remembered.
    #[error("what was at {at} is asked for, but history begins at {begins}")]
    Forgotten {
        /// What is asked for.
        at: Timestamp,
        /// The oldest time that can be asked for: Δmax or the lag ago, whichever is longer; later under overload.
        begins: Timestamp,
    },
    /// It lies in the future.
    #[error("what will be at {at} is asked for as if it had been, at {now}")]
    InFuture {
        /// What is asked for.
        at: Timestamp,
        /// The present.
        now: Timestamp,
    },
}

impl Publisher {
    /// Fills the list with the objects as of `at`; what the list held is overwritten, its memory used again.
    ///
    /// An object is told if it had been reported by `at` and, by all that is known by now, existed then.
    pub(crate) fn fill_as_of<F: Filter>(
        &mut self,
        objects: &mut Vec<FusedObject>,
        (tracks, back): (&[&Track<F>], &mut Retrospection<F>),
        (at, records): (Timestamp, &Records<'_>),
        config: &EngineConfig,
    ) {
        let mut priors = self.past_sizes.clone();
        let leading = || tracks.iter().copied().filter(|track| track.holders.leads());
        leading().for_each(|track| note_sizes(&mut priors, track, config));
        let mut count = 0;
        for track in leading() {
            let Some(Retrospect { state, existence, last_measured_at }) = back.look_back(track, at, records)
            else {
                continue;
            };
            if existence < config.publish_existence || at - last_measured_at > config.coast {
                continue;
            }
            if objects.len() == count {
                objects.push(self.spare.pop().unwrap_or_else(blank));
            }
            let estimate = state.estimate(track.latest().class(), &priors);
            let told = Told { estimate, existence, at, last_measured_at };
            if write_down(&mut objects[count], track, &told) {
                name_contributors(&mut objects[count], back.contributors(), records.agents);
                count += 1;
            }
        }
        self.spare.extend(objects.drain(count..));
    }
}
