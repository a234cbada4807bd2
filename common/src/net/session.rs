//! Opening and closing a Zenoh session.

use super::{endpoint, tls};
use anyhow::{Context, anyhow};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use zenoh::{Config, Session, Wait};

/// The default endpoint of hubs and clients: this machine only.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";

/// How long a connection attempt may take before the next one.
const CONNECT_TIMEOUT_MS: u64 = 2_000;
/// How long a session may take to close.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);
/// Largest message of fragments that a client takes, bytes: any list, or a journal's start; far below Zenoh's 1 GiB.
const MAX_MESSAGE_OF_CLIENT: u64 = 16 << 20;
/// Largest message of fragments that a hub takes, bytes: the largest payload that it reads (4 MiB), and some more, so that what
/// is too large is counted. Zenoh keeps a buffer of this size for each of 16 channels of a session.
pub const MAX_MESSAGE_OF_HUB: u64 = 5 << 20;

/// The network options of a command line.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// A Zenoh configuration file that replaces the defaults.
    pub config: Option<PathBuf>,
    /// Endpoints to connect to, such as `tcp/192.168.1.10:7447`.
    pub connect: Vec<String>,
    /// Endpoints to listen on, such as `tcp/0.0.0.0:7447`.
    pub listen: Vec<String>,
}

/// An option of Zenoh's configuration: its place, and its value as JSON.
pub type ZenohOption = (&'static str, String);

/// The options of a hub: router mode, so that agents need no other router.
pub fn hub_options(listen: &[String]) -> Vec<ZenohOption> {
    let mut options = common_options(MAX_MESSAGE_OF_HUB);
    options.extend([
        ("mode", "\"router\"".to_owned()),
        ("transport/unicast", r#"{ "max_sessions": 1024 }"#.to_owned()),
        // Journals are sent with this priority. Two places of 64 KiB, Zenoh's default, are full as soon as the sending thread has to
        // wait for a processor for a millisecond; places are allocated when they are used.
        ("transport/link/tx/queue/size/data", "16".to_owned()),
        // A router sleeps for it before it is open, also where it scouts for nobody.
        ("scouting/delay", "0".to_owned()),
        listening(listen),
    ]);
    options
}

/// The options of an agent or a consumer: a client of one of the endpoints.
pub fn client_options(connect: &[String]) -> Vec<ZenohOption> {
    let mut options = common_options(MAX_MESSAGE_OF_CLIENT);
    options.extend([("mode", "\"client\"".to_owned()), connecting(connect)]);
    options
}

/// A hub's configuration.
pub fn hub_config(options: &SessionOptions) -> anyhow::Result<Config> {
    [&options.listen, &options.connect].into_iter().for_each(|given| tls::conceal_endpoints(given));
    let mut config = match &options.config {
        Some(path) => from_file(path)?,
        None => with_options(&hub_options(&options.listen))?,
    };
    if options.config.is_some() && !options.listen.is_empty() {
        set(&mut config, &listening(&options.listen))?;
    }
    if !options.connect.is_empty() {
        let connect = endpoints(&options.connect);
        let json = format!(r#"{{ "endpoints": {connect}, "timeout_ms": -1, "retry": {RETRY} }}"#);
        set(&mut config, &("connect", json))?;
    }
    if joins_others(&config) && config.get_json("scouting/delay").is_ok_and(|delay| delay == "0") {
        // Zenoh's own value: time for the link to the other router.
        set(&mut config, &("scouting/delay", "500".to_owned()))?;
    }
    tls::check_endpoints(&config)?;
    name_to_tls(&mut config)?;
    Ok(config)
}

/// Whether a hub of this configuration connects to other routers, so that others may be there before it.
pub fn joins_others(config: &Config) -> bool {
    !endpoint::of_config(config, "connect").is_empty()
}

/// An agent's or a consumer's configuration.
pub fn client_config(options: &SessionOptions) -> anyhow::Result<Config> {
    tls::conceal_endpoints(&options.connect);
    let mut config = match &options.config {
        Some(path) => from_file(path)?,
        None => with_options(&client_options(&options.connect))?,
    };
    if options.config.is_some() && !options.connect.is_empty() {
        set(&mut config, &connecting(&options.connect))?;
    }
    tls::check_endpoints(&config)?;
    name_to_tls(&mut config)?;
    Ok(config)
}

/// Endpoints to connect to as Zenoh's TLS takes them.
fn name_to_tls(config: &mut Config) -> anyhow::Result<()> {
    fn named(value: &mut Value) {
        match value {
            Value::String(endpoint) => *endpoint = endpoint::for_clients(endpoint).into_owned(),
            Value::Array(values) => values.iter_mut().for_each(named),
            Value::Object(modes) => modes.values_mut().for_each(named),
            _ => {}
        }
    }
    let mut endpoints = connect_endpoints(config);
    let before = endpoints.clone();
    named(&mut endpoints);
    if endpoints == before { Ok(()) } else { set(config, &(CONNECT_ENDPOINTS, endpoints.to_string())) }
}

const CONNECT_ENDPOINTS: &str = "connect/endpoints";

/// As Zenoh's configuration has them: a list, or one for each mode.
fn connect_endpoints(config: &Config) -> Value {
    let json = config.get_json(CONNECT_ENDPOINTS).unwrap_or_default();
    serde_json::from_str(&json).unwrap_or_default()
}

const RETRY: &str = r#"{ "period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2 }"#;

fn common_options(max_message: u64) -> Vec<ZenohOption> {
    vec![
        // Multicast is missing in containers, and would connect separate networks on one machine.
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        // Nobody reads the stamps of samples, and a hub that has a clock for them logs each one of a sender whose clock is ahead.
        ("timestamping/enabled", "false".to_owned()),
        ("queries_default_timeout", "2000".to_owned()),
        ("transport/link/tx/lease", "3000".to_owned()),
        ("transport/link/tx/keep_alive", "4".to_owned()),
        ("transport/link/rx/max_message_size", max_message.to_string()),
    ]
}

fn listening(listen: &[String]) -> ZenohOption {
    let listen = endpoints(listen);
    ("listen", format!(r#"{{ "endpoints": {listen}, "exit_on_failure": true }}"#))
}

fn connecting(connect: &[String]) -> ZenohOption {
    let connect = endpoints(connect);
    let json = format!(
        r#"{{ "endpoints": {connect}, "timeout_ms": {CONNECT_TIMEOUT_MS}, "exit_on_failure": true, "retry": {RETRY} }}"#
    );
    ("connect", json)
}

fn with_options(options: &[ZenohOption]) -> anyhow::Result<Config> {
    let mut config = Config::default();
    options.iter().try_for_each(|option| set(&mut config, option))?;
    Ok(config)
}

fn from_file(path: &Path) -> anyhow::Result<Config> {
    let named = || format!("Zenoh configuration {}", path.display());
    let unreadable =
        |error: zenoh::Error| anyhow!("{}: {}", named(), tls::without_values(&error.to_string()));
    let mut config = Config::from_file(path).map_err(unreadable)?;
    tls::check(&mut config, path.parent().unwrap_or(Path::new("."))).with_context(named)?;
    Ok(config)
}

fn endpoints(given: &[String]) -> String {
    if given.is_empty() { format!("[{DEFAULT_ENDPOINT:?}]") } else { format!("{given:?}") }
}

fn set(config: &mut Config, (key, json): &ZenohOption) -> anyhow::Result<()> {
    let quoted =
        |error| anyhow!("{}", tls::without_secrets(&format!("Zenoh option {key} = {json}: {error}")));
    config.insert_json5(key, json).map_err(quoted)
}

/// The endpoints on which a hub of this configuration listens, as they were given: private keys can stand in them
/// ([`endpoint::shown`]).
pub fn listen_endpoints(config: &Config) -> Vec<String> {
    endpoint::of_config(config, "listen")
}

/// How many sessions a hub of this configuration lets in.
pub fn max_sessions(config: &Config) -> usize {
    config
        .get_json("transport/unicast/max_sessions")
        .ok()
        .and_then(|json| json.parse().ok())
        .unwrap_or(usize::MAX)
}

/// Opens a session; one attempt.
pub async fn open(config: Config) -> anyhow::Result<Session> {
    // Zenoh blocks the thread that opens a session until it is connected. A separate thread keeps the caller's
    // deadline, shutdown and the end of the process independent of that.
    let (done, opened) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || done.send(zenoh::open(config).wait()));
    let opened = opened.await.context("opening the Zenoh session panicked")?;
    opened.map_err(|error| anyhow!("{}", without_places(&tls::without_secrets(&error.to_string()))))
}

/// An error of Zenoh without the places in its code (` at /…/tcp.rs:61.`), which help nobody who reads it.
pub fn without_places(error: &str) -> String {
    let opens = |c: char| matches!(c, '[' | '(');
    let closes = |c: char| matches!(c, ']' | ')');
    let mut kept: Vec<String> = Vec::new();
    for word in error.split(' ') {
        let Some((before, after)) = around_place(word) else {
            kept.push(word.to_owned());
            continue;
        };
        let mut before = before.to_owned();
        if kept.last().is_some_and(|last| last.trim_start_matches(opens) == "at") {
            before.insert_str(0, kept.pop().unwrap_or_default().trim_end_matches("at"));
        }
        // What opened and closed around the place alone goes with it; what closes after it still does.
        let mut rest = after.trim_start_matches(|c: char| !closes(c));
        for _ in before.chars().filter(|c| opens(*c)) {
            rest = rest.strip_prefix(closes).unwrap_or(rest);
        }
        match kept.last_mut() {
            Some(last) => last.push_str(rest),
            None => kept.push(rest.to_owned()),
        }
    }
    kept.join(" ")
}

/// What stands before and after a place in code within a word, if that has one.
fn around_place(word: &str) -> Option<(&str, &str)> {
    let end = word.find(".rs:")? + ".rs:".len();
    let digits = word[end..].bytes().take_while(u8::is_ascii_digit).count();
    let begin = word.find(|c: char| !matches!(c, '[' | '('))?;
    (digits > 0).then(|| (&word[..begin], &word[end + digits..]))
}

/// Opens a session in place of one that was closed: where a free port was asked for, on the port that the other one had. The
/// system may need a moment to free it.
pub async fn open_in_place(mut config: Config, locators: &[String]) -> anyhow::Result<Session> {
    const ATTEMPTS: u32 = 20;
    if listen_endpoints(&config).iter().any(|endpoint| endpoint.ends_with(":0")) {
        set(&mut config, &listening(locators))?;
    }
    for _ in 1..ATTEMPTS {
        if let Ok(session) = open(config.clone()).await {
            return Ok(session);
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    open(config).await
}

/// Opens a session, trying again until it is connected, `patience` is over (`None`: no limit) or shutdown is requested
/// (`Ok(None)`). Where somebody listens but does not let us in, the reason is logged and is in the error.
pub async fn open_patiently(
    config: Config,
    patience: Option<Duration>,
    shutdown: &CancellationToken,
) -> anyhow::Result<Option<Session>> {
    let mut attempts = Attempts { config, count: 0, why: None };
    let deadline = async {
        match patience {
            Some(patience) => tokio::time::sleep(patience).await,
            None => std::future::pending().await,
        }
    };
    let opened = tokio::select! {
        session = attempts.until_open() => Some(session),
        () = deadline => None,
        () = shutdown.cancelled() => return Ok(None),
    };
    if opened.is_some() {
        return Ok(opened);
    }
    let no_answer = format!("no hub or router answered in {:.0?}", patience.unwrap_or_default());
    tokio::select! {
        () = attempts.ask_why() => {}
        () = shutdown.cancelled() => return Ok(None),
    }
    Err(anyhow!(attempts.why.map_or_else(|| no_answer.clone(), |why| format!("{no_answer}; {why}"))))
}

/// Attempts to open a session.
struct Attempts {
    config: Config,
    count: u32,
    /// Why an endpoint does not let us in, as far as that is known.
    why: Option<String>,
}

impl Attempts {
    /// After so many attempts that failed the reason is asked for again.
    const ASKED_EVERY: u32 = 8;

    async fn until_open(&mut self) -> Session {
        loop {
            match open(self.config.clone()).await {
                Ok(session) => match tls::why_not_believed(&session, &self.config).await {
                    None => return session,
                    Some(why) => self.leave(session, why).await,
                },
                Err(error) => self.note_failure(&error).await,
            }
            self.begin_with_the_next_endpoint();
            tokio::time::sleep(Duration::from_millis(250)).await;
        }
    }

    /// Zenoh's clients do not go on to a second endpoint before the time for the first one is over, and that of the attempt is
    /// over then.
    fn begin_with_the_next_endpoint(&mut self) {
        let Value::Array(mut endpoints) = connect_endpoints(&self.config) else { return };
        if endpoints.len() > 1 {
            endpoints.rotate_left(1);
            // They were taken in another order.
            let _ = set(&mut self.config, &(CONNECT_ENDPOINTS, Value::from(endpoints).to_string()));
        }
    }

    /// Leaves a hub that is not believed.
    async fn leave(&mut self, session: Session, why: String) {
        if let Err(error) = close(session).await {
            tracing::debug!(%error, "the session with a hub that is not believed");
        }
        if self.why.as_ref() != Some(&why) {
            tracing::warn!("not believed, trying again: {why}");
        }
        self.why = Some(why);
        self.count += 1;
    }

    async fn note_failure(&mut self, error: &anyhow::Error) {
        let known = self.why.take();
        if self.count.is_multiple_of(Self::ASKED_EVERY) {
            self.ask_why().await;
        } else {
            self.why.clone_from(&known);
        }
        match &self.why {
            Some(why) if known.as_ref() != Some(why) => tracing::warn!("not let in, trying again: {why}"),
            None if self.count == 0 => tracing::info!(%error, "no hub or router yet, trying again"),
            _ => tracing::debug!(%error, attempt = self.count, "no hub or router yet"),
        }
        self.count += 1;
    }

    /// It shakes hands itself, with time limits of its own.
    async fn ask_why(&mut self) {
        if self.why.is_none() {
            self.why = tls::why_not_connected(self.config.clone()).await;
        }
    }
}

/// Where a session listens, with the actual port where 0 was requested.
pub async fn locators(session: &Session) -> Vec<String> {
    session.info().locators().await.iter().map(ToString::to_string).collect()
}

/// Closes a session, within a time limit.
pub async fn close(session: Session) -> anyhow::Result<()> {
    tokio::time::timeout(CLOSE_TIMEOUT, session.close())
        .await
        .context("closing the Zenoh session took too long")?
        .map_err(|error| anyhow!("closing the Zenoh session: {}", without_places(&error.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zenoh_accepts_the_default_options() {
        let hub = hub_config(&SessionOptions::default()).unwrap();
        assert!(hub.get_json("listen/endpoints").unwrap().contains(DEFAULT_ENDPOINT));
        assert_eq!(hub.get_json("mode").unwrap(), "\"router\"");
        assert_eq!(hub.get_json("transport/link/tx/lease").unwrap(), "3000");
        let options = SessionOptions { connect: vec!["tcp/127.0.0.1:1".into()], ..Default::default() };
        let client = client_config(&options).unwrap();
        assert!(client.get_json("connect/endpoints").unwrap().contains("tcp/127.0.0.1:1"));
        assert!(client.get_json("connect/retry").unwrap().contains("100"));
        assert_eq!(client.get_json("scouting/multicast/enabled").unwrap(), "false");
    }

    #[test]
    fn an_ipv6_address_is_given_to_zenohs_tls_without_brackets_and_to_tcp_with_them() {
        let connect = ["tls/[::1]:7447", "tcp/[::1]:7447"].map(str::to_owned).to_vec();
        let config = client_config(&SessionOptions { connect, ..Default::default() }).unwrap();
        assert_eq!(connect_endpoints(&config), serde_json::json!(["tls/::1:7447", "tcp/[::1]:7447"]));
    }

    #[test]
    fn each_attempt_begins_with_another_endpoint_so_that_a_standby_is_found() {
        let connect = ["tcp/127.0.0.1:1", "tcp/127.0.0.1:2", "tcp/127.0.0.1:3"].map(str::to_owned).to_vec();
        let config =
            client_config(&SessionOptions { connect: connect.clone(), ..Default::default() }).unwrap();
        let mut attempts = Attempts { config, count: 0, why: None };
        for k in 1..=4 {
            attempts.begin_with_the_next_endpoint();
            let endpoints = endpoint::of_config(&attempts.config, "connect");
            assert_eq!(endpoints[0], connect[k % 3]);
            assert_eq!(endpoints.len(), 3);
        }
    }

    #[test]
    fn errors_of_zenoh_are_reported_without_places_in_its_code() {
        let error = "Can not listen on tcp/127.0.0.1:1: [127.0.0.1:1: Address in use (os error 98) at /x/index-1/commons/src/tcp.rs:61.] at \
                     /x/tcp-1.10.2/src/unicast.rs:338.";
        assert_eq!(
            without_places(error),
            "Can not listen on tcp/127.0.0.1:1: [127.0.0.1:1: Address in use (os error 98)]"
        );
        assert_eq!(without_places("somebody is at home: 12:30"), "somebody is at home: 12:30");
        for (error, expected) in [
            ("cannot open (lost at /x/a.rs:61.), trying", "cannot open (lost), trying"),
            ("lost (at /x/a.rs:61), trying", "lost, trying"),
            ("lost (/x/a.rs:61). Again", "lost. Again"),
            ("lost (/x/a.rs:61:5)", "lost"),
            ("a ([b at /x/a.rs:1.] at /x/c.rs:2.) - Caused by d at /x/e.rs:3.", "a ([b]) - Caused by d"),
        ] {
            assert_eq!(without_places(error), expected, "{error}");
        }
    }

    #[test]
    fn a_missing_configuration_file_is_named() {
        let options = SessionOptions { config: Some("no-such-file.json5".into()), ..Default::default() };
        let message = format!("{:#}", client_config(&options).unwrap_err());
        assert!(message.contains("no-such-file.json5"), "{message}");
    }
}
