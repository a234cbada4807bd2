use std::collections::BTreeMap;
use v2x_agent::{scenario::Scenario, world::World};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::{engine::Engine, settings::HubSettings};
use v2x_lab::virtual_run::VirtualRun;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let scenario = Scenario::load(&path).unwrap();
    let start = Timestamp::from_nanos(1_700_000_000_000_000_000);
    let run = VirtualRun { scenario: &scenario, seed: 1, start, duration: Span::from_millis(20000) };
    let mut engine = Engine::new(HubSettings::from_table(scenario.hub.clone()).unwrap().engine);
    let log = run.run(&mut engine).unwrap();
    let world = World::new(&scenario, 1);
    let mut by: BTreeMap<(String, bool), (u64, f64, f64, f64)> = BTreeMap::new();
    let mut dup: BTreeMap<String, u64> = BTreeMap::new();
    let mut ghosts = 0; let mut n = 0;
    for i in [1000usize, 1001, 1002, 1500] {
        let r = &log.fused[i];
        let mut objs = vec![];
        world.objects_at(r.frame.fused_at - start, &mut objs);
        for t in objs.iter().filter(|t| t.class.is_immobile()) {
            let near: Vec<_> = r.frame.objects.iter().filter(|o| (o.bev.x - t.bev.x).hypot(o.bev.y - t.bev.y) < 1.0).map(|o| format!("{} {} ({:.2},{:.2}) ex {:.3} age {:.1} s{:.2}", o.track, o.class, o.bev.x - t.bev.x, o.bev.y - t.bev.y, o.existence, o.age.as_secs_f64(), o.kinematic_covariance[0].sqrt())).collect();
            if near.len() != 1 { println!("{i} {} {} at {:.2} {:.2}: {near:?}", t.id.0, t.class, t.bev.x, t.bev.y); }
        }
    }
    for (i, r) in log.fused.iter().enumerate() {
        if i < 300 || i % 7 != 0 { continue; }
        let mut objs = vec![];
        world.objects_at(r.frame.fused_at - start, &mut objs);
        let mut used: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for o in &r.frame.objects {
            n += 1;
            let best = objs.iter().map(|t| { let (dx, dy) = (t.bev.x - o.bev.x, t.bev.y - o.bev.y); ((dx*dx+dy*dy).sqrt(), t) }).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            if best.0 > 3.0 { ghosts += 1; continue; }
            used.entry(best.1.id.0).or_default().push(o.existence);
            let t = best.1;
            let speed = (t.velocity.0.powi(2) + t.velocity.1.powi(2)).sqrt();
            let (dx, dy) = (t.bev.x - o.bev.x, t.bev.y - o.bev.y);
            let c = &o.kinematic_covariance;
            let det = c[0]*c[4]-c[1]*c[1];
            let nees = (dx*dx*c[4] - 2.0*dx*dy*c[1] + dy*dy*c[0]) / det / 2.0;
            let e = by.entry((t.class.to_string(), speed > 0.3)).or_default();
            e.0 += 1; e.1 += nees; e.2 += best.0; e.3 += ((c[0]+c[4])/2.0).sqrt();
        }
        for (id, v) in used { if v.len() > 1 { let t = objs.iter().find(|t| t.id.0 == id).unwrap(); *dup.entry(t.class.to_string()).or_default() += v.len() as u64 - 1; } }
    }
    println!("objects {n} ghosts {ghosts} dup {dup:?}");
    for ((c, m), (n, s, d, sg)) in by { println!("{c:40} moving {m:5} n {n:6} nees/2 {:.2} ate {:.3} sigma {:.3}", s / n as f64, d / n as f64, sg / n as f64); }
}
