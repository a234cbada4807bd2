//! Clients that write Zenoh's protocol by hand, and say what Zenoh's own clients never do.

use crate::support::{TIMEOUT, V2x, folder, run};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// Bytes of a batch.
const BATCH: u16 = 49_152;

/// A session of Zenoh as a client.
struct Client {
    stream: TcpStream,
    sequence: u8,
}

impl Client {
    /// With batches of so many bytes.
    async fn open(locator: &str, batch: u16) -> anyhow::Result<Self> {
        static NEXT: AtomicU8 = AtomicU8::new(1);
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let [low, high] = batch.to_le_bytes();
        let address = locator.strip_prefix("tcp/").context("tcp")?;
        let mut client = Self { stream: TcpStream::connect(address).await?, sequence: 1 };
        // InitSyn: protocol 9, a client, an id of one byte, resolutions of 32 bits, and the size of batches.
        client.send(&[0x41, 9, 0x02, id, 0x0a, low, high]).await?;
        let init_ack = client.receive().await?;
        // Its header, version, id and parameters are followed by a cookie, which is sent back.
        let id_bytes = usize::from(init_ack.get(2).context("no id")? >> 4) + 1;
        let cookie = init_ack.get(3 + id_bytes + 3..).context("no cookie")?;
        let length = 1 + usize::from(*cookie.first().context("no cookie")?);
        ensure!(length <= 128, "a length of one byte");
        let mut open_syn = vec![0x42, 10, client.sequence];
        open_syn.extend(cookie.get(..length).context("half a cookie")?);
        client.send(&open_syn).await?;
        client.receive().await?;
        Ok(client)
    }

    async fn send(&mut self, batch: &[u8]) -> anyhow::Result<()> {
        self.stream.write_all(&u16::try_from(batch.len())?.to_le_bytes()).await?;
        Ok(self.stream.write_all(batch).await?)
    }

    async fn receive(&mut self) -> anyhow::Result<Vec<u8>> {
        let mut length = [0; 2];
        let read = async {
            self.stream.read_exact(&mut length).await?;
            let mut batch = vec![0; usize::from(u16::from_le_bytes(length))];
            self.stream.read_exact(&mut batch).await?;
            Ok::<_, std::io::Error>(batch)
        };
        Ok(tokio::time::timeout(TIMEOUT, read).await.context("no answer")??)
    }

    /// Declares a key expression by this number.
    async fn declare(&mut self, number: u8, key: &str) -> anyhow::Result<()> {
        let mut frame = vec![0x25, self.sequence, 0x1e, 0x20, number, 0, u8::try_from(key.len())?];
        frame.extend(key.as_bytes());
        self.sequence += 1;
        self.send(&frame).await
    }
}

/// Where a hub that has just begun says that it listens.
async fn locator(hub: &mut V2x) -> anyhow::Result<String> {
    let ready: Value = serde_json::from_str(&hub.line().await?)?;
    Ok(ready["locators"][0].as_str().context("no locator")?.to_owned())
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn a_fault_of_zenohs_code_by_keys_that_are_none_makes_a_hub_begin_again_and_all_come_back()
-> anyhow::Result<()> {
    let folder = folder("fault-zenoh")?;
    let network = ["--network", "fault-zenoh"];
    let hub = ["hub", "--events", "--listen", "tcp/127.0.0.1:0"];
    let mut hub = V2x::start(&folder, &[&hub[..], &network].concat())?;
    let process = hub.process_id()?;
    let endpoint = locator(&mut hub).await?;
    let at = [&network[..], &["--connect", &endpoint]].concat();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/crossing.toml");
    let scenario = scenario.to_str().context("a path in UTF-8")?;
    let _ego = V2x::start(&folder, &[&["agent", "--id", "ego", "--scenario", scenario], &at[..]].concat())?;
    let mut watch = V2x::start(&folder, &[&["watch", "--json"], &at[..]].concat())?;
    let lineage = fused(&mut watch, None).await?;

    // Batches too small for any answer make a thread panic, and harm nobody else.
    ensure!(Client::open(&endpoint, 1).await.is_err());
    hub.stderr_line("Zenoh's code has panicked").await?;
    fused(&mut watch, None).await?;

    // Zenoh takes the first one without a word; by the second one, which it compares with it, a lock is poisoned. Newcomers need that.
    let mut hostile = Client::open(&endpoint, BATCH).await?;
    hostile.declare(1, "v2x/$*").await?;
    hostile.declare(2, "v2x/x").await?;
    let newcomers = async {
        loop {
            // The hub may have closed it, or not be there at this moment.
            drop(Client::open(&endpoint, BATCH).await);
            tokio::task::yield_now().await;
        }
    };
    // An operator is to know whom to keep out.
    tokio::select! {
        begins = hub.stderr_line("this hub begins again") => ensure!(begins?.contains("at 127.0.0.1 sends")),
        () = newcomers => {}
    }
    ensure!(locator(&mut hub).await? == endpoint && hub.process_id()? == process);
    fused(&mut watch, Some(&lineage)).await?;
    let new = run(&folder, &[&["status", "--wait", "60"], &at[..]].concat()).await?;
    ensure!(new.code == Some(0) && new.stdout.contains("ego"), "{new:?}");
    let is_told =
        new.stdout.contains("FAULT") && new.stdout.replace("\n      ", "").contains("at 127.0.0.1 sends");
    ensure!(is_told, "the status after it names who: {}", new.stdout);
    let json = run(&folder, &[&["status", "--json"], &at[..]].concat()).await?;
    let status: Value = serde_json::from_str(&json.stdout)?;
    ensure!(
        status["broken_by"][0]["address"] == "127.0.0.1" && status["broken_by"][0]["times"] == 1,
        "{json:?}"
    );
    Ok(())
}

/// Until a list has objects, and is of another lineage than this one; returns its own.
async fn fused(watch: &mut V2x, other: Option<&Value>) -> anyhow::Result<Value> {
    let awaited = async {
        loop {
            let list: Value = serde_json::from_str(&watch.line().await?)?;
            let is_empty = list["objects"].as_array().is_none_or(Vec::is_empty);
            if !is_empty && Some(&list["lineage"]) != other {
                return Ok(list["lineage"].clone());
            }
        }
    };
    tokio::time::timeout(TIMEOUT, awaited).await.context("no such list")?
}
