//! nuScenes' tracking metrics against nuscenes-devkit.

use super::{assert_same, count, fixture};
use v2x_lab::tracking::amota::{ClassScore, NuscenesScore, TrackingClass};

/// Values that the devkit leaves out without a match: false positives, switches and fragmentations.
fn of(score: &ClassScore) -> [(&'static str, Option<f64>); 11] {
    let best = score.best.as_ref();
    [
        ("amota", Some(score.amota)),
        ("amotp", Some(score.amotp_m)),
        ("motar", Some(score.motar())),
        ("mota", Some(score.mota())),
        ("motp", Some(score.motp_m())),
        ("recall", Some(score.recall())),
        ("tp", best.map_or(Some(0.0), |best| count(best.matches()))),
        ("fn", count(best.map_or(score.objects, |best| best.misses()))),
        ("fp", best.and_then(|best| count(best.false_positives))),
        ("ids", best.and_then(|best| count(best.switches))),
        ("frag", best.and_then(|best| count(best.fragmentations))),
    ]
}

#[test]
fn every_class_and_their_means_are_the_devkits() {
    let fixture = fixture();
    for group in &fixture.groups {
        let score = NuscenesScore::of(&fixture.sequences(group));
        for class in TrackingClass::ALL {
            let name = serde_json::to_value(class).unwrap();
            let expected = &group.nuscenes.classes[name.as_str().unwrap()];
            let what = format!("{}, {name}", group.name);
            match score.classes.iter().find(|(of, _)| *of == class) {
                Some((_, ours)) => assert_same(&what, &of(ours), expected),
                None => assert!(expected.values().all(Option::is_none), "{what}: {expected:?}"),
            }
        }
        let means = [
            ("amota", score.amota()),
            ("amotp", score.amotp_m()),
            ("motar", score.mean(ClassScore::motar)),
            ("mota", score.mean(ClassScore::mota)),
            ("motp", score.mean(ClassScore::motp_m)),
            ("recall", score.mean(ClassScore::recall)),
        ];
        assert_same(&group.name, &means, &group.nuscenes.all);
    }
}
