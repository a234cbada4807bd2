//! Clients that a hub refuses, and whether they say why.

use super::network::{Secured, certs, config_of, hub};
use crate::support::{self, Ending};
use std::path::Path;
use v2x_common::net::session;

/// `v2x status` with a configuration at an endpoint.
async fn status(folder: &Path, endpoint: &str, config: Option<&str>) -> anyhow::Result<Ending> {
    let mut args = vec!["status", "--wait", "3", "--connect", endpoint];
    args.extend(config.into_iter().flat_map(|config| ["--zenoh-config", config]));
    support::run(folder, &args).await
}

fn assert_refused(ending: &Ending, said: &str) {
    assert_eq!(ending.code, Some(1), "{ending:?}");
    let last = ending.stderr.lines().last().unwrap_or_default();
    assert!(last.contains(said), "{said:?} is not in the last line: {ending:?}");
}

/// Copies somebody's folder with a change to one of its files.
fn changed(
    folder: &Path,
    who: &str,
    as_who: &str,
    file: &str,
    change: impl Fn(String) -> String,
) -> anyhow::Result<String> {
    let (from, to) = (folder.join("certs").join(who), folder.join("certs").join(as_who));
    std::fs::create_dir_all(&to)?;
    for entry in std::fs::read_dir(&from)? {
        let entry = entry?;
        std::fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    let text = std::fs::read_to_string(to.join(file))?;
    std::fs::write(to.join(file), change(text))?;
    Ok(config_of(as_who))
}

#[tokio::test(flavor = "multi_thread")]
async fn tls_refuses_no_certificate_a_wrong_authority_and_an_expired_one_says_why_and_the_rest_goes_on()
-> anyhow::Result<()> {
    let secured = Secured::start("tls-refused", &[["viewer", "other"]]).await?;
    let Secured { folder, endpoint, .. } = &secured;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;

    let without = |text: String| text.replace("\"enable_mtls\": true", "\"enable_mtls\": false");
    let without = changed(folder, "viewer/screen", "viewer/without", "zenoh.json5", without)?;
    assert_refused(&status(folder, endpoint, Some(&without)).await?, "it asks for a certificate");

    certs(folder, &["init", "theirs"]).await?;
    certs(folder, &["viewer", "screen", "--dir", "theirs"]).await?;
    let theirs = status(folder, endpoint, Some("theirs/viewer/screen/zenoh.json5")).await?;
    assert_refused(&theirs, "an authority that this program does not know");

    let mut mixed = String::new();
    for file in ["certificate.pem", "key.pem"] {
        let of_theirs = std::fs::read_to_string(folder.join("theirs/viewer/screen").join(file))?;
        let from = if mixed.is_empty() { "viewer/screen" } else { "viewer/mixed-1" };
        let to = if mixed.is_empty() { "viewer/mixed-1" } else { "viewer/mixed" };
        mixed = changed(folder, from, to, file, |_| of_theirs.clone())?;
    }
    let mixed = status(folder, endpoint, Some(&mixed)).await?;
    assert_refused(&mixed, "does not know the authority of this program's certificate");

    certs(folder, &["viewer", "old", "--days", "0"]).await?;
    // The certificate's last second may not be over: then it is let in, and out again.
    let mut old = status(folder, endpoint, Some(&config_of("viewer/old"))).await?;
    if old.code != Some(1) {
        old = status(folder, endpoint, Some(&config_of("viewer/old"))).await?;
    }
    assert_refused(&old, "certificate has expired");

    assert_refused(&status(folder, &endpoint.replace("tls/", "tcp/"), None).await?, "it speaks TLS");
    let counted = watch.until("the handshakes are counted by cause", |status| {
        let of = |cause: &str| status.refused_by_zenoh.handshakes.get(cause).copied().unwrap_or(0);
        ["no certificate", "wrong authority", "expired", "refused by the client"]
            .iter()
            .all(|cause| of(cause) > 0)
    });
    counted.await?;
    watch.goes_on("ego").await
}

#[tokio::test(flavor = "multi_thread")]
async fn tls_distinguishes_a_hub_of_another_address_an_impostor_and_one_without_tls() -> anyhow::Result<()> {
    let folder = support::folder("tls-wrong-hub")?;
    certs(&folder, &["init", "--host", "10.255.0.1"]).await?;
    certs(&folder, &["viewer", "screen"]).await?;
    certs(&folder, &["agent", "eve"]).await?;
    let screen = config_of("viewer/screen");
    let (_elsewhere, endpoint) = hub(&folder, "tls", &["--zenoh-config", &config_of("hub/hub")]).await?;
    assert_refused(&status(&folder, &endpoint, Some(&screen)).await?, "--host 127.0.0.1");

    let (_plain, endpoint) = hub(&folder, "tcp", &[]).await?;
    let plain = status(&folder, &endpoint.replace("tcp/", "tls/"), Some(&screen)).await?;
    assert_refused(&plain, "does not answer in TLS");

    // Somebody with an agent's certificate who pretends to be a hub.
    let agent = |file: &str| folder.join("certs/agent/eve").join(file);
    let impostor = serde_json::json!({
        "mode": "router",
        "listen": { "endpoints": ["tls/127.0.0.1:0"] },
        "scouting": { "multicast": { "enabled": false } },
        "transport": { "link": { "tls": {
            "root_ca_certificate": agent("authority.pem"),
            "listen_certificate": agent("certificate.pem"),
            "listen_private_key": agent("key.pem"),
        } } },
    });
    let config =
        zenoh::Config::from_json5(&impostor.to_string()).map_err(|error| anyhow::anyhow!("{error}"))?;
    let impostor = session::open(config).await?;
    let endpoint = session::locators(&impostor).await.remove(0);
    assert_refused(&status(&folder, &endpoint, Some(&screen)).await?, "not one of a hub");
    session::close(impostor).await
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_are_not_replaced_by_a_user_name_and_password_which_are_refused_and_not_logged()
-> anyhow::Result<()> {
    let folder = support::folder("certs-usrpwd")?;
    let config = r#"{ mode: "client", connect: { endpoints: ["tcp/127.0.0.1:1"] },
                      transport: { auth: { usrpwd: { user: "ego", password: "open-sesame-7" } } } }"#;
    std::fs::write(folder.join("user.json5"), config)?;
    for command in [&["status", "--wait", "1"][..], &["hub", "--listen", "tcp/127.0.0.1:0"][..]] {
        let args = [command, &["--zenoh-config", "user.json5", "--log", "trace"]].concat();
        let ending = support::run(&folder, &args).await?;
        assert_refused(&ending, "transport/auth/usrpwd/user is set");
        assert!(!ending.stderr.contains("open-sesame"), "{ending:?}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_whose_private_key_is_in_the_configuration_do_not_reach_the_logs() -> anyhow::Result<()> {
    const SECRET: &str = "LS0tLS1CRUdJTiBQUklWQVRFIEtFWS0tLS0t";
    let folder = support::folder("certs-inline")?;
    let tls = format!(
        r#"{{ enable_mtls: true, connect_private_key_base64: "{SECRET}", connect_certificate_base64: "AAAA" }}"#
    );
    let config = format!(
        r#"{{ mode: "client", connect: {{ endpoints: ["tls/127.0.0.1:1"] }}, transport: {{ link: {{ tls: {tls} }} }} }}"#
    );
    std::fs::write(folder.join("inline.json5"), config)?;
    let args = ["status", "--wait", "1", "--zenoh-config", "inline.json5", "--log", "trace"];
    let ending = support::run(&folder, &args).await?;
    assert!(ending.stderr.contains("Config") && !ending.stderr.contains(SECRET), "{ending:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_whose_private_key_is_in_an_endpoint_do_not_reach_logs_nor_errors() -> anyhow::Result<()> {
    const SECRET: &str = "LS0tLS1CRUdJTiBQUklWQVRFIEtFWS0tLS0t";
    let folder = support::folder("certs-endpoint")?;
    let listen = format!(
        "tls/0.0.0.0:0#enable_mtls=true;listen_private_key_base64={SECRET};listen_certificate_base64=AAAA"
    );
    let ending = support::run(&folder, &["hub", "--listen", &listen, "--log", "trace"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:?}");
    assert!(ending.stderr.contains("listen_private_key_base64=[redacted]"), "{ending:?}");
    let connect = listen.replace("listen_", "connect_").replace("0.0.0.0:0", "127.0.0.1:1");
    let client =
        support::run(&folder, &["status", "--wait", "1", "--connect", &connect, "--log", "trace"]).await?;
    assert!(client.code == Some(1) && client.stderr.contains("Config"), "{client:?}");
    for ending in [ending, client] {
        assert!(!ending.stderr.contains(SECRET) && !ending.stdout.contains(SECRET), "{ending:?}");
    }
    Ok(())
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn certs_whose_private_key_everybody_can_read_are_refused() -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let folder = support::folder("certs-exposed")?;
    certs(&folder, &["init"]).await?;
    let key = folder.join("certs/hub/hub/key.pem");
    std::fs::set_permissions(&key, std::fs::Permissions::from_mode(0o644))?;
    let args = ["hub", "--listen", "tls/127.0.0.1:0", "--zenoh-config", &config_of("hub/hub")];
    assert_refused(&support::run(&folder, &args).await?, "chmod 600");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_without_tls_that_others_reach_says_that_anybody_can_publish() -> anyhow::Result<()> {
    let folder = support::folder("tls-none")?;
    let mut hub = support::V2x::start(&folder, &["hub", "--listen", "tcp/0.0.0.0:0"])?;
    let line = hub.stderr_line("can publish as any agent").await?;
    assert!(line.contains("WARN") && line.contains("v2x certs init"), "{line}");
    Ok(())
}
