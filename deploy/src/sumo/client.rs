//! A client of TraCI.

use super::error::SumoError;
use super::message::{self, Domain, Question, Value, Variable};
use std::io::ErrorKind;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// A step of a large network can take long.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time to connect.
const CONNECT_PATIENCE: Duration = Duration::from_secs(10);
/// Time for SUMO to take leave.
const CLOSE_PATIENCE: Duration = Duration::from_secs(2);
/// Questions in one message.
const AT_ONCE: usize = 1024;

/// A connection to SUMO.
pub(super) struct Client {
    stream: TcpStream,
}

impl Client {
    /// Connects once, and asks for the version: the number of the protocol, and SUMO's name.
    pub(super) async fn connect(address: &str) -> Result<(Self, (i32, String)), SumoError> {
        let stream = tokio::time::timeout(CONNECT_PATIENCE, TcpStream::connect(address)).await;
        let stream = stream.unwrap_or_else(|_| Err(ErrorKind::TimedOut.into()));
        let stream = stream.map_err(|cause| SumoError::NoAnswer { address: address.to_owned(), cause })?;
        stream.set_nodelay(true).map_err(SumoError::Connection)?;
        let mut client = Self { stream };
        let version = message::version(&client.exchange(&message::ask_version()).await?)?;
        Ok((client, version))
    }

    /// Steps to this time, s; 0 for one step.
    pub(super) async fn step(&mut self, to_s: f64) -> Result<(), SumoError> {
        message::done(&self.exchange(&message::ask_step(to_s)).await?)
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
        let exchange = async {
            self.stream.write_all(request).await?;
            let mut head = [0; 4];
            self.stream.read_exact(&mut head).await?;
            Ok(head)
        };
        let head = in_time(exchange).await?;
        let mut content = vec![0; message::content_length(head)?];
        in_time(async { self.stream.read_exact(&mut content).await.map(|_| ()) }).await?;
        Ok(content)
    }
}

async fn in_time<T>(exchange: impl Future<Output = std::io::Result<T>>) -> Result<T, SumoError> {
    let done = tokio::time::timeout(PATIENCE, exchange).await;
    done.map_err(|_| SumoError::TooSlow(PATIENCE))?.map_err(|cause| match cause.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => SumoError::Closed,
        _ => SumoError::Connection(cause),
    })
}
