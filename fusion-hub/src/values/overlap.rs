//! How much two boxes overlap: intersection over union, and its generalised form.
//!
//! Most pairs have an axis that separates them (Gottschalk 1996). The rest are intersected by
//! integrating along one box's boundary, clamped to the other one: by Green's theorem, without a polygon.

use serde::{Deserialize, Serialize};
use v2x_common::geometry::BevBox;

/// A box made ready for many comparisons: its trigonometry is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Footprint {
    centre: [f64; 2],
    /// Unit vector of the heading.
    heading: [f64; 2],
    /// Half of depth and width, m.
    half: [f64; 2],
    /// Of the circle around the box, m.
    radius: f64,
}

/// The rotated intersection over union of two boxes, in [0, 1]; 0 where both have no area.
pub fn iou(a: &BevBox, b: &BevBox) -> f64 {
    Footprint::of(a).iou(&Footprint::of(b))
}

/// The generalised intersection over union, in (−1, 1]: IoU − (A_hull − A_union) / A_hull, with the convex
/// hull of both boxes' corners (Rezatofighi 2019). 0 where the hull has no area.
pub fn giou(a: &BevBox, b: &BevBox) -> f64 {
    Footprint::of(a).giou(&Footprint::of(b))
}

impl Footprint {
    /// Of a box.
    pub fn of(bev: &BevBox) -> Self {
        let (sin, cos) = libm::sincos(bev.yaw);
        Self {
            centre: [bev.x, bev.y],
            heading: [cos, sin],
            half: [bev.d / 2.0, bev.w / 2.0],
            radius: bev.circumradius(),
        }
    }

    /// The circle around it: centre and radius, m.
    pub const fn circle(&self) -> ([f64; 2], f64) {
        (self.centre, self.radius)
    }

    /// m².
    pub fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// [`iou`].
    pub fn iou(&self, other: &Self) -> f64 {
        let intersection = self.intersection_area(other);
        if intersection > 0.0 { intersection / (self.area() + other.area() - intersection) } else { 0.0 }
    }

    /// [`giou`].
    pub fn giou(&self, other: &Self) -> f64 {
        let intersection = self.intersection_area(other);
        let union = self.area() + other.area() - intersection;
        // Rounding must not make the hull smaller than what it holds.
        let hull = self.hull_area(other).max(union);
        if hull > 0.0 {
            let iou = if union > 0.0 { intersection / union } else { 0.0 };
            iou - (hull - union) / hull
        } else {
            0.0
        }
    }

    /// The area that both cover, m².
    pub fn intersection_area(&self, other: &Self) -> f64 {
        let (dx, dy) = (other.centre[0] - self.centre[0], other.centre[1] - self.centre[1]);
        let radii = self.radius + other.radius;
        if dx * dx + dy * dy >= radii * radii {
            return 0.0;
        }
        let placed = self.placement_of(other);
        if placed.is_apart(self.half, other.half) {
            return 0.0;
        }
        let corners = placed.corners(other.half);
        let mut area = 0.0;
        for side in 0..4 {
            area += clamped_area(corners[side], corners[(side + 1) % 4], self.half);
        }
        area.clamp(0.0, self.area().min(other.area()))
    }

    /// The other box in the frame of this one.
    fn placement_of(&self, other: &Self) -> Placement {
        let [cos, sin] = self.heading;
        let (dx, dy) = (other.centre[0] - self.centre[0], other.centre[1] - self.centre[1]);
        let [other_cos, other_sin] = other.heading;
        Placement {
            centre: [dx * cos + dy * sin, dy * cos - dx * sin],
            heading: [cos * other_cos + sin * other_sin, cos * other_sin - sin * other_cos],
        }
    }

    /// Of the convex hull of both boxes' corners, m².
    fn hull_area(&self, other: &Self) -> f64 {
        let mut points = [[0.0; 2]; 8];
        points[..4].copy_from_slice(&Placement::ITSELF.corners(self.half));
        points[4..].copy_from_slice(&self.placement_of(other).corners(other.half));
        hull_area(&mut points)
    }
}

/// Where a box is in another one's frame.
#[derive(Clone, Copy, Debug)]
struct Placement {
    centre: [f64; 2],
    heading: [f64; 2],
}

impl Placement {
    const ITSELF: Self = Self { centre: [0.0; 2], heading: [1.0, 0.0] };

    /// Whether an axis of one of the two boxes separates them.
    fn is_apart(&self, half: [f64; 2], other_half: [f64; 2]) -> bool {
        let [x, y] = self.centre;
        let [cos, sin] = self.heading;
        let (c, s) = (cos.abs(), sin.abs());
        x.abs() >= half[0] + c * other_half[0] + s * other_half[1]
            || y.abs() >= half[1] + s * other_half[0] + c * other_half[1]
            || (x * cos + y * sin).abs() >= other_half[0] + c * half[0] + s * half[1]
            || (y * cos - x * sin).abs() >= other_half[1] + s * half[0] + c * half[1]
    }

    /// Counter-clockwise.
    fn corners(&self, half: [f64; 2]) -> [[f64; 2]; 4] {
        let [x, y] = self.centre;
        let [cos, sin] = self.heading;
        let (ahead, left) = ([half[0] * cos, half[0] * sin], [-half[1] * sin, half[1] * cos]);
        [
            [x + ahead[0] + left[0], y + ahead[1] + left[1]],
            [x - ahead[0] + left[0], y - ahead[1] + left[1]],
            [x - ahead[0] - left[0], y - ahead[1] - left[1]],
            [x + ahead[0] - left[0], y + ahead[1] - left[1]],
        ]
    }
}

/// −∫ y dx along the side from `a` to `b`, where |x| ≤ half[0], with y clamped to ±half[1]. Over the sides of a
/// convex polygon, counter-clockwise, these add up to the area that it shares with the box of these halves.
fn clamped_area(a: [f64; 2], b: [f64; 2], half: [f64; 2]) -> f64 {
    let clamp = |value: f64, limit: f64| value.max(-limit).min(limit);
    let (x0, x1) = (clamp(a[0], half[0]), clamp(b[0], half[0]));
    let dx = x1 - x0;
    if dx == 0.0 {
        return 0.0;
    }
    let slope = (b[1] - a[1]) / (b[0] - a[0]);
    // Measured from the nearer end, so that an end within the box keeps its height exactly.
    let (y0, y1) = (a[1] + slope * (x0 - a[0]), b[1] + slope * (x1 - b[0]));
    let (c0, c1) = (clamp(y0, half[1]), clamp(y1, half[1]));
    let dy = y1 - y0;
    if c0 == y0 && c1 == y1 || c0 == c1 {
        return -dx * (c0 + c1) / 2.0;
    }
    // The side crosses an edge of the box: flat before it comes in, sloped, flat after it goes out.
    let before = (c0 - y0) / dy;
    let after = (y1 - c1) / dy;
    let within = (c1 - c0) / dy;
    -dx * (before * c0 + within * (c0 + c1) / 2.0 + after * c1)
}

/// Of the convex hull, by Andrew's monotone chain (1979).
fn hull_area(points: &mut [[f64; 2]; 8]) -> f64 {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let origin = points[0];
    let mut twice = 0.0;
    let mut chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull = [origin; 8];
        let mut length = 0;
        for point in points {
            while length >= 2 && turn(hull[length - 2], hull[length - 1], point) <= 0.0 {
                length -= 1;
            }
            hull[length] = point;
            length += 1;
        }
        for side in hull[..length].windows(2) {
            twice += turn(origin, side[0], side[1]);
        }
    };
    chain(&mut points.iter().copied());
    chain(&mut points.iter().rev().copied());
    twice / 2.0
}

/// Twice the signed area of a triangle; positive where it is counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bev() -> impl Strategy<Value = BevBox> {
        ([-4.0..4.0f64, -4.0..4.0f64], [0.2..3.0f64, 0.2..6.0f64], -3.1..3.1f64)
            .prop_map(|([x, y], [w, d], yaw)| BevBox { x, y, w, d, yaw })
    }

    /// The box after a rigid motion of the plane.
    fn moved(bev: &BevBox, [dx, dy]: [f64; 2], turn: f64) -> BevBox {
        let (sin, cos) = libm::sincos(turn);
        let (x, y) = (bev.x * cos - bev.y * sin + dx, bev.x * sin + bev.y * cos + dy);
        BevBox { x, y, yaw: bev.yaw + turn, ..*bev }
    }

    #[test]
    fn unit_squares_half_a_side_apart_have_an_overlap_of_one_third() {
        let a = BevBox { x: 0.0, y: 0.0, w: 1.0, d: 1.0, yaw: 0.0 };
        let b = BevBox { x: 0.5, ..a };
        assert!((iou(&a, &b) - 1.0 / 3.0).abs() < 1e-15);
        assert!((giou(&a, &b) - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(iou(&a, &BevBox { x: 1.0, ..a }), 0.0, "touching is not overlapping");
        assert!((giou(&a, &BevBox { x: 3.0, ..a }) + 0.5).abs() < 1e-15, "hull 4, union 2");
    }

    #[test]
    fn boxes_without_area_have_no_overlap() {
        let line = BevBox { x: 0.0, y: 0.0, w: 0.0, d: 2.0, yaw: 0.3 };
        assert_eq!(iou(&line, &line), 0.0);
        assert!(giou(&line, &line).abs() < 1e-12);
        let point = BevBox::default();
        assert_eq!((iou(&point, &point), giou(&point, &point)), (0.0, 0.0));
    }

    proptest! {
        #[test]
        fn both_are_symmetric_and_in_range(a in bev(), b in bev()) {
            let (plain, generalised) = (iou(&a, &b), giou(&a, &b));
            prop_assert!((0.0..=1.0).contains(&plain));
            prop_assert!(generalised > -1.0 && generalised <= plain);
            prop_assert!((plain - iou(&b, &a)).abs() < 1e-12);
            prop_assert!((generalised - giou(&b, &a)).abs() < 1e-12);
        }

        #[test]
        fn both_are_invariant_under_a_common_rigid_motion(
            a in bev(), b in bev(), shift in [-100.0..100.0f64, -100.0..100.0f64], turn in -3.1..3.1f64,
        ) {
            let (a1, b1) = (moved(&a, shift, turn), moved(&b, shift, turn));
            prop_assert!((iou(&a, &b) - iou(&a1, &b1)).abs() < 1e-11);
            prop_assert!((giou(&a, &b) - giou(&a1, &b1)).abs() < 1e-11);
        }

        #[test]
        fn the_overlap_of_a_box_with_itself_is_one(a in bev()) {
            prop_assert!((iou(&a, &a) - 1.0).abs() < 1e-14);
            prop_assert!((giou(&a, &a) - 1.0).abs() < 1e-14);
        }

        #[test]
        fn a_contained_box_counts_by_its_area(a in bev(), scale in 0.05..0.7f64, turn in -3.1..3.1f64) {
            // Within the inscribed circle of `a` at any heading.
            let side = scale * a.w.min(a.d);
            let inner = BevBox { w: side, d: side, yaw: turn, ..a };
            prop_assert!((iou(&a, &inner) - side * side / (a.w * a.d)).abs() < 1e-12);
        }
    }
}
