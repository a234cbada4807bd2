//! Who is alive: what tokens say, read again where some of that was lost.

use super::Hub;
use crate::hub::token_changes::TokenChange;
use v2x_common::keys::Keys;
use v2x_common::time::Timestamp;

impl Hub {
    pub(super) fn note_token(&mut self, TokenChange { token, is_there, count }: &TokenChange) {
        self.control.liveliness += count;
        self.roster.note(token, *is_there);
    }

    /// Reads all tokens again where changes were lost: otherwise who has left would be alive for ever.
    pub(super) async fn heal_roster(&mut self, now: Timestamp) {
        self.roster.sum_up(now);
        if let Some(read) = self.tokens.take_if(|read| read.is_finished()) {
            match read.await.unwrap_or_else(|broken| Err(broken.into())) {
                Ok(tokens) => self.roster.renew(&tokens),
                Err(error) => tracing::debug!(%error, "tokens not read; trying again"),
            }
        }
        if self.roster.is_to_be_read(self.network.control.take_lost_tokens(), now) {
            let tokens = self.network.tokens(&Keys::new(self.network_id));
            self.tokens = Some(tokio::spawn(tokens));
        }
    }
}
