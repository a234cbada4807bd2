//! The part of the loop of a hub that stands by while another hub of its name publishes.
//!
//! Its core takes in all frames. It follows the lists of the hub that publishes, so that it has their ids, and publishes itself
//! when there are no more (`crate::standby`).

use super::Hub;
use crate::hub::control_queue::Asked;
use crate::hub::error::HubError;
use crate::hub::standby::Standby;
use crate::hub::status::StandbyStatus;
use crate::standby::Heard;
use v2x_common::clock;
use v2x_common::keys::Keys;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_common::wire::journal::Call;

/// Objects are compared with those of the other hub no more often than this.
const COMPARED_EVERY: Span = Span::from_millis(90);
/// Stamps go on after those of the other hub where its clock is ahead by no more than this.
const CLOCKS_WITHIN: Span = Span::from_millis(1_000);

impl Hub {
    /// Whether it is this hub that publishes under its name.
    pub(super) fn publishes(&self) -> bool {
        self.standby.as_ref().is_none_or(|standby| standby.role.publishes())
    }

    /// Whether another hub publishes under its name at the same time.
    pub(super) fn has_rival(&self) -> bool {
        self.standby.as_ref().is_none_or(|standby| standby.role.has_rival(clock::now()))
    }

    /// When it decides again by the lists that it has heard.
    pub(super) fn standby_deadline(&self) -> Timestamp {
        self.standby.as_ref().map_or(Timestamp::MAX, |standby| standby.role.next_deadline())
    }

    /// Its session was opened.
    pub(super) async fn begin_to_listen(&mut self) -> Result<(), HubError> {
        let Some(standby) = &mut self.standby else { return Ok(()) };
        let did_publish = standby.role.publishes();
        standby.role.listens_from(clock::now());
        if did_publish && !self.publishes() { self.stand_by().await } else { Ok(()) }
    }

    /// Takes in what another hub of its name says; begins or stops to publish.
    pub(super) async fn follow(&mut self) -> Result<(), HubError> {
        let Some(standby) = &mut self.standby else { return Ok(()) };
        let hub = self.settings.engine.hub;
        let did_publish = standby.role.publishes();
        for (beat, at) in self.network.twin.take_beats() {
            if standby.hear_beat(&beat, at) == Heard::SameLineage {
                return Err(HubError::SameLineage { hub });
            }
        }
        for (payload, at) in self.network.twin.take_lists() {
            self.take_list(&payload, at)?;
        }
        let Some(standby) = &mut self.standby else { return Ok(()) };
        let (now, busy) = (clock::now(), standby.processor.take());
        standby.role.note_busy(busy);
        standby.role.decide(now);
        let publishes = standby.role.publishes();
        if let Some(beats) = &self.network.beats {
            beats.note_step(publishes, self.frames_published, now);
        }
        match (did_publish, publishes) {
            (false, true) => self.take_over().await,
            (true, false) => self.stand_by().await,
            _ => Ok(()),
        }
    }

    /// Takes in a list of another hub of its name.
    fn take_list(&mut self, payload: &[u8], at: Timestamp) -> Result<(), HubError> {
        let (Some(standby), engine) = (&mut self.standby, &self.settings.engine) else { return Ok(()) };
        let Ok(list) = wire::fused::decode(payload) else { return Ok(()) };
        if list.hub != engine.hub {
            return Ok(());
        }
        if standby.role.publishes() && list.lineage == engine.lineage && standby.is_behind(&list) {
            standby.role.give_way(at);
        }
        match standby.hear_list(&list, at, engine.fusion.lag()) {
            Heard::Followed => {
                if at - standby.compared_at >= COMPARED_EVERY {
                    standby.compared_at = at;
                    self.journal.note(&Call::Followed { list: payload });
                    self.core.follow(&list);
                }
                standby.newest = Some((list, at));
            }
            Heard::Yields => standby.newest = Some((list, at)),
            Heard::Ignored => {}
            Heard::SameLineage => return Err(HubError::SameLineage { hub: engine.hub }),
        }
        Ok(())
    }

    async fn take_over(&mut self) -> Result<(), HubError> {
        let Some(standby) = &mut self.standby else { return Ok(()) };
        standby.takeovers += 1;
        match standby.heard {
            Some((lineage, at)) => {
                let silent_ms = (clock::now() - at).as_millis_f64();
                tracing::warn!(
                    "nothing of hub lineage {lineage:08x} for {silent_ms:.0} ms: this hub publishes"
                );
            }
            None => tracing::info!("no other hub of this name publishes: this hub does"),
        }
        if let Some((list, _)) = &standby.newest {
            self.partial_lists.go_on_after(list);
        }
        // The list first: it is waited for.
        self.publish().await;
        let hub = self.settings.engine.hub;
        let announced = self.network.announce(&Keys::new(self.network_id)).await;
        announced.map_err(|cause| HubError::Declare { hub, cause })
    }

    async fn stand_by(&mut self) -> Result<(), HubError> {
        let Some(standby) = &mut self.standby else { return Ok(()) };
        standby.note_yielded();
        match standby.role.follows() {
            Some(lineage) => {
                self.partial_lists.forget();
                tracing::warn!("hub lineage {lineage:08x} publishes under this name: this hub stands by");
            }
            None => tracing::warn!(
                "this hub did not run for a while: it listens whether another one has taken over"
            ),
        }
        self.journal.withdraw().await;
        let hub = self.settings.engine.hub;
        self.network.withdraw().await.map_err(|cause| HubError::Declare { hub, cause })
    }

    /// Makes the list while another hub publishes.
    pub(super) fn make_unpublished(&mut self, now: Timestamp) {
        self.journal.note(&Call::Unpublished { now });
        self.objects = self.core.unpublished(now);
        self.timing.forget_handled();
    }

    /// A time for a list that is after the newest one of the other hub, whose clock is another.
    pub(super) fn after_heard(&self, now: Timestamp) -> Timestamp {
        let Some(standby) = &self.standby else { return now };
        let lag = self.settings.engine.fusion.lag();
        let heard = standby.newest.as_ref().map(|(list, _)| list.fused_at);
        // Without another hub nothing is before the own lists.
        let Some(heard) = heard.max(standby.said_at.map(|at| at - lag)) else { return now };
        let after = heard.max(standby.stamped_at().unwrap_or(heard)) + lag + Span::from_micros(1);
        if after - now <= CLOCKS_WITHIN { now.max(after) } else { now }
    }

    /// The key and the status of the hub that publishes, or of one that stands by; only as what it is.
    pub(super) fn status_answer(&mut self, asked: Asked) -> Option<(String, Vec<u8>)> {
        let (keys, engine) = (Keys::new(self.network_id), &self.settings.engine);
        let key = match (asked, self.publishes()) {
            (Asked::Hub, true) => keys.status(&engine.hub),
            (Asked::Standby, false) => keys.standby_status(&engine.hub, engine.lineage),
            _ => {
                self.control.queries_of_others += 1;
                return None;
            }
        };
        // Before the answer is made, which holds it.
        self.control.queries += 1;
        Some((key, serde_json::to_vec(&self.status()).unwrap_or_default()))
    }

    /// When the newest list came that it follows: whoever is connected to it has that one, too.
    pub(super) fn followed_at(&self) -> Option<Timestamp> {
        let standby = self.standby.as_ref().filter(|standby| !standby.role.publishes())?;
        standby.newest.as_ref().map(|(_, at)| *at)
    }

    pub(super) fn standby_status(&self) -> Option<StandbyStatus> {
        let Standby { role, heard, takeovers, yielded, .. } = self.standby.as_ref()?;
        Some(StandbyStatus {
            publishes: role.publishes(),
            follows: role.follows(),
            heard_at: heard.map(|(_, at)| at.as_micros()),
            takeovers: *takeovers,
            yielded: *yielded,
            named_by_another: self.core.named_by_another(),
        })
    }
}
