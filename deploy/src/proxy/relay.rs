//! The bytes of one connection in both directions, each delivered at its time.

use super::pipe::Pipe;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::mpsc;
use v2x_common::clock;
use v2x_common::time::Timestamp;

/// The most bytes that are read at once: more than any frame has.
const CHUNK_BYTES: usize = 16 << 10;
/// Chunks that can be under way; with more, the sender has to wait, as TCP lets it.
const CHUNKS: usize = 4096;

/// A chunk with its delivery time; it is empty at the end of the stream.
type Chunk = (Timestamp, Vec<u8>);

/// Relays until both directions are closed; returns the bytes to the hub and back.
pub(super) async fn relay(agent: TcpStream, hub: TcpStream, pipes: [Pipe; 2]) -> std::io::Result<[u64; 2]> {
    // The link makes the delay, not Nagle's algorithm.
    agent.set_nodelay(true)?;
    hub.set_nodelay(true)?;
    let (from_agent, to_agent) = agent.into_split();
    let (from_hub, to_hub) = hub.into_split();
    let [there, back] = pipes;
    let (there, back) =
        tokio::try_join!(one_way(from_agent, to_hub, there), one_way(from_hub, to_agent, back))?;
    Ok([there, back])
}

async fn one_way(from: OwnedReadHalf, to: OwnedWriteHalf, pipe: Pipe) -> std::io::Result<u64> {
    let (send, receive) = mpsc::channel(CHUNKS);
    let ((), bytes) = tokio::try_join!(read(from, pipe, send), write(to, receive))?;
    Ok(bytes)
}

async fn read(mut from: OwnedReadHalf, mut pipe: Pipe, send: mpsc::Sender<Chunk>) -> std::io::Result<()> {
    let mut buffer = vec![0; CHUNK_BYTES];
    loop {
        let count = from.read(&mut buffer).await?;
        let chunk = (pipe.due(clock::now(), count), buffer[..count].to_vec());
        // The end of the stream is delayed too. Where the writer has stopped, its own error is reported.
        if send.send(chunk).await.is_err() || count == 0 {
            return Ok(());
        }
    }
}

async fn write(mut to: OwnedWriteHalf, mut receive: mpsc::Receiver<Chunk>) -> std::io::Result<u64> {
    let mut bytes = 0;
    while let Some((due, chunk)) = receive.recv().await {
        tokio::time::sleep((due - clock::now()).to_duration()).await;
        if chunk.is_empty() {
            to.shutdown().await?;
        } else {
            to.write_all(&chunk).await?;
            bytes += chunk.len() as u64;
        }
    }
    Ok(bytes)
}
