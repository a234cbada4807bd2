use super::*;
use proptest::prelude::*;
use std::collections::HashSet;
use v2x_common::class::Class;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::HubId;

const OWN: u32 = 2;
const OTHER: u32 = 1;

fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(ms)
}

/// A list of objects at these places, at 10 m/s east.
fn list(ms: i64, objects: &[(TrackId, f64, f64)]) -> FusedFrame {
    let object = |&(track, x, y): &(TrackId, f64, f64)| {
        let bev = BevBox { x, y, w: 1.8, d: 4.5, yaw: 0.0 };
        let mut object = FusedObject::from_box(track, Class::Car, bev);
        object.velocity = (10.0, 0.0);
        object.kinematic_covariance[0] = 0.01;
        object.kinematic_covariance[4] = 0.01;
        object
    };
    FusedFrame {
        hub: HubId::new("hub").unwrap(),
        lineage: OWN,
        sequence: 0,
        fused_at: at(ms),
        map_frame: None,
        objects: objects.iter().map(object).collect(),
        agents: Vec::new(),
        includes: Vec::new(),
    }
}

fn own(number: u32) -> TrackId {
    TrackId::new(OWN, number)
}

fn other(number: u32) -> TrackId {
    TrackId::new(OTHER, number)
}

/// The ids and places under which a list is published.
fn published(names: &mut Names, list: &FusedFrame) -> Vec<(TrackId, f64)> {
    names.renamed(list).objects.iter().map(|object| (object.track, object.bev.x)).collect()
}

#[test]
fn a_standby_publishes_what_the_other_hub_had_listed_under_its_ids_and_new_tracks_under_own_ones() {
    let mut names = Names::default();
    names.note_own(&list(0, &[(own(0), 0.0, 0.0), (own(1), 50.0, 0.0), (own(2), 90.0, 0.0)]));
    // 60 ms later, when all are 0.6 m further.
    names.follow(&list(60, &[(other(7), 50.5, 0.0), (other(9), 0.7, 0.1)]), OWN);
    let after =
        list(400, &[(own(0), 4.0, 0.0), (own(1), 54.0, 0.0), (own(2), 94.0, 0.0), (own(3), 200.0, 0.0)]);
    let expected = [(other(7), 54.0), (other(9), 4.0), (own(2), 94.0), (own(3), 200.0)];
    assert_eq!(published(&mut names, &after), expected);
    assert_eq!(names.count(), 2);
}

#[test]
fn what_a_standby_tracks_only_after_a_takeover_has_the_id_under_which_the_other_hub_listed_it_last() {
    let mut names = Names::default();
    names.note_own(&list(0, &[(own(0), 0.0, 0.0), (own(1), 50.0, 0.0)]));
    names.follow(&list(0, &[(other(7), 50.0, 0.0), (other(8), 0.0, 0.0), (other(9), 90.0, 0.0)]), OWN);
    // Of one it has a track only now, of another a new one in place of the one before.
    let after = list(400, &[(own(0), 4.0, 0.0), (own(5), 54.0, 0.0), (own(6), 94.0, 0.0)]);
    let expected = [(other(7), 54.0), (other(8), 4.0), (other(9), 94.0)];
    assert_eq!(published(&mut names, &after), expected);
    // Long afterwards, or elsewhere, an object is another one.
    let mut names = Names::default();
    names.note_own(&list(0, &[(own(0), 0.0, 0.0)]));
    names.follow(&list(0, &[(other(8), 0.0, 0.0), (other(9), 90.0, 0.0)]), OWN);
    let elsewhere = list(400, &[(own(0), 4.0, 0.0), (own(6), 97.0, 0.0)]);
    assert_eq!(published(&mut names, &elsewhere), [(other(8), 4.0), (own(6), 97.0)]);
    let late = list(1100, &[(own(0), 11.0, 0.0), (own(6), 101.0, 0.0)]);
    assert_eq!(published(&mut names, &late), [(other(8), 11.0), (own(6), 101.0)]);
}

#[test]
fn a_list_that_a_standby_makes_again_after_a_takeover_has_the_same_ids() {
    let mut names = Names::default();
    let mine = list(0, &[(own(0), 6.5, 1.09), (own(2), 6.76, 0.5), (own(4), 0.0, 0.0)]);
    names.note_own(&mine);
    // The own id that the other hub has given to something else is one of those that are looked for.
    names.follow(&list(0, &[(other(0), 6.72, 0.0), (own(4), 5.71, 0.2)]), OWN);
    let first = published(&mut names, &mine);
    assert_eq!(published(&mut names, &mine), first);
    assert_eq!(first[..2], [(other(0), 6.76), (own(4), 6.5)]);
}

#[test]
fn without_another_hub_the_list_of_a_standby_is_as_it_is() {
    let mut names = Names::default();
    let list = list(0, &[(own(0), 0.0, 0.0)]);
    assert!(std::ptr::eq(names.renamed(&list), &raw const list));
}

#[test]
fn ids_that_a_standby_follows_stay_when_objects_pass_each_other_and_move_when_the_other_hub_moves_them() {
    let mut names = Names::default();
    let pass = |gap: f64| [(own(0), 0.0, 0.0), (own(1), gap, 0.0)];
    names.note_own(&list(0, &pass(9.0)));
    names.follow(&list(0, &[(other(0), 0.0, 0.0), (other(1), 9.0, 0.0)]), OWN);
    // Each is nearer to the other's place.
    names.note_own(&list(100, &pass(0.8)));
    names.follow(&list(100, &[(other(0), 0.5, 0.0), (other(1), 0.3, 0.0)]), OWN);
    assert_eq!(published(&mut names, &list(100, &pass(0.8))), [(other(0), 0.0), (other(1), 0.8)]);
    // The other hub says that it is the other way round.
    names.note_own(&list(200, &pass(20.0)));
    names.follow(&list(200, &[(other(0), 20.0, 0.0), (other(1), 0.0, 0.0)]), OWN);
    assert_eq!(published(&mut names, &list(200, &pass(20.0))), [(other(0), 20.0), (other(1), 0.0)]);
}

#[test]
fn at_a_standby_a_track_that_the_other_hub_begins_anew_has_the_new_id_and_the_old_one_comes_never_back() {
    let mut names = Names::default();
    let here = [(own(0), 0.0, 0.0)];
    names.note_own(&list(0, &here));
    names.follow(&list(0, &[(other(0), 0.0, 0.0)]), OWN);
    names.follow(&list(10, &[]), OWN);
    assert_eq!(published(&mut names, &list(10, &here)), [(other(0), 0.0)], "perhaps hidden");
    names.follow(&list(20, &[(other(5), 0.0, 0.0)]), OWN);
    assert_eq!(published(&mut names, &list(20, &here)), [(other(5), 0.0)]);
}

#[test]
fn an_own_id_that_another_hub_has_given_to_another_object_is_not_given_again_by_a_standby() {
    let mut names = Names::default();
    // It had published before: the other hub goes on with its ids, and has exchanged two of them, and moved a third.
    let mine = [(own(0), 0.0, 0.0), (own(1), 50.0, 0.0), (own(2), 90.0, 0.0)];
    names.note_own(&list(0, &mine));
    let theirs = [(own(0), 50.0, 0.0), (own(1), 0.0, 0.0), (own(2), 300.0, 0.0)];
    names.follow(&list(0, &theirs), OWN);
    let fresh = TrackId::new(OWN, u32::MAX - 1);
    let expected = [(own(0), 50.0), (own(1), 0.0), (fresh, 90.0)];
    assert_eq!(published(&mut names, &list(0, &mine)), expected);
    assert_eq!(published(&mut names, &list(10, &mine)), expected, "it keeps it");
}

#[test]
fn what_a_standby_knows_of_ids_is_saved_and_forgotten_when_tracks_are_long_gone() {
    let mut names = Names::default();
    names.note_own(&list(0, &[(own(0), 0.0, 0.0)]));
    names.follow(&list(0, &[(other(0), 0.0, 0.0)]), OWN);
    let bytes = postcard::to_allocvec(&names).unwrap();
    let mut again: Names = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(published(&mut again, &list(0, &[(own(0), 0.0, 0.0)])), [(other(0), 0.0)]);
    again.note_own(&list(200_000, &[]));
    assert_eq!(again.count(), 0);
}

/// Own objects and those of the other hub, at places of a small area, with ids of either lineage.
fn objects() -> impl Strategy<Value = Vec<(TrackId, f64, f64)>> {
    let object = (0..2_u32, 0..12_u32, 0.0..12.0, 0.0..4.0);
    let object = object.prop_map(|(lineage, number, x, y)| (TrackId::new(OTHER + lineage, number), x, y));
    prop::collection::vec(object, 0..12).prop_map(|mut objects| {
        let mut seen = HashSet::new();
        objects.retain(|(track, ..)| seen.insert(*track));
        objects.sort_by_key(|(track, ..)| *track);
        objects
    })
}

proptest! {
    #[test]
    fn no_list_of_a_standby_has_an_id_twice_and_no_object_is_lost(rounds in prop::collection::vec((objects(), objects()), 1..12)) {
        let mut names = Names::default();
        let mut ms = 0;
        for (mine, theirs) in rounds {
            ms += 50;
            let mine: Vec<_> = mine.into_iter().filter(|(track, ..)| track.lineage() == OWN).collect();
            let mine = list(ms, &mine);
            names.note_own(&mine);
            names.follow(&list(ms, &theirs), OWN);
            let ids: Vec<_> = published(&mut names, &mine).into_iter().map(|(track, _)| track).collect();
            let distinct: HashSet<_> = ids.iter().collect();
            prop_assert_eq!(ids.len(), mine.objects.len());
            prop_assert_eq!(distinct.len(), ids.len(), "{:?}", ids);
            prop_assert!(ids.is_sorted());
            // What it publishes next is under the same ids.
            let again: Vec<_> = published(&mut names, &mine).into_iter().map(|(track, _)| track).collect();
            prop_assert_eq!(ids, again);
        }
    }

    /// An id of the other hub that is listed elsewhere is never under what is here.
    #[test]
    fn a_standby_gives_no_object_an_id_that_the_other_hub_lists_far_from_it(mine in objects(), theirs in objects()) {
        let mut names = Names::default();
        let mine: Vec<_> = mine.into_iter().filter(|(track, ..)| track.lineage() == OWN).collect();
        let mine = list(0, &mine);
        names.note_own(&mine);
        names.follow(&list(0, &theirs), OWN);
        for object in &names.renamed(&mine).objects {
            if let Some((_, x, y)) = theirs.iter().find(|(track, ..)| *track == object.track) {
                let distance = libm::hypot(x - object.bev.x, y - object.bev.y);
                prop_assert!(distance <= 2.4, "{distance} m from its place in the other list");
            }
        }
    }
}
