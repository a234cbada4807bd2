use super::*;
use crate::data::fixture::agent;
use crate::report::plot::scene::{FusedMark, SceneAgent, TrueBox};
use v2x_common::geometry::Pose;
use v2x_common::sensor::SensorKind;

/// A synthetic crossing with parked and driving cars.
fn scene() -> BevScene {
    let mut state = 12_345u64;
    let mut noise = |scale: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (f64::from(u16::try_from(state >> 48).unwrap()) / 65_535.0 - 0.5) * 2.0 * scale
    };
    let mut scene = BevScene {
        title: "crossing <N1> & more, seed 7: a typical moment".to_owned(),
        subtitle: "mean fused position error 0.21 m, the median of all scored fused frames".to_owned(),
        ..BevScene::default()
    };
    let pose = |x, y, yaw| Some(Pose { x, y, yaw });
    let observer = |name, kind, pose, ms| SceneAgent {
        id: agent(name),
        kind: Some(kind),
        pose,
        detections: vec![],
        offset: Some(Span::from_millis(ms)),
    };
    scene.agents.push(observer("ego", SensorKind::Vehicle, pose(-18.0, -2.0, 0.1), -40));
    scene.agents.push(observer("rsu", SensorKind::RoadsideUnit, pose(9.0, 11.0, -2.0), 12));
    for place in 0..44 {
        let along = f64::from(place % 22) * 5.5 - 58.0 + noise(2.0);
        let side = if place % 2 == 0 { 2.5 } else { -2.5 } + noise(0.7);
        let heading = if place % 2 == 0 { std::f64::consts::PI } else { 0.0 } + noise(0.15);
        let (x, y, yaw) = if place < 22 { (along, side, heading) } else { (-side, along, heading + 1.57) };
        let (w, d) = if place % 5 == 0 { (0.7, 0.8) } else { (1.9, 4.5) };
        let bev = BevBox { x, y, w, d, yaw };
        let is_covered = x.abs().max(y.abs()) < 50.0;
        let class = if place % 5 == 0 { Class::Adult } else { Class::Car };
        scene.truth.push(TrueBox { bev, class, is_covered });
        if !is_covered {
            continue;
        }
        let mut off = |m: f64, rad: f64, size: f64| BevBox {
            x: x + noise(m),
            y: y + noise(m),
            w: w * (1.0 + noise(size)),
            d: d * (1.0 + noise(size)),
            yaw: yaw + noise(rad),
        };
        scene.agents[0].detections.push(off(1.0, 0.15, 0.3));
        scene.agents[1].detections.push(off(1.0, 0.15, 0.3));
        scene.fused.push(FusedMark { bev: off(0.3, 0.05, 0.1), class, words: format!("{class}, 3.0 m/s") });
    }
    scene
}

fn svg_of(scene: &BevScene) -> String {
    bev_sheet(scene).svg()
}

/// Checks that elements nest, and returns how many there are of each name.
fn elements(xml: &str) -> std::collections::BTreeMap<String, usize> {
    let mut open = Vec::new();
    let mut counts = std::collections::BTreeMap::new();
    for element in xml.split('<').skip(1) {
        let (tag, text) = element.split_once('>').expect("every tag is closed");
        assert!(!text.contains('>') && tag.matches('"').count() % 2 == 0, "{element}");
        let name = tag.trim_start_matches('/').split([' ', '/', '\n']).next().unwrap().to_owned();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
            continue;
        }
        *counts.entry(name.clone()).or_insert(0) += 1;
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    counts
}

#[test]
fn the_picture_is_well_formed_and_holds_every_box() {
    let scene = scene();
    let svg = svg_of(&scene);
    let counts = elements(&svg);
    let n_boxes = scene.fused.len() + scene.agents.iter().map(|a| a.detections.len()).sum::<usize>();
    assert!(counts["path"] > n_boxes + scene.agents.len(), "{counts:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    assert!(svg.contains("crossing &lt;N1&gt; &amp; more"));
}

#[test]
fn the_legend_counts_what_is_drawn() {
    let svg = svg_of(&scene());
    for text in [
        "truth: 36 objects",
        "ego (vehicle): 36 detections, 40 ms earlier",
        "36 detections, 12 ms later",
        "rsu (roadside-unit)",
        "fused: 36",
    ] {
        assert!(svg.contains(text), "{text} is missing");
    }
}

#[test]
fn colours_are_the_papers() {
    let svg = svg_of(&scene());
    let first = |colour: &str| svg.find(colour).unwrap();
    assert!(first(TRUTH) < first(AGENTS[0]) && first(AGENTS[0]) < first(AGENTS[1]));
    assert!(first(AGENTS[1]) < first(FUSED));
}

#[test]
fn an_empty_scene_and_many_agents_still_make_a_picture() {
    elements(&svg_of(&BevScene::default()));
    let mut crowded = scene();
    let one = crowded.agents[0].clone();
    crowded.agents.extend(std::iter::repeat_n(one, 18));
    elements(&svg_of(&crowded));
}

#[test]
fn north_is_up_and_the_scale_is_kept() {
    let view = Viewport { centre: (100.0, 200.0), half_m: 50.0, panel: WHOLE };
    for (metres, (right, down)) in [((50.0, 250.0), (0.0, 0.0)), ((150.0, 150.0), (1.0, 1.0))] {
        let (x, y) = view.px(metres);
        let (expected_x, expected_y) = (WHOLE.x + right * WHOLE.w, WHOLE.y + down * WHOLE.h);
        assert!((x - expected_x).abs() < 1e-9 && (y - expected_y).abs() < 1e-9, "{metres:?} at {x}, {y}");
    }
    assert!(view.shows(149.0, 151.0, 0.0) && !view.shows(151.0, 200.0, 0.5));
}

#[test]
fn the_busiest_spot_is_where_most_boxes_are() {
    let car = |x| BevBox { x, y: 0.0, w: 2.0, d: 4.0, yaw: 0.0 };
    let truth = |x| TrueBox { bev: car(x), class: Class::Car, is_covered: true };
    let fused = |x| FusedMark { bev: car(x), class: Class::Car, words: String::new() };
    let scene = BevScene {
        truth: vec![truth(0.0), truth(100.0), truth(104.0)],
        fused: vec![fused(0.0), fused(104.2)],
        ..BevScene::default()
    };
    assert!(busiest_spot(&scene, DETAIL_HALF_M).0 >= 100.0);
}

#[test]
fn boxes_have_the_tint_of_their_class_and_the_legend_the_groups_that_occur() {
    let svg = svg_of(&scene());
    let tinted = |class: Class| svg.matches(&format!("fill=\"{}\" opacity", tint(class.group()))).count();
    assert!(
        tinted(Class::Car) > 36 && tinted(Class::Adult) > 8,
        "{} {}",
        tinted(Class::Car),
        tinted(Class::Adult)
    );
    assert_eq!(tinted(Class::Bicycle), 0);
    assert!(svg.contains(">car or larger vehicle<") && svg.contains(">person or animal<"));
    assert!(!svg.contains("bicycle or motorcycle") && !svg.contains("unknown class"));
}

#[test]
fn the_enlarged_part_has_words_beside_boxes_and_says_what_short_ones_mean() {
    let car = |x: f64| BevBox { x, y: 0.0, w: 2.0, d: 4.0, yaw: 0.0 };
    let truth = |x: f64, class| TrueBox { bev: car(x), class, is_covered: true };
    let fused = |x: f64, class| FusedMark { bev: car(x), class, words: String::new() };
    let mut scene = BevScene {
        truth: vec![truth(0.0, Class::Car), truth(6.0, Class::Bicycle), truth(60.0, Class::Truck)],
        fused: vec![fused(0.2, Class::Car), fused(6.2, Class::Bicycle), fused(60.0, Class::Truck)],
        ..BevScene::default()
    };
    let svg = svg_of(&scene);
    assert!(svg.contains(">car</text>") && svg.contains(">bike</text>"), "{svg}");
    assert!(svg.contains("bike: vehicle.bicycle") && !svg.contains("car: vehicle"), "{svg}");
    assert!(!svg.contains(">truck</text>"), "only the enlarged part has words");
    // Where boxes are everywhere there is no room for words.
    let detection = |step: i32| {
        let (x, y) = (f64::from(step % 30) - 12.0, f64::from(step / 30) - 15.0);
        BevBox { x, y, w: 1.2, d: 1.2, yaw: 0.0 }
    };
    scene.agents.push(SceneAgent {
        id: agent("ego"),
        kind: Some(SensorKind::Vehicle),
        pose: None,
        detections: (0..900).map(detection).collect(),
        offset: None,
    });
    assert!(!svg_of(&scene).contains(">car</text>"));
}

#[test]
fn what_moves_has_an_arrow_in_the_picture_and_in_the_legend() {
    let mut scene = scene();
    let still = svg_of(&scene);
    let BevBox { x, y, .. } = scene.fused[0].bev;
    scene.motions = vec![[(x, y), (x + 5.0, y)]];
    let moving = svg_of(&scene);
    let lines = |svg: &str| svg.matches("<path").count();
    assert!(lines(&moving) >= lines(&still) + 3 + 3, "a shaft and two barbs, twice");
    assert!(moving.contains("its motion in 1 s") && !still.contains("its motion in 1 s"));
}

#[test]
fn fused_boxes_say_what_is_known_of_them_where_the_pointer_is() {
    let scene = scene();
    let svg = svg_of(&scene);
    let n = svg.matches("<title>").count();
    assert!(n > scene.fused.len(), "in the whole, and again in the enlarged part: {n}");
    assert!(svg.contains("<title>vehicle.car, 3.0 m/s</title>"));
}

#[test]
fn markings_are_drawn_over_surfaces_and_wide_enough_to_be_seen() {
    let line = |kind, width_m| Road { kind, width_m, points: vec![(-50.0, 0.0), (50.0, 0.0)] };
    let roads = vec![line(RoadKind::Surface, 8.0), line(RoadKind::Marking, 0.1)];
    let svg = svg_of(&BevScene { roads, ..scene() });
    let (grid, surface) = (svg.find(FAINT).unwrap(), svg.find(ROAD).unwrap());
    let marking = svg.find(&format!("stroke=\"{PAPER}\" stroke-width=\"2.2\"")).unwrap();
    assert!(grid < surface && surface < marking, "{grid} {surface} {marking}");
}

#[test]
fn the_parts_are_the_whole_the_enlarged_region_and_a_legend_of_the_same_rows() {
    let scene = scene();
    let parts = bev_parts(&scene);
    let captions: Vec<&str> = parts.panels.iter().map(|(caption, _)| caption.as_str()).collect();
    assert_eq!(captions, ["", ENLARGED]);
    for (_, panel) in &parts.panels {
        elements(&panel.svg());
    }
    let sheet = svg_of(&scene);
    assert!(parts.legend.len() > 5 && parts.legend.iter().all(|(_, text)| sheet.contains(text.as_str())));
}
