//! Families of metrics, written as OpenMetrics.

use crate::hub::span_counts::SpanCounts;
use prometheus_client::encoding::{DescriptorEncoder, MetricEncoder, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::Unit;
use std::borrow::Cow;
use std::fmt;

/// Names and values of labels.
pub(super) type Labels<'a> = Vec<(&'static str, Cow<'a, str>)>;

/// One label.
pub(super) fn label<'a>(name: &'static str, value: impl Into<Cow<'a, str>>) -> Labels<'a> {
    vec![(name, value.into())]
}

/// What a family is, without the prefix of all, its unit and the suffix of its type.
pub(super) struct Family {
    pub(super) name: &'static str,
    pub(super) help: &'static str,
    pub(super) unit: Option<Unit>,
}

/// A family without a unit.
pub(super) const fn plain(name: &'static str, help: &'static str) -> Family {
    Family { name, help, unit: None }
}

/// A family in seconds.
pub(super) fn seconds(name: &'static str, help: &'static str) -> Family {
    in_unit(name, "seconds", help)
}

/// A family in another unit.
pub(super) fn in_unit(name: &'static str, unit: &'static str, help: &'static str) -> Family {
    Family { name, help, unit: Some(Unit::Other(unit.to_owned())) }
}

/// Writes families.
pub(super) struct Out<'e>(pub(super) DescriptorEncoder<'e>);

fn begin<'a>(
    out: &'a mut DescriptorEncoder<'_>,
    family: &'a Family,
    kind: MetricType,
) -> Result<MetricEncoder<'a>, fmt::Error> {
    out.encode_descriptor(family.name, family.help, family.unit.as_ref(), kind)
}

impl Out<'_> {
    /// What only grows.
    pub(super) fn counters<'a>(
        &mut self,
        family: &Family,
        rows: impl IntoIterator<Item = (Labels<'a>, u64)>,
    ) -> fmt::Result {
        let mut encoder = begin(&mut self.0, family, MetricType::Counter)?;
        for (labels, value) in rows {
            if labels.is_empty() {
                encoder.encode_counter::<NoLabelSet, _, u64>(&value, None)?;
            } else {
                encoder.encode_family(&labels)?.encode_counter::<NoLabelSet, _, u64>(&value, None)?;
            }
        }
        Ok(())
    }

    /// What goes up and down.
    pub(super) fn gauges<'a>(
        &mut self,
        family: &Family,
        rows: impl IntoIterator<Item = (Labels<'a>, f64)>,
    ) -> fmt::Result {
        let mut encoder = begin(&mut self.0, family, MetricType::Gauge)?;
        for (labels, value) in rows {
            if labels.is_empty() {
                encoder.encode_gauge(&value)?;
            } else {
                encoder.encode_family(&labels)?.encode_gauge(&value)?;
            }
        }
        Ok(())
    }

    /// One counter without labels.
    pub(super) fn counter(&mut self, family: &Family, value: u64) -> fmt::Result {
        self.counters(family, [(Vec::new(), value)])
    }

    /// One gauge without labels.
    pub(super) fn gauge(&mut self, family: &Family, value: f64) -> fmt::Result {
        self.gauges(family, [(Vec::new(), value)])
    }

    /// Seconds that only grow.
    pub(super) fn seconds_total(&mut self, family: &Family, value: f64) -> fmt::Result {
        let mut encoder = begin(&mut self.0, family, MetricType::Counter)?;
        encoder.encode_counter::<NoLabelSet, _, u64>(&value, None)
    }

    /// Spans by how long they were.
    pub(super) fn histogram(&mut self, family: &Family, spans: &SpanCounts) -> fmt::Result {
        let mut encoder = begin(&mut self.0, family, MetricType::Histogram)?;
        let classes: Vec<_> = spans.classes().collect();
        encoder.encode_histogram::<NoLabelSet>(spans.sum_s(), spans.count(), &classes, None)
    }

    /// What is what.
    pub(super) fn info(&mut self, family: &Family, labels: &Labels<'_>) -> fmt::Result {
        begin(&mut self.0, family, MetricType::Info)?.encode_info(labels)
    }
}
