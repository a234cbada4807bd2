//! The list of objects of one fused frame.

use crate::values::ContributorLimit;
use v2x_common::class::Class;
use v2x_common::detection::HeadingKind;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// The objects of the next fused frame. Memory of earlier lists is used again.
#[derive(Debug)]
pub struct ObjectList<'a> {
    objects: &'a mut Vec<FusedObject>,
    spare: &'a mut Vec<FusedObject>,
    len: usize,
    contributor_limit: ContributorLimit,
}

impl<'a> ObjectList<'a> {
    /// An empty list in place of an earlier one; `spare` holds objects for which shorter lists had no use.
    pub fn new(objects: &'a mut Vec<FusedObject>, spare: &'a mut Vec<FusedObject>) -> Self {
        Self { objects, spare, len: 0, contributor_limit: ContributorLimit::All }
    }

    /// The same, whose objects name so many contributors.
    #[must_use]
    pub const fn naming(mut self, limit: ContributorLimit) -> Self {
        self.contributor_limit = limit;
        self
    }

    /// How many contributors an object of it names; who adds objects keeps to it.
    pub const fn contributor_limit(&self) -> ContributorLimit {
        self.contributor_limit
    }

    /// Adds an object.
    pub fn push(&mut self, object: FusedObject) {
        self.push_with(|next| {
            *next = object;
            true
        });
    }

    /// Adds an object that is filled in place, unless `fill` says `false`. What it holds before is of an earlier list.
    pub fn push_with(&mut self, fill: impl FnOnce(&mut FusedObject) -> bool) {
        if self.objects.len() == self.len {
            self.objects.push(self.spare.pop().unwrap_or_else(blank));
        }
        self.len += usize::from(fill(&mut self.objects[self.len]));
    }

    /// How many there are.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }
}

impl Drop for ObjectList<'_> {
    fn drop(&mut self) {
        self.spare.extend(self.objects.drain(self.len..));
    }
}

/// An empty object, to be filled in.
fn blank() -> FusedObject {
    FusedObject {
        track: TrackId::default(),
        class: Class::Unknown,
        class_probabilities: Vec::new(),
        class_conflict: 0.0,
        bev: BevBox::default(),
        velocity: (0.0, 0.0),
        kinematic_covariance: [0.0; 10],
        ww: 0.0,
        dd: 0.0,
        yaw_variance: 0.0,
        heading: HeadingKind::Known,
        existence: 0.0,
        age: Span::ZERO,
        last_measured_at: Timestamp::EPOCH,
        contributors: Vec::new(),
    }
}
