//! Records of NumPy structured arrays as bytes: words of eight bytes in the machine's order, as `np.dtype(…, align=True)` lays
//! them out. `python/v2x/arrays.py` declares the same fields.

use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::fused::{FusedObject, KINEMATIC_INDEX};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::time::Span;
use v2x_common::wire::json::{PartialDetection, PartialSigma};
use v2x_lab::protocol::OutputBox;

/// One word.
type Word = [u8; 8];

/// Words of a detection.
const DETECTION: usize = 19;
/// Words of a box.
const BOX: usize = 15;
/// Words of a keyframe.
const KEYFRAME: usize = 4;
/// Words of a true box.
const TRUTH: usize = 8;
/// Bits of a detection's place in its report, in a `det_id`.
const INDEX_BITS: u32 = 32;
/// The heading byte that leaves open what is known: known where there is a heading.
const BY_YAW: u8 = 0;

/// A value that no record can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum RecordError {
    /// A number out of its range.
    #[error("{field} is {value}, expected {expected}")]
    Number { field: &'static str, value: f64, expected: &'static str },
    /// A code that stands for nothing.
    #[error("{field} is {code}, expected {expected}")]
    Code { field: &'static str, code: i64, expected: &'static str },
}

/// Bytes that are no such array.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum ArrayError {
    /// A part of a record is missing.
    #[error("{bytes} bytes are no whole records of {record} bytes")]
    Length { bytes: usize, record: usize },
    /// One record has a wrong value.
    #[error("{what} {index}: {error}")]
    Record { what: &'static str, index: usize, error: RecordError },
}

/// Classes by their codes.
const CLASS_CODES: &str = const {
    assert!(Class::ALL.len() == 24);
    "0 to 23"
};

/// The records of an array of so many words each.
fn words<const N: usize>(bytes: &[u8]) -> Result<&[[Word; N]], ArrayError> {
    let (words, rest) = bytes.as_chunks::<8>();
    let (records, more) = words.as_chunks::<N>();
    if rest.is_empty() && more.is_empty() {
        return Ok(records);
    }
    Err(ArrayError::Length { bytes: bytes.len(), record: 8 * N })
}

/// What the records of an array are, which are called `what` in errors.
fn read<const N: usize, T>(
    bytes: &[u8],
    what: &'static str,
    read: impl Fn(&[Word; N]) -> Result<T, RecordError>,
) -> Result<Vec<T>, ArrayError> {
    let one = |(index, record)| read(record).map_err(|error| ArrayError::Record { what, index, error });
    words::<N>(bytes)?.iter().enumerate().map(one).collect()
}

fn float(word: Word) -> f64 {
    f64::from_ne_bytes(word)
}

/// A number; `None` for NaN, which stands for what is not given.
fn given(word: Word) -> Option<f64> {
    Some(float(word)).filter(|value| !value.is_nan())
}

pub(crate) fn integer(word: Word) -> i64 {
    i64::from_ne_bytes(word)
}

fn class(byte: u8) -> Result<Class, RecordError> {
    let unknown = RecordError::Code { field: "class", code: byte.into(), expected: CLASS_CODES };
    Class::ALL.get(usize::from(byte)).copied().ok_or(unknown)
}

/// The box in words `x, y, yaw, w, d`.
fn bev(words: &[Word; 5]) -> BevBox {
    let [x, y, yaw, w, d] = words.map(float);
    BevBox { x, y, w, d, yaw }
}

/// Detections of `v2x.DETECTION`.
pub(crate) fn detections(bytes: &[u8]) -> Result<Vec<PartialDetection>, ArrayError> {
    read(bytes, "detection", detection)
}

fn detection(record: &[Word; DETECTION]) -> Result<PartialDetection, RecordError> {
    let [[code, heading, ..], x, y, yaw, w, d, score, sx, sy, rho, sw, sd, syaw, velocity @ .., track] =
        record;
    let wrong = |field, code, expected| RecordError::Code { field, code, expected };
    let heading = match heading.checked_sub(1).map(|kind| HeadingKind::from_byte(kind.into())) {
        None => None,
        Some(Some(kind)) => Some(kind),
        Some(None) => return Err(wrong("heading", i64::from(*heading), "0 (by yaw), 1, 2 or 3")),
    };
    let source_track = match integer(*track) {
        -1 => None,
        code => Some(u64::try_from(code).map_err(|_| wrong("source_track", code, "-1 or more"))?),
    };
    Ok(PartialDetection {
        class: class(*code)?,
        x: float(*x),
        y: float(*y),
        w: given(*w),
        d: given(*d),
        yaw: given(*yaw),
        score: given(*score),
        heading,
        sigma: PartialSigma {
            x: given(*sx),
            y: given(*sy),
            rho: given(*rho).unwrap_or(0.0),
            w: given(*sw),
            d: given(*sd),
            yaw: given(*syaw),
        },
        velocity: velocity_of(velocity)?,
        source_track,
    })
}

/// The measured velocity; its standard deviations are required.
fn velocity_of(words: &[Word; 5]) -> Result<Option<Velocity>, RecordError> {
    let [x, y, sigma_x, sigma_y, rho] = words.map(float);
    if x.is_nan() && y.is_nan() {
        return Ok(None);
    }
    for (field, value) in [("vx", x), ("vy", y), ("sigma_vx", sigma_x), ("sigma_vy", sigma_y)] {
        if value.is_nan() {
            let expected = "a number: a velocity needs vx, vy, sigma_vx and sigma_vy";
            return Err(RecordError::Number { field, value, expected });
        }
    }
    let rho = if rho.is_nan() { 0.0 } else { rho };
    let xx = sigma_x * sigma_x.abs();
    let yy = sigma_y * sigma_y.abs();
    Ok(Some(Velocity { x, y, covariance: Covariance2 { xx, xy: rho * sigma_x * sigma_y, yy } }))
}

/// Bytes of records.
#[derive(Default)]
pub(crate) struct Records(pub(crate) Vec<u8>);

impl Records {
    pub(crate) fn with_capacity(n_records: usize, bytes: usize) -> Self {
        Self(Vec::with_capacity(n_records * bytes))
    }

    pub(crate) fn float(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_ne_bytes());
    }

    pub(crate) fn integer(&mut self, value: i64) {
        self.0.extend_from_slice(&value.to_ne_bytes());
    }

    pub(crate) fn class(&mut self, class: Class, heading: u8) {
        self.0.extend_from_slice(&[class as u8, heading, 0, 0, 0, 0, 0, 0]);
    }

    pub(crate) fn bev(&mut self, BevBox { x, y, w, d, yaw }: &BevBox) {
        for value in [x, y, yaw, w, d] {
            self.float(*value);
        }
    }

    fn covariance(&mut self, covariance: &BoxCovariance) {
        let BoxCovariance { position, ww, dd, yaw } = covariance;
        self.deviations(position);
        [ww, dd, yaw].into_iter().for_each(|variance| self.float(variance.sqrt()));
    }

    fn deviations(&mut self, Covariance2 { xx, xy, yy }: &Covariance2) {
        let (sigma_x, sigma_y) = (xx.sqrt(), yy.sqrt());
        let product = sigma_x * sigma_y;
        [sigma_x, sigma_y, if product > 0.0 { xy / product } else { 0.0 }]
            .into_iter()
            .for_each(|value| self.float(value));
    }

    /// Adds a record of `v2x.DETECTION`.
    pub(crate) fn detection(&mut self, detection: &Detection) {
        self.class(detection.class, BY_YAW + 1 + detection.heading as u8);
        self.bev(&detection.bev);
        self.float(detection.score);
        self.covariance(&detection.covariance);
        match &detection.velocity {
            Some(Velocity { x, y, covariance }) => {
                self.float(*x);
                self.float(*y);
                self.deviations(covariance);
            }
            None => (0..5).for_each(|_| self.float(f64::NAN)),
        }
        self.integer(detection.source_track.map_or(-1, |track| i64::try_from(track).unwrap_or(-1)));
    }

    /// Adds a record of `v2x.OBJECT`.
    pub(crate) fn object(&mut self, object: &FusedObject) {
        self.0.extend_from_slice(&object.track.0.to_ne_bytes());
        self.class(object.class, BY_YAW + 1 + object.heading as u8);
        self.bev(&object.bev);
        self.float(object.velocity.0);
        self.float(object.velocity.1);
        let mut covariance = [[0.0; 4]; 4];
        for (value, (row, column)) in object.kinematic_covariance.into_iter().zip(KINEMATIC_INDEX) {
            covariance[row][column] = value;
            covariance[column][row] = value;
        }
        covariance.as_flattened().iter().for_each(|value| self.float(*value));
        let variances = [object.ww, object.dd, object.yaw_variance];
        variances.into_iter().for_each(|variance| self.float(variance.sqrt()));
        self.float(object.existence);
        let of_class = object.class_probabilities.iter().find(|(class, _)| *class == object.class);
        self.float(of_class.map_or(1.0, |(_, probability)| *probability));
        self.float(object.class_conflict);
        self.integer(object.age.as_nanos());
        self.integer(object.last_measured_at.as_nanos());
    }
}

/// Boxes of `v2x.lab.BOX`.
pub(crate) fn boxes(bytes: &[u8]) -> Result<Vec<OutputBox>, ArrayError> {
    read(bytes, "box", output_box)
}

fn output_box(record: &[Word; BOX]) -> Result<OutputBox, RecordError> {
    let [[code, ..], x, y, yaw, w, d, existence, sx, sy, rho, sw, sd, syaw, first, second] = record;
    let bev = bev(&[*x, *y, *yaw, *w, *d]);
    let existence = given(*existence).unwrap_or(1.0);
    let is_size = |size: f64| size > 0.0 && size.is_finite();
    let checks = [
        ("x", bev.x, bev.x.is_finite(), "a number"),
        ("y", bev.y, bev.y.is_finite(), "a number"),
        ("yaw", bev.yaw, bev.yaw.is_finite(), "a number"),
        ("w", bev.w, is_size(bev.w), "more than 0 m"),
        ("d", bev.d, is_size(bev.d), "more than 0 m"),
        ("existence", existence, (0.0..=1.0).contains(&existence), "0 to 1"),
    ];
    if let Some((field, value, _, expected)) = checks.into_iter().find(|(_, _, is_valid, _)| !is_valid) {
        return Err(RecordError::Number { field, value, expected });
    }
    Ok(OutputBox {
        bev: BevBox { yaw: wrap_angle(bev.yaw), ..bev },
        class: class(*code)?,
        existence,
        covariance: claimed([*sx, *sy, *rho, *sw, *sd, *syaw]),
        detections: [detection_id(*first)?, detection_id(*second)?],
    })
}

/// The covariance that a method states; `None` where a standard deviation is missing.
fn claimed(words: [Word; 6]) -> Option<BoxCovariance> {
    let [sx, sy, rho, sw, sd, syaw] = words.map(given);
    let (sx, sy, sw, sd, syaw) = (sx?, sy?, sw?, sd?, syaw?);
    let position = Covariance2 { xx: sx * sx, xy: rho.unwrap_or(0.0) * sx * sy, yy: sy * sy };
    Some(BoxCovariance { position, ww: sw * sw, dd: sd * sd, yaw: syaw * syaw })
}

/// Keyframe and place in the report; -1 names none.
fn detection_id(word: Word) -> Result<Option<(usize, usize)>, RecordError> {
    let code = integer(word);
    if code == -1 {
        return Ok(None);
    }
    let parts = u64::try_from(code).ok().and_then(|id| {
        Some((usize::try_from(id >> INDEX_BITS).ok()?, usize::try_from(id & u64::from(u32::MAX)).ok()?))
    });
    parts.map(Some).ok_or(RecordError::Code {
        field: "det_ids",
        code,
        expected: "the det_id of a detection, or -1",
    })
}

/// The `det_id` of a detection.
pub(crate) fn det_id(frame: usize, index: usize) -> i64 {
    let id = (frame as u64) << INDEX_BITS | index as u64;
    i64::try_from(id).unwrap_or(-1)
}

/// Keyframes of `v2x.lab.KEYFRAME`: when each is since the scene's start, and where agent 1 is.
pub(crate) fn keyframes(bytes: &[u8]) -> Result<Vec<(Span, Pose)>, ArrayError> {
    read(bytes, "keyframe", |[at, x, y, yaw]: &[Word; KEYFRAME]| {
        Ok((Span::from_nanos(integer(*at)), Pose { x: float(*x), y: float(*y), yaw: float(*yaw) }))
    })
}

/// True boxes of `v2x.lab.TRUTH`: keyframe, object, class, box.
pub(crate) fn truth(bytes: &[u8]) -> Result<Vec<(i64, i64, Class, BevBox)>, ArrayError> {
    read(bytes, "true box", |[frame, id, [code, ..], x, y, yaw, w, d]: &[Word; TRUTH]| {
        Ok((integer(*frame), integer(*id), class(*code)?, bev(&[*x, *y, *yaw, *w, *d])))
    })
}
