//! The roads of each kind of world.

use super::parameters::WorldConfig;
use super::road::Road;
use super::{crossing, highway};

impl WorldConfig {
    /// All lines on the ground, surfaces first.
    pub fn roads(&self) -> Vec<Road> {
        let mut roads = match self {
            Self::Crossing(_) => crossing::roads(),
            Self::Highway(config) => highway::roads(config),
            Self::Recorded(world) => world.roads.clone(),
        };
        roads.sort_by_key(|road| road.kind);
        roads
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{CrossingConfig, HighwayConfig, RoadKind, World, WorldParameters};
    use v2x_common::time::Span;

    /// Distance of a point from a line, m.
    fn distance_m(road: &Road, (x, y): (f64, f64)) -> f64 {
        let to = |pair: &[(f64, f64)]| {
            let ((ax, ay), (bx, by)) = (pair[0], pair[1]);
            let (dx, dy) = (bx - ax, by - ay);
            let along = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
            libm::hypot(x - ax - along * dx, y - ay - along * dy)
        };
        road.points.windows(2).map(to).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn everything_that_drives_fast_is_on_a_surface() {
        let configs = [
            WorldConfig::Crossing(CrossingConfig::default()),
            WorldConfig::Highway(HighwayConfig::default()),
        ];
        for config in configs {
            let roads = config.roads();
            let surfaces: Vec<_> = roads.iter().filter(|road| road.kind == RoadKind::Surface).collect();
            let parameters =
                WorldParameters { loop_length: Span::from_millis(300_000), config, agents: Vec::new() };
            let (world, mut objects) = (World::new(&parameters, 1).unwrap(), Vec::new());
            let mut n_driving = 0;
            for second in 0..100 {
                world.objects_at(Span::from_millis(1000 * second), &mut objects);
                // Faster than a bicycle.
                for object in
                    objects.iter().filter(|object| libm::hypot(object.velocity.0, object.velocity.1) > 7.0)
                {
                    n_driving += 1;
                    let at = (object.bev.x, object.bev.y);
                    let is_on = surfaces.iter().any(|road| distance_m(road, at) <= road.width_m / 2.0);
                    assert!(is_on, "{at:?} is beside all roads");
                }
            }
            assert!(n_driving > 100, "{n_driving}");
        }
    }
}
