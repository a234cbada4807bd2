//! CLEAR MOT and the identity measures against py-motmetrics, HOTA against TrackEval.

use super::{assert_same, count, fixture};
use v2x_lab::tracking::clear::Clear;
use v2x_lab::tracking::hota::{Hota, HotaScore};
use v2x_lab::tracking::identity::Identity;

fn of_clear(clear: &Clear) -> [(&'static str, Option<f64>); 8] {
    [
        ("num_objects", count(clear.objects)),
        ("num_matches", count(clear.matches())),
        ("num_switches", count(clear.switches)),
        ("num_false_positives", count(clear.false_positives)),
        ("num_misses", count(clear.misses())),
        ("num_fragmentations", count(clear.fragmentations)),
        ("mota", clear.mota()),
        ("motp", clear.motp_m()),
    ]
}

fn of_identity(identity: &Identity) -> [(&'static str, Option<f64>); 6] {
    [
        ("idtp", count(identity.true_positives)),
        ("idfp", count(identity.false_positives())),
        ("idfn", count(identity.false_negatives())),
        ("idf1", identity.idf1()),
        ("idp", identity.idp()),
        ("idr", identity.idr()),
    ]
}

fn of_hota(score: &HotaScore) -> [(&'static str, Option<f64>); 8] {
    [
        ("HOTA", Some(score.hota)),
        ("DetA", Some(score.det_a)),
        ("AssA", Some(score.ass_a)),
        ("LocA", Some(score.loc_a)),
        ("DetRe", Some(score.det_re)),
        ("DetPr", Some(score.det_pr)),
        ("AssRe", Some(score.ass_re)),
        ("AssPr", Some(score.ass_pr)),
    ]
}

#[test]
fn clear_mot_is_motmetrics_of_each_scene_and_of_all() {
    let fixture = fixture();
    for group in &fixture.groups {
        let (mut all, expected) = (Clear::default(), &group.motmetrics);
        for (scene, expected) in fixture.sequences(group).iter().zip(expected) {
            let clear = Clear::of(scene, fixture.gate_m);
            assert_same(&group.name, &of_clear(&clear), expected);
            all.merge(&clear);
        }
        assert_same(&group.name, &of_clear(&all), &expected[group.scenes.len()]);
    }
}

#[test]
fn identity_is_motmetrics_of_each_scene_and_of_all() {
    let fixture = fixture();
    for group in &fixture.groups {
        let (mut all, expected) = (Identity::default(), &group.motmetrics);
        for (scene, expected) in fixture.sequences(group).iter().zip(expected) {
            let identity = Identity::of(scene, fixture.gate_m);
            assert_same(&group.name, &of_identity(&identity), expected);
            all.merge(&identity);
        }
        assert_same(&group.name, &of_identity(&all), &expected[group.scenes.len()]);
    }
}

#[test]
fn hota_is_trackevals_of_each_scene_and_combined_for_any_zero_distance() {
    let fixture = fixture();
    for group in &fixture.groups {
        for (zero_m, expected) in &group.hota {
            let (mut all, zero_m) = (Hota::default(), zero_m.parse().unwrap());
            for (scene, expected) in fixture.sequences(group).iter().zip(expected) {
                let hota = Hota::of(scene, zero_m);
                assert_same(&group.name, &of_hota(&hota.score()), expected);
                all.merge(&hota);
            }
            assert_same(&group.name, &of_hota(&all.score()), &expected[group.scenes.len()]);
        }
    }
}
