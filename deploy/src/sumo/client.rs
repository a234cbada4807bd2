//! A client of TraCI.

use super::error::SumoError;
use super::message::{self, Domain, Question, Value, Variable};
use std::io::ErrorKind;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use v2x_common::clock;

/// After this time without an answer, and again after it, the log says what is waited for.
const PATIENCE: Duration = Duration::from_secs(60);
/// A jump in time is made in steps of this length, s, so that each answer comes soon.
const MAX_STEP_S: f64 = 1.0;
/// Time between two words on a jump.
const PROGRESS: Duration = Duration::from_secs(10);
/// Time to connect.
const CONNECT_PATIENCE: Duration = Duration::from_secs(10);
/// Time for SUMO to take leave.
const CLOSE_PATIENCE: Duration = Duration::from_secs(2);
/// Questions in one message.
const AT_ONCE: usize = 1024;

/// A connection to SUMO.
pub(super) struct Client {
    stream: TcpStream,
    /// The longest time for an answer.
    limit: Option<Duration>,
}

impl Client {
    /// Connects once, and asks for the version: the number of the protocol, and SUMO's name. SUMO answers when it has read
    /// its network, and when all its clients are there. Without a limit an answer is waited for until shutdown.
    pub(super) async fn connect(
        address: &str,
        limit: Option<Duration>,
    ) -> Result<(Self, (i32, String)), SumoError> {
        let stream = tokio::time::timeout(CONNECT_PATIENCE, TcpStream::connect(address)).await;
        let stream = stream.unwrap_or_else(|_| Err(ErrorKind::TimedOut.into()));
        let stream = stream.map_err(|cause| SumoError::NoAnswer { address: address.to_owned(), cause })?;
        stream.set_nodelay(true).map_err(SumoError::Connection)?;
        let mut client = Self { stream, limit };
        let version = message::version(&client.exchange(&message::ask_version()).await?)?;
        Ok((client, version))
    }

    /// Steps to this time, s; 0 for one step.
    pub(super) async fn step(&mut self, to_s: f64) -> Result<(), SumoError> {
        message::done(&self.exchange(&message::ask_step(to_s)).await?)
    }

    /// Steps to this time, s, as fast as it can, if that is later.
    pub(super) async fn go_to(&mut self, begin_s: f64) -> Result<(), SumoError> {
        let mut said_at = clock::now();
        loop {
            let time_s = self.number(Variable::Time).await?;
            if time_s >= begin_s {
                return Ok(());
            }
            if (clock::now() - said_at).to_duration() >= PROGRESS {
                said_at = clock::now();
                tracing::info!(time_s, begin_s, "SUMO goes to the world's first time");
            }
            self.step(begin_s.min(time_s + MAX_STEP_S)).await?;
        }
    }

    /// The values of variables, in order.
    pub(super) async fn values(&mut self, questions: &[Question<'_>]) -> Result<Vec<Value>, SumoError> {
        let mut values = Vec::with_capacity(questions.len());
        for questions in questions.chunks(AT_ONCE) {
            let answer = self.exchange(&message::ask(questions)).await?;
            values.extend(message::values(&answer, questions)?);
        }
        Ok(values)
    }

    /// A number of the simulation.
    pub(super) async fn number(&mut self, variable: Variable) -> Result<f64, SumoError> {
        match self.values(&[Question { domain: Domain::Simulation, variable, object: "" }]).await?[..] {
            [Value::Number(number)] => Ok(number),
            _ => Err(SumoError::Message("a number was expected")),
        }
    }

    /// Ends the simulation, if it is still there.
    pub(super) async fn close(mut self) {
        let request = message::ask_close();
        let closed = tokio::time::timeout(CLOSE_PATIENCE, self.exchange(&request)).await;
        tracing::debug!(?closed, "the connection to SUMO is closed");
    }

    /// Sends a message and returns the content of the answer.
    async fn exchange(&mut self, request: &[u8]) -> Result<Vec<u8>, SumoError> {
        let limit = self.limit;
        let exchange = async {
            self.stream.write_all(request).await?;
            let mut head = [0; 4];
            self.stream.read_exact(&mut head).await?;
            Ok(head)
        };
        let head = in_time(limit, exchange).await?;
        let mut content = vec![0; message::content_length(head)?];
        in_time(limit, async { self.stream.read_exact(&mut content).await.map(|_| ()) }).await?;
        Ok(content)
    }
}

/// Waits for an answer up to a limit. It can take long: SUMO reads a large network, or waits for another client.
async fn in_time<T>(
    limit: Option<Duration>,
    exchange: impl Future<Output = std::io::Result<T>>,
) -> Result<T, SumoError> {
    tokio::pin!(exchange);
    let began = clock::now();
    let done = loop {
        if let Ok(done) = tokio::time::timeout(PATIENCE, &mut exchange).await {
            break done;
        }
        let waited = (clock::now() - began).to_duration();
        if let Some(limit) = limit.filter(|limit| waited >= *limit) {
            return Err(SumoError::TooSlow(limit));
        }
        let waited_s = waited.as_secs();
        tracing::warn!(
            "SUMO has not answered for {waited_s} s; still waiting: it reads a large network, waits for all of its clients \
             (--num-clients), or is stopped"
        );
    };
    done.map_err(|cause| match cause.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => SumoError::Closed,
        _ => SumoError::Connection(cause),
    })
}
