//! What `v2x certs` writes.

use super::network::certs;
use crate::support;
use std::path::Path;

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn the_files_of_certs_are_private_to_their_owner() -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fn visit(path: &Path, seen: &mut usize) -> anyhow::Result<()> {
        let metadata = std::fs::metadata(path)?;
        let wanted = if metadata.is_dir() { 0o700 } else { 0o600 };
        assert_eq!(metadata.permissions().mode() & 0o777, wanted, "{}", path.display());
        *seen += 1;
        if metadata.is_dir() {
            std::fs::read_dir(path)?.try_for_each(|entry| visit(&entry?.path(), seen))?;
        }
        Ok(())
    }
    let folder = support::folder("certs-private")?;
    certs(&folder, &["init", "--host", "192.168.1.10"]).await?;
    certs(&folder, &["agent", "ego"]).await?;
    let mut seen = 0;
    visit(&folder.join("certs"), &mut seen)?;
    assert!(seen >= 15, "{seen} files and folders");
    Ok(())
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn certs_are_not_made_where_other_users_could_replace_them_nor_by_a_name_that_means_another_folder()
-> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let folder = support::folder("certs-open")?;
    let make_open = |path: &str| {
        std::fs::create_dir_all(folder.join(path))?;
        std::fs::set_permissions(folder.join(path), std::fs::Permissions::from_mode(0o777))
    };
    make_open("certs")?;
    let refused = async |args: &[&str], said: &str| {
        let ending = support::run(&folder, &[&["certs"], args].concat()).await?;
        anyhow::ensure!(ending.code != Some(0) && ending.stderr.contains(said), "{args:?}: {ending:?}");
        Ok(())
    };
    refused(&["init"], "chmod go-w certs").await?;
    assert_eq!(std::fs::read_dir(folder.join("certs"))?.count(), 0, "nothing was written");
    std::fs::remove_dir(folder.join("certs"))?;
    certs(&folder, &["init"]).await?;
    make_open("certs/agent/ego")?;
    refused(&["agent", "ego"], "chmod go-w certs/agent/ego").await?;
    for name in [".", ".."] {
        for what in ["agent", "viewer", "hub"] {
            refused(&[what, name], "is no name").await?;
        }
    }
    assert!(!folder.join("certs/key.pem").exists(), "the folder of the authority is nobody's");
    Ok(())
}

/// Who tries it out in a clone, as the guide says, is not to publish the authority's key by `git add .`.
#[tokio::test(flavor = "multi_thread")]
async fn certs_that_are_made_within_a_repository_are_passed_by_when_all_is_added_to_it() -> anyhow::Result<()>
{
    let folder = support::folder("certs-git")?;
    let git = |args: &[&str]| std::process::Command::new("git").args(args).current_dir(&folder).output();
    anyhow::ensure!(git(&["init", "--quiet"])?.status.success(), "this test needs git");
    certs(&folder, &["init"]).await?;
    certs(&folder, &["agent", "ego"]).await?;
    std::fs::write(folder.join("else.txt"), "")?;
    let status = git(&["status", "--porcelain", "--untracked-files=all"])?;
    assert_eq!(String::from_utf8(status.stdout)?, "?? else.txt\n");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_init_that_was_interrupted_says_what_to_do() -> anyhow::Result<()> {
    let folder = support::folder("certs-interrupted")?;
    certs(&folder, &["init"]).await?;
    std::fs::remove_file(folder.join("certs/register.json"))?;
    let ending = support::run(&folder, &["certs", "init"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:?}");
    assert!(ending.stderr.contains("interrupted") && ending.stderr.contains("backup"), "{ending:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_overwrites_nothing_in_silence() -> anyhow::Result<()> {
    let folder = support::folder("certs-overwrite")?;
    certs(&folder, &["init", "mine"]).await?;
    certs(&folder, &["agent", "ego", "--dir", "mine"]).await?;
    let key = std::fs::read_to_string(folder.join("mine/agent/ego/key.pem"))?;
    for (args, said) in [
        (&["init", "mine"][..], "has an authority"),
        (&["agent", "ego", "--dir", "mine"][..], "--renew"),
        (&["hub", "hub", "--dir", "mine"][..], "--renew"),
        (&["revoke", "nobody", "--dir", "mine"][..], "no agent or viewer has the name nobody"),
        (&["agent", "ego", "--dir", "elsewhere"][..], "v2x certs init"),
    ] {
        let ending = support::run(&folder, &[&["certs"], args].concat()).await?;
        assert_eq!(ending.code, Some(1), "{ending:?}");
        assert!(ending.stderr.contains(said), "{ending:?}");
    }
    assert_eq!(std::fs::read_to_string(folder.join("mine/agent/ego/key.pem"))?, key);
    certs(&folder, &["agent", "ego", "--dir", "mine", "--renew"]).await?;
    assert_ne!(std::fs::read_to_string(folder.join("mine/agent/ego/key.pem"))?, key);
    // What somebody has changed by hand is not lost.
    let config = folder.join("mine/hub/hub/zenoh.json5");
    let edited = std::fs::read_to_string(&config)? + "// mine\n";
    std::fs::write(&config, &edited)?;
    let ending = support::run(&folder, &["certs", "viewer", "screen", "--dir", "mine"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:?}");
    assert!(ending.stderr.contains("changed by hand"), "{ending:?}");
    assert_eq!(std::fs::read_to_string(&config)?, edited);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn renewed_certs_of_a_hub_keep_its_hosts_and_port_and_its_configuration_is_never_empty()
-> anyhow::Result<()> {
    let folder = support::folder("certs-renew")?;
    certs(&folder, &["init", "--host", "10.0.0.1", "--host", "hub.example", "--port", "7448"]).await?;
    let config = folder.join("certs/hub/hub/zenoh.json5");
    let (before, written_at) = (std::fs::read_to_string(&config)?, std::fs::metadata(&config)?.modified()?);
    // Whoever has opened it before reads it whole, whatever becomes of the command: it is replaced, not emptied.
    let opened = std::fs::File::open(&config)?;
    let said = certs(&folder, &["hub", "hub", "--renew"]).await?.stderr;
    assert!(said.contains("10.0.0.1, hub.example, port 7448"), "{said}");
    assert_eq!(std::io::read_to_string(opened)?, before);
    assert_eq!(std::fs::read_to_string(&config)?, before);
    assert_ne!(std::fs::metadata(&config)?.modified()?, written_at, "a running hub learns of it");
    let said = certs(&folder, &["hub", "hub", "--renew", "--host", "10.0.0.2", "--drop", "10.0.0.1"]).await?;
    assert!(said.stderr.contains("dropped: 10.0.0.1"), "{said:?}");
    assert!(said.stderr.contains("at 10.0.0.2, hub.example, port 7448"), "{said:?}");
    let listed = certs(&folder, &["list", "--json"]).await?.stdout;
    let listed: serde_json::Value = serde_json::from_str(&listed)?;
    assert_eq!(listed["hubs"][0]["hosts"], serde_json::json!(["10.0.0.2", "hub.example"]));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_list_says_who_may_take_part_and_until_when() -> anyhow::Result<()> {
    let folder = support::folder("certs-list")?;
    certs(&folder, &["init", "--name", "north", "--days", "30"]).await?;
    certs(&folder, &["agent", "ego"]).await?;
    certs(&folder, &["viewer", "screen", "--days", "0"]).await?;
    certs(&folder, &["revoke", "ego"]).await?;
    let listed = certs(&folder, &["list", "--json"]).await?.stdout;
    let listed: serde_json::Value = serde_json::from_str(&listed)?;
    assert_eq!(listed["hubs"][0]["name"], "north");
    let names: Vec<_> =
        listed["holders"].as_array().into_iter().flatten().map(|one| &one["common_name"]).collect();
    assert_eq!(names, ["agent:ego", "viewer:screen"]);
    let table = certs(&folder, &["list"]).await?.stdout;
    assert!(table.contains("revoked") && table.contains("expired"), "{table}");
    // One that was revoked gets another name with its next certificate.
    certs(&folder, &["agent", "ego"]).await?;
    let listed = certs(&folder, &["list", "--json"]).await?.stdout;
    assert!(listed.contains("\"agent:ego/2\"") && !listed.contains("\"agent:ego\""), "{listed}");
    Ok(())
}
