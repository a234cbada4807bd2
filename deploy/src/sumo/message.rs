//! TraCI's messages: commands of ours, and SUMO's answers (<https://sumo.dlr.de/docs/TraCI/Protocol.html>). Numbers are
//! big-endian.

use super::error::SumoError;

/// Longer messages are refused.
pub(super) const LONGEST: usize = 64 << 20;

const VERSION: u8 = 0x00;
const STEP: u8 = 0x02;
const CLOSE: u8 = 0x7f;
/// From the number of a command that reads a variable to that of its answer.
const ANSWER: u8 = 0x10;

/// Whose variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Domain {
    Vehicle,
    Simulation,
    Person,
}

impl Domain {
    /// The command that reads one of its variables.
    const fn read(self) -> u8 {
        match self {
            Self::Vehicle => 0xa4,
            Self::Simulation => 0xab,
            Self::Person => 0xae,
        }
    }
}

/// A variable, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Variable {
    Ids = 0x00,
    Position = 0x42,
    /// Degrees, clockwise from north.
    Angle = 0x43,
    Length = 0x44,
    VehicleClass = 0x49,
    Width = 0x4d,
    /// s.
    Time = 0x66,
    /// The length of a step, s.
    Step = 0x7b,
    /// Of a person: in which vehicle it is.
    Vehicle = 0xc3,
}

/// A variable of one object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question<'a> {
    pub(super) domain: Domain,
    pub(super) variable: Variable,
    pub(super) object: &'a str,
}

/// The value of a variable.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Place(f64, f64),
    Text(String),
    Texts(Vec<String>),
}

/// Asks for the version.
pub(super) fn ask_version() -> Vec<u8> {
    message([command(VERSION, &[])])
}

/// Steps to this time, s; 0 for one step.
pub(super) fn ask_step(to_s: f64) -> Vec<u8> {
    message([command(STEP, &to_s.to_be_bytes())])
}

/// Ends the simulation.
pub(super) fn ask_close() -> Vec<u8> {
    message([command(CLOSE, &[])])
}

/// Asks for variables.
pub(super) fn ask(questions: &[Question<'_>]) -> Vec<u8> {
    message(questions.iter().map(|question| {
        let mut content = vec![question.variable as u8];
        put_text(&mut content, question.object);
        command(question.domain.read(), &content)
    }))
}

fn put_text(bytes: &mut Vec<u8>, text: &str) {
    let length = u32::try_from(text.len()).unwrap_or(u32::MAX);
    bytes.extend(length.to_be_bytes());
    bytes.extend(text.as_bytes());
}

/// A command with its length, which has five bytes where one is too few.
fn command(number: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = match u8::try_from(content.len() + 2) {
        Ok(length) => vec![length],
        Err(_) => {
            let length = u32::try_from(content.len() + 6).unwrap_or(u32::MAX);
            [&[0], &length.to_be_bytes()[..]].concat()
        }
    };
    bytes.push(number);
    bytes.extend(content);
    bytes
}

fn message(commands: impl IntoIterator<Item = Vec<u8>>) -> Vec<u8> {
    let content: Vec<u8> = commands.into_iter().flatten().collect();
    let length = u32::try_from(content.len() + 4).unwrap_or(u32::MAX);
    [&length.to_be_bytes()[..], &content].concat()
}

/// The length of the content after a message's first four bytes.
pub(super) fn content_length(head: [u8; 4]) -> Result<usize, SumoError> {
    let length = i64::from(i32::from_be_bytes(head));
    let content = usize::try_from(length - 4).ok().filter(|content| *content <= LONGEST);
    content.ok_or(SumoError::Length { length, limit: LONGEST })
}

/// Reads the answer to [`ask_version`]: the number of the protocol, and SUMO's name.
pub(super) fn version(content: &[u8]) -> Result<(i32, String), SumoError> {
    let mut reader = Reader(content);
    reader.status(VERSION)?;
    reader.begin(VERSION)?;
    Ok((reader.int()?, reader.text()?))
}

/// Reads the answer to [`ask_step`].
pub(super) fn done(content: &[u8]) -> Result<(), SumoError> {
    let number = *content.get(1).ok_or(SumoError::Message("it is too short"))?;
    Reader(content).status(number)
}

/// Reads the answer to [`ask`].
pub(super) fn values(content: &[u8], questions: &[Question<'_>]) -> Result<Vec<Value>, SumoError> {
    let mut reader = Reader(content);
    questions.iter().map(|question| reader.value(question)).collect()
}

/// What is left of a message.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], SumoError> {
        let (taken, rest) = self.0.split_at_checked(n).ok_or(SumoError::Message("it is too short"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], SumoError> {
        let bytes = self.take(N)?;
        bytes.try_into().map_err(|_| SumoError::Message("it is too short"))
    }

    fn byte(&mut self) -> Result<u8, SumoError> {
        self.array::<1>().map(|[byte]| byte)
    }

    fn int(&mut self) -> Result<i32, SumoError> {
        self.array().map(i32::from_be_bytes)
    }

    fn double(&mut self) -> Result<f64, SumoError> {
        let value = f64::from_be_bytes(self.array()?);
        if value.is_finite() { Ok(value) } else { Err(SumoError::Message("a number is not finite")) }
    }

    fn text(&mut self) -> Result<String, SumoError> {
        let length = usize::try_from(self.int()?).map_err(|_| SumoError::Message("a text has no length"))?;
        let bytes = self.take(length)?;
        String::from_utf8(bytes.to_vec()).map_err(|_| SumoError::Message("a text is not UTF-8"))
    }

    /// Length and number of a command.
    fn begin(&mut self, number: u8) -> Result<(), SumoError> {
        if self.byte()? == 0 {
            self.int()?;
        }
        if self.byte()? == number { Ok(()) } else { Err(SumoError::Message("it answers another command")) }
    }

    /// Whether a command was done.
    fn status(&mut self, number: u8) -> Result<(), SumoError> {
        self.begin(number)?;
        let result = self.byte()?;
        let why = self.text()?;
        if result == 0 { Ok(()) } else { Err(SumoError::Refused { command: number, why }) }
    }

    fn value(&mut self, question: &Question<'_>) -> Result<Value, SumoError> {
        let Question { domain, variable, object } = question;
        self.status(domain.read())?;
        self.begin(domain.read() + ANSWER)?;
        if self.byte()? != *variable as u8 || self.text()? != *object {
            return Err(SumoError::Message("it answers another question"));
        }
        match self.byte()? {
            0x01 => Ok(Value::Place(self.double()?, self.double()?)),
            // A place with a height.
            0x03 => {
                let (x, y) = (self.double()?, self.double()?);
                self.double()?;
                Ok(Value::Place(x, y))
            }
            0x09 => self.int().map(|value| Value::Number(value.into())),
            0x0b => self.double().map(Value::Number),
            0x0c => self.text().map(Value::Text),
            0x0e => {
                let n = self.int()?;
                (0..n).map(|_| self.text()).collect::<Result<_, _>>().map(Value::Texts)
            }
            _ => Err(SumoError::Message("a value has an unknown type")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Question<'_> = Question { domain: Domain::Simulation, variable: Variable::Time, object: "" };

    /// An answer that SUMO 1.28 gave to the question for its time, 0.2 s.
    const ANSWER: [u8; 23] = [
        7, 0xab, 0, 0, 0, 0, 0, // done
        16, 0xbb, 0x66, 0, 0, 0, 0, 0x0b, 0x3f, 0xc9, 0x99, 0x99, 0x99, 0x99, 0x99, 0x9a,
    ];

    #[test]
    fn questions_are_the_bytes_that_the_protocol_asks_for() {
        assert_eq!(ask(&[TIME]), [0, 0, 0, 11, 7, 0xab, 0x66, 0, 0, 0, 0]);
        assert_eq!(ask_version(), [0, 0, 0, 6, 2, 0]);
        assert_eq!(ask_step(0.0), [0, 0, 0, 14, 10, 2, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(ask_close(), [0, 0, 0, 6, 2, 0x7f]);
        let long = "v".repeat(300);
        let asked = ask(&[Question { domain: Domain::Vehicle, variable: Variable::Position, object: &long }]);
        assert_eq!(asked[4..10], [0, 0, 0, 1, 0x37, 0xa4], "a length of five bytes");
        assert_eq!(asked.len(), 4 + 0x137);
    }

    #[test]
    fn answers_are_read() {
        assert_eq!(values(&ANSWER, &[TIME]).unwrap(), [Value::Number(0.2)]);
        let twice = [ANSWER, ANSWER].concat();
        assert_eq!(values(&twice, &[TIME, TIME]).unwrap().len(), 2);
    }

    #[test]
    fn every_cut_and_every_foreign_answer_is_refused_by_name() {
        for length in 0..ANSWER.len() {
            assert!(values(&ANSWER[..length], &[TIME]).is_err(), "{length} bytes");
        }
        let mut other = ANSWER;
        other[9] = 0x7b;
        assert!(values(&other, &[TIME]).unwrap_err().to_string().contains("another question"));
        let refused = [15, 0xab, 0xff, 0, 0, 0, 8, b'n', b'o', b' ', b's', b'u', b'c', b'h', b' '];
        let message = values(&refused, &[TIME]).unwrap_err().to_string();
        assert!(message.starts_with("SUMO refuses command 0xab: no such"), "{message}");
    }

    #[test]
    fn lengths_that_no_message_has_are_refused() {
        for head in [[0, 0, 0, 3], [0xff, 0, 0, 0], [0x7f, 0xff, 0xff, 0xff]] {
            assert!(matches!(content_length(head), Err(SumoError::Length { .. })), "{head:?}");
        }
        // A list that claims more texts than there are bytes.
        let list = Question { domain: Domain::Vehicle, variable: Variable::Ids, object: "" };
        let many = [7, 0xa4, 0, 0, 0, 0, 0, 12, 0xb4, 0, 0, 0, 0, 0, 0x0e, 0x7f, 0xff, 0xff, 0xff];
        assert!(matches!(values(&many, &[list]), Err(SumoError::Message("it is too short"))));
    }
}
