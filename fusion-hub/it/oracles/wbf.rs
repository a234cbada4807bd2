//! Weighted box fusion against its authors' implementation, which supports axis-aligned boxes only.

use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_fusion_hub::baselines::{Report, Rule};
use v2x_fusion_hub::values::Measurement;

#[derive(serde::Deserialize)]
struct Case {
    threshold: f64,
    agents: Vec<Vec<Box>>,
    fused: Vec<Box>,
}

#[derive(serde::Deserialize)]
struct Box {
    corners: [f64; 4],
    score: f64,
    label: u8,
}

impl Box {
    fn report(&self) -> Report {
        let [x1, y1, x2, y2] = self.corners;
        Report {
            z: Measurement {
                class: Class::from_byte(self.label).expect("the script uses our numbers"),
                position: [(x1 + x2) / 2.0, (y1 + y2) / 2.0],
                r: Covariance2::isotropic(1.0),
                size: [y2 - y1, x2 - x1],
                relative_variance: [0.04; 2],
                size_law: [None; 2],
                heading: v2x_common::detection::HeadingKind::Known,
                yaw: 0.0,
                yaw_variance: 0.1,
                velocity: None,
                is_track: false,
                since_last_s: f64::INFINITY,
            },
            score: self.score,
        }
    }
}

#[test]
fn fused_boxes_equal_those_of_the_authors_code() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("wbf.json")).unwrap();
    assert!(cases.len() >= 18);
    for case in &cases {
        let agents: Vec<Vec<Report>> =
            case.agents.iter().map(|boxes| boxes.iter().map(Box::report).collect()).collect();
        let agents: Vec<&[Report]> = agents.iter().map(Vec::as_slice).collect();
        let mut ours = Rule::Wbf { overlap: case.threshold }.fuse(&agents);
        ours.sort_by(|a, b| b.score.total_cmp(&a.score));
        assert_eq!(ours.len(), case.fused.len());
        for (one, theirs) in ours.iter().zip(&case.fused) {
            let expected = theirs.report();
            assert_eq!(one.z.class, expected.z.class);
            // Theirs holds scores and corners as 32-bit numbers, of 100 m here.
            let ours = [one.score, one.z.position[0], one.z.position[1], one.z.size[0], one.z.size[1]];
            let z = expected.z;
            let theirs = [theirs.score, z.position[0], z.position[1], z.size[0], z.size[1]];
            super::assert_close(&ours, &theirs, 3e-5);
            assert!(one.z.yaw.abs() < 1e-12);
        }
    }
}
