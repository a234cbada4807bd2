//! A client believes the hubs of its authority, each for itself, by the name in the certificate.

use super::network::{Secured, certs, config_of, hub, keys};
use crate::support::{self, V2x};
use anyhow::{Context, anyhow, ensure};
use std::path::Path;
use std::time::Duration;
use v2x_common::fused::FusedFrame;
use v2x_common::id::HubId;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::wire;

/// A copy of a configuration with another list of hosts than the certificate's holder has.
fn status<'a>(endpoint: &'a str, config: &'a str) -> [&'a str; 7] {
    ["status", "--wait", "3", "--connect", endpoint, "--zenoh-config", config]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_of_the_authority_whose_cert_has_another_name_is_not_believed_and_that_is_said()
-> anyhow::Result<()> {
    let folder = support::folder("certs-believed")?;
    certs(&folder, &["init", "--name", "north"]).await?;
    certs(&folder, &["viewer", "screen"]).await?;
    // Made later: the viewer's configuration knows north alone.
    certs(&folder, &["hub", "south"]).await?;
    let args = ["--id", "south", "--zenoh-config", &config_of("hub/south")];
    let (_south, endpoint) = hub(&folder, "tls", &args).await?;
    let screen = config_of("viewer/screen");
    let ending = support::run(&folder, &status(&endpoint, &screen)).await?;
    ensure!(ending.code == Some(1), "{ending:?}");
    for said in ["\"hub:south\"", "believes hub:north alone", "--renew"] {
        ensure!(ending.stderr.contains(said), "{said}: {ending:?}");
    }
    certs(&folder, &["viewer", "screen", "--renew"]).await?;
    let ending = support::run(&folder, &status(&endpoint, &screen)).await?;
    ensure!(ending.code == Some(0), "{ending:?}");
    Ok(())
}

/// A list in the name of north.
fn forged() -> anyhow::Result<Vec<u8>> {
    let list = FusedFrame {
        hub: HubId::new("north")?,
        lineage: 666,
        sequence: 1,
        fused_at: v2x_common::clock::now(),
        map_frame: None,
        objects: Vec::new(),
        agents: Vec::new(),
        includes: Vec::new(),
    };
    let mut payload = Vec::new();
    wire::fused::encode(&list, &mut payload)?;
    Ok(payload)
}

/// The key of hub south, with its certificate, in the hands of somebody who says what north would say.
#[tokio::test(flavor = "multi_thread")]
async fn a_hub_that_spoofs_another_hub_of_the_authority_by_its_own_cert_is_denied_by_the_clients_acl()
-> anyhow::Result<()> {
    let folder = support::folder("certs-spoofing-hub")?;
    certs(&folder, &["init", "--name", "north"]).await?;
    certs(&folder, &["hub", "south"]).await?;
    certs(&folder, &["viewer", "screen"]).await?;
    let options = SessionOptions {
        config: Some(folder.join(config_of("hub/south"))),
        listen: vec!["tls/127.0.0.1:0".to_owned()],
        ..SessionOptions::default()
    };
    let south = session::open(session::hub_config(&options)?).await?;
    let endpoint = session::locators(&south).await.remove(0);
    let options = SessionOptions {
        config: Some(folder.join(config_of("viewer/screen"))),
        connect: vec![endpoint],
        ..SessionOptions::default()
    };
    let screen = session::open(session::client_config(&options)?).await?;
    let lists = screen.declare_subscriber("v2x/demo/hub/**").await.map_err(|error| anyhow!("{error}"))?;
    let [north, own] = ["north", "south"].map(HubId::new);
    let (north, own) = (north?, own?);
    let queryable = south.declare_queryable(keys().status(&north)).callback(|query| {
        drop(zenoh::Wait::wait(query.reply(query.key_expr().clone(), "{\"hub\": \"north\"}")));
    });
    let _queryable = queryable.await.map_err(|error| anyhow!("{error}"))?;
    // What it may say comes after, on the same link: what was to come before has come, or never will.
    let mut arrived = Vec::new();
    let until_own = async {
        loop {
            for key in [keys().fused(&north), keys().delta(&north), keys().fused(&own)] {
                south.put(key, forged()?).await.map_err(|error| anyhow!("{error}"))?;
            }
            while let Ok(Ok(sample)) =
                tokio::time::timeout(Duration::from_millis(50), lists.recv_async()).await
            {
                arrived.push(sample.key_expr().to_string());
            }
            if arrived.iter().filter(|key| **key == keys().fused(&own)).count() >= 5 {
                return Ok::<_, anyhow::Error>(());
            }
        }
    };
    tokio::time::timeout(support::TIMEOUT, until_own).await.context("its own lists do not come")??;
    ensure!(arrived.iter().all(|key| *key == keys().fused(&own)), "{arrived:?}");
    let replies = screen.get(keys().status(&north)).await.map_err(|error| anyhow!("{error}"))?;
    let answer = replies.recv_async().await.ok().and_then(|reply| reply.into_result().ok());
    ensure!(answer.is_none(), "{answer:?}");
    session::close(screen).await?;
    session::close(south).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_with_certs_finds_the_hub_that_is_there_among_several_addresses() -> anyhow::Result<()> {
    let folder = support::folder("certs-addresses")?;
    let port = support::free_port()?.to_string();
    // Nobody listens at the first address: the machine of the other hub is off.
    certs(&folder, &["init", "--host", "127.0.0.2", "--host", "127.0.0.1", "--port", &port]).await?;
    certs(&folder, &["viewer", "screen"]).await?;
    certs(&folder, &["viewer", "second", "--connect", "127.0.0.1", "--connect", "127.0.0.2"]).await?;
    let listen = format!("tls/127.0.0.1:{port}");
    let args = ["hub", "--events", "--listen", &listen, "--zenoh-config", &config_of("hub/hub")];
    let mut hub = V2x::start(&folder, &args)?;
    ensure!(hub.line().await?.contains("ready"));
    for who in ["screen", "second"] {
        let config = config_of(&format!("viewer/{who}"));
        let ending = support::run(&folder, &["status", "--wait", "20", "--zenoh-config", &config]).await?;
        ensure!(ending.code == Some(0), "{who}: {ending:?}");
    }
    let refused = support::run(&folder, &["certs", "viewer", "third", "--connect", "10.9.8.7"]).await?;
    ensure!(refused.code == Some(1) && refused.stderr.contains("127.0.0.2, 127.0.0.1"), "{refused:?}");
    Ok(())
}

/// Whether this machine has IPv6.
fn has_ipv6() -> bool {
    std::net::TcpListener::bind("[::1]:0").is_ok()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_with_certs_for_an_ipv6_address_is_reached_there_by_tls() -> anyhow::Result<()> {
    if !has_ipv6() {
        return Ok(());
    }
    let folder = support::folder("certs-ipv6")?;
    let port = support::free_port()?.to_string();
    certs(&folder, &["init", "--host", "::1", "--port", &port]).await?;
    certs(&folder, &["agent", "ego", "--truth"]).await?;
    certs(&folder, &["viewer", "screen"]).await?;
    let args = ["hub", "--events", "--metrics", "[::1]:0", "--zenoh-config", &config_of("hub/hub")];
    let mut hub = V2x::start(&folder, &args)?;
    let ready: serde_json::Value = serde_json::from_str(&hub.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no locator")?.to_owned();
    ensure!(endpoint == format!("tls/[::1]:{port}"), "{endpoint}");
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/crossing.toml");
    let scenario = scenario.to_str().context("a path in UTF-8")?;
    let config = config_of("agent/ego");
    let args = ["agent", "--scenario", scenario, "--id", "ego", "--zenoh-config", &config];
    let _ego = V2x::start(&folder, &args)?;
    let screen = config_of("viewer/screen");
    // By its configuration, and by the endpoint as the hub prints it.
    for connect in [&[][..], &["--connect", &endpoint]] {
        let watch = ["watch", "--json", "--count", "3", "--zenoh-config", &screen];
        let ending = support::run(&folder, &[&watch[..], connect].concat()).await?;
        ensure!(ending.code == Some(0) && ending.stdout.lines().count() == 3, "{ending:?}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_secured_hub_that_is_asked_by_plain_tcp_says_tls_and_the_rest_goes_on() -> anyhow::Result<()> {
    let secured = Secured::start("certs-tcp", &[]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let plain = secured.endpoint.replace("tls/", "tcp/");
    let screen = config_of("viewer/screen");
    let ending = support::run(&secured.folder, &status(&plain, &screen)).await?;
    ensure!(ending.code == Some(1) && ending.stderr.contains("tls/"), "{ending:?}");
    watch.goes_on("ego").await
}
