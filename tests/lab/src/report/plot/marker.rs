//! The marks of points.

use crate::report::plot::sheet::{Paint, Sheet};

/// A mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Marker {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A triangle, pointing up.
    Triangle,
    /// A square that stands on a corner.
    Diamond,
    /// A triangle, pointing down.
    Nabla,
}

impl Marker {
    /// All marks, in the order in which they are given to curves.
    pub(crate) const ALL: [Self; 5] = [Self::Disc, Self::Square, Self::Triangle, Self::Diamond, Self::Nabla];

    /// Draws it around a point; the radius is that of the disc.
    pub(crate) fn draw(self, sheet: &mut Sheet, ((x, y), radius): ((f64, f64), f64), paint: Paint) {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
        let (corners, first, scale) = match self {
            Self::Disc => (16, 0.0, 1.0),
            Self::Square => (4, FRAC_PI_4, 1.25),
            Self::Triangle => (3, -FRAC_PI_2, 1.4),
            Self::Diamond => (4, 0.0, 1.4),
            Self::Nabla => (3, FRAC_PI_2, 1.4),
        };
        let corner = |place: u32| {
            let angle = first + std::f64::consts::TAU * f64::from(place) / f64::from(corners);
            let (sin, cos) = libm::sincos(angle);
            (x + scale * radius * cos, y + scale * radius * sin)
        };
        sheet.path(&(0..corners).map(corner).collect::<Vec<_>>(), true, paint);
    }
}
