//! A log of detections, read frame by frame in order of arrival.

mod arrival;
mod holes;
mod lateness;
mod remarks;
mod row;
mod survey;
mod time_units;

pub(crate) use arrival::Arrival;
pub(crate) use lateness::Delay;
pub(crate) use remarks::{Dropped, Remarks};
pub(crate) use survey::{SensorSurvey, Survey};
pub(crate) use time_units::TimeUnits;

use crate::data::csv_table::{CsvError, CsvTable};
use crate::data::detection_columns::COLUMNS;
use lateness::Lateness;
use row::{Content, OPTIONAL_COLUMNS, Optional, Report};
use std::collections::{BTreeMap, VecDeque};
use std::io::Read;
use std::path::Path;
use v2x_common::conventions::OffOrigin;
use v2x_common::detection::{DetectionFrame, MAX_DETECTIONS};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::reported::{OffPlaces, RawHeadings, Reported};
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubSettings;

/// A log has no boot epochs.
const EPOCH: u64 = 1;

/// A log that is read frame by frame. It holds the frames of one time of arrival.
#[derive(Debug)]
pub(crate) struct DetectionLog<R> {
    table: CsvTable<R>,
    optional: Optional,
    /// How sensors write, and what is assumed of them where a cell is empty.
    settings: HubSettings,
    /// The frames of one time of arrival, in order.
    ready: VecDeque<Arrival>,
    /// The first row of the next time of arrival.
    ahead: Option<Report>,
    /// Number of each sensor's next frame.
    sequences: BTreeMap<AgentId, u64>,
    remarks: Remarks,
    /// Where frames arrive later than the log says.
    lateness: Option<Lateness>,
}

impl<R: Read> DetectionLog<R> {
    /// A log in this table, whose sensors write by our own conventions; `path` is for errors.
    #[cfg(test)]
    pub(crate) fn new(table: R, path: &Path) -> Result<Self, CsvError> {
        Self::by(table, path, HubSettings::default())
    }

    /// A log whose sensors write as these settings of a hub say.
    pub(crate) fn by(table: R, path: &Path, settings: HubSettings) -> Result<Self, CsvError> {
        let table = CsvTable::new(table, path, (&COLUMNS, &OPTIONAL_COLUMNS))?;
        Ok(Self {
            optional: Optional::of(&table)?,
            settings,
            table,
            ready: VecDeque::new(),
            ahead: None,
            sequences: BTreeMap::new(),
            remarks: Remarks::default(),
            lateness: None,
        })
    }

    /// The same log, with frames that arrive later by times that are drawn by this seed.
    #[must_use]
    pub(crate) fn later(self, delays: &[Delay], seed: u64) -> Self {
        let lateness = (!delays.is_empty()).then(|| Lateness::new(delays.to_vec(), seed));
        Self { lateness, ..self }
    }

    /// Whether it has the positions of sensors.
    pub(crate) const fn has_poses(&self) -> bool {
        self.optional.poses
    }

    /// Number of bytes read.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.table.n_bytes()
    }

    /// What is counted of the rows so far.
    pub(crate) const fn remarks(&self) -> &Remarks {
        &self.remarks
    }

    /// The settings.
    pub(crate) const fn settings(&self) -> &HubSettings {
        &self.settings
    }

    /// The sensors so far.
    pub(crate) fn sensors(&self) -> impl Iterator<Item = &AgentId> {
        self.sequences.keys()
    }

    /// Number of sensors so far.
    pub(crate) fn n_sensors(&self) -> usize {
        self.sequences.len()
    }

    /// The next frame; `None` at the end.
    pub(crate) fn next_arrival(&mut self) -> Result<Option<Arrival>, CsvError> {
        loop {
            if self.ready.is_empty() {
                self.read_one_time()?;
            }
            let Some(lateness) = &mut self.lateness else { return Ok(self.ready.pop_front()) };
            // A frame of the log may still overtake those on the way.
            let may_overtake =
                |arrival: &mut Arrival| lateness.next_at().is_none_or(|next| arrival.received_at <= next);
            match self.ready.pop_front_if(may_overtake) {
                Some(arrival) => lateness.send(arrival),
                None => return Ok(lateness.receive()),
            }
        }
    }

    /// Reads the frames of the next time of arrival.
    fn read_one_time(&mut self) -> Result<(), CsvError> {
        let first = match self.ahead.take() {
            Some(first) => first,
            None => match self.read(Timestamp::MIN)? {
                Some(first) => first,
                None => return Ok(()),
            },
        };
        let received_at = first.received_at;
        self.sort_in(first);
        while let Some(report) = self.read(received_at)? {
            if report.received_at > received_at {
                self.ahead = Some(report);
                break;
            }
            self.sort_in(report);
        }
        Ok(())
    }

    fn sort_in(&mut self, report: Report) {
        let Report { line, received_at, captured_at, sensor, pose, content, reported, unmapped } = report;
        if let Some(name) = unmapped {
            self.remarks.note_unmapped(sensor, &name);
        }
        let is_its =
            |arrival: &Arrival| arrival.frame.id.agent == sensor && arrival.frame.captured_at == captured_at;
        let place = self.ready.iter().rposition(is_its).unwrap_or_else(|| {
            let next = self.sequences.entry(sensor).or_default();
            let id = FrameId { agent: sensor, epoch: EPOCH, sequence: *next };
            *next += 1;
            let frame = DetectionFrame { sensor_pose: pose, ..DetectionFrame::empty(id, captured_at) };
            let of_frame = Reported {
                headings: RawHeadings::default(),
                in_other_unit: Vec::new(),
                without_sigma: 0,
                off_origin: OffPlaces::default(),
                ..reported.clone()
            };
            self.ready.push_back(Arrival { received_at, frame, reported: of_frame });
            self.ready.len() - 1
        });
        let of_frame = &mut self.ready[place].reported;
        of_frame.headings.merge(&reported.headings);
        of_frame.in_other_unit.extend(reported.in_other_unit);
        of_frame.without_sigma += reported.without_sigma;
        of_frame.off_origin.merge(&reported.off_origin);
        match content {
            Content::Detection(detection) => self.ready[place].frame.detections.push(detection),
            Content::Impossible(invalid) => {
                let off = reported.off_origin.newest.as_ref().map(in_words);
                self.remarks.note_dropped(sensor, line, (&invalid, off));
            }
            Content::Nothing => {}
        }
    }

    /// The next row. It is an error if it arrived before the previous one.
    fn read(&mut self, not_before: Timestamp) -> Result<Option<Report>, CsvError> {
        let Some(row) = self.table.next_row()? else { return Ok(None) };
        let report = Report::of(&row, self.optional, &self.settings)?;
        if report.received_at < not_before {
            return Err(row.wrong("t_arr", "no earlier time than the row's before: rows in order of arrival"));
        }
        let of_frame = |arrival: &&Arrival| {
            arrival.frame.id.agent == report.sensor
                && arrival.frame.captured_at == report.captured_at
                && arrival.received_at == report.received_at
        };
        if let Some(arrival) = self.ready.iter().rev().find(of_frame) {
            if arrival.frame.sensor_pose != report.pose {
                return Err(row.wrong("sensor_x", "with sensor_y the place in the frame's other rows"));
            }
            if arrival.frame.detections.len() >= MAX_DETECTIONS {
                return Err(row.wrong("t", "at most 4096 detections in a frame"));
            }
        }
        Ok(Some(report))
    }
}

/// A position that is no place near the origin, and what to do.
fn in_words(off: &OffOrigin) -> String {
    match (off.is_exchanged, off.latitude_first) {
        (true, false) => format!("{off}. Write `frame = \"wgs84-lat-lon\"`, or the longitude as x"),
        (true, true) => format!("{off}. Write `frame = \"wgs84\"`, or the latitude as x"),
        (false, _) => off.to_string(),
    }
}

#[cfg(test)]
mod tests;
