//! The versions of tracks in the list of all tracks: by id, so that those of one track are next to each other.

use super::ParticleSet;
use crate::track::Track;
use v2x_common::id::TrackId;

/// Moves versions that no particle holds to `spare`, and puts the others in order.
pub(crate) fn order<F>(tracks: &mut Vec<Track<F>>, spare: &mut Vec<Track<F>>) {
    let mut kept = 0;
    for place in 0..tracks.len() {
        if !tracks[place].holders.is_empty() {
            if kept < place {
                tracks.swap(kept, place);
            }
            kept += 1;
        }
    }
    spare.extend(tracks.drain(kept..));
    if !tracks.is_sorted_by_key(|track| track.id) {
        tracks.sort_by_key(|track| track.id);
    }
}

/// Leaves of a track's versions the leading particle's, which then is everybody's.
pub(crate) fn keep_leading<F>(tracks: &mut Vec<Track<F>>, id: TrackId) {
    tracks.retain(|track| track.id != id || track.holders.leads());
    let start = tracks.partition_point(|track| track.id < id);
    for track in tracks[start..].iter_mut().take_while(|track| track.id == id) {
        track.holders = ParticleSet::ALL;
    }
}
