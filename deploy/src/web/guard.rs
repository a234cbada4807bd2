//! Which requests are answered.
//!
//! A page of another site must not read the view. Browsers keep it from that by the origin, except where the other site's
//! name was made to resolve to this machine (DNS rebinding). So the host must be given as an address or as `localhost`: a
//! name that somebody else controls is neither.

use hyper::HeaderMap;
use hyper::header::{HOST, HeaderValue, ORIGIN};
use std::net::{IpAddr, SocketAddr};

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refused {
    #[error("this page is served under its address or localhost only, not under other names")]
    Host,
    #[error("pages of other sites may not read this one")]
    Origin,
}

/// Checks the headers that a browser does not let a page forge.
pub(super) fn check(headers: &HeaderMap, serves_loopback_only: bool) -> Result<(), Refused> {
    let host = single(headers.get_all(HOST).iter()).ok_or(Refused::Host)?;
    if !is_address_of_this_machine(host, serves_loopback_only) {
        return Err(Refused::Host);
    }
    let mut origins = headers.get_all(ORIGIN).iter();
    let is_own =
        origins.all(|origin| origin.to_str().is_ok_and(|text| text.strip_prefix("http://") == Some(host)));
    if is_own { Ok(()) } else { Err(Refused::Origin) }
}

/// The value of a header that is there exactly once.
fn single<'a>(mut values: impl Iterator<Item = &'a HeaderValue>) -> Option<&'a str> {
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

fn is_address_of_this_machine(host: &str, serves_loopback_only: bool) -> bool {
    let name = host.rsplit_once(':').map_or(host, |(name, _)| name);
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    let bracketed = || host.strip_prefix('[')?.strip_suffix(']')?.parse().ok();
    let with_port = host.parse::<SocketAddr>().ok().map(|address| address.ip());
    let ip: Option<IpAddr> = with_port.or_else(|| host.parse().ok()).or_else(bracketed);
    ip.is_some_and(|ip| ip.is_loopback() || !serves_loopback_only)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(host: &[&str], origin: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for each in host {
            headers.append(HOST, each.parse().unwrap());
        }
        if let Some(origin) = origin {
            headers.insert(ORIGIN, origin.parse().unwrap());
        }
        headers
    }

    #[test]
    fn addresses_of_this_machine_are_served() {
        for host in ["127.0.0.1:8088", "localhost:8088", "LOCALHOST", "127.0.0.1", "[::1]:8088", "[::1]"] {
            assert_eq!(check(&headers(&[host], None), true), Ok(()), "{host}");
        }
        let own = headers(&["127.0.0.1:8088"], Some("http://127.0.0.1:8088"));
        assert_eq!(check(&own, true), Ok(()));
    }

    #[test]
    fn names_of_others_are_refused_though_they_resolve_to_this_machine() {
        for host in
            ["evil.example:8088", "localhost.evil.example", "127.0.0.1.evil.example:8088", "", ":8088"]
        {
            assert_eq!(check(&headers(&[host], None), true), Err(Refused::Host), "{host:?}");
            assert_eq!(check(&headers(&[host], None), false), Err(Refused::Host), "{host:?}");
        }
        assert_eq!(check(&headers(&[], None), true), Err(Refused::Host));
        assert_eq!(check(&headers(&["localhost", "evil.example"], None), true), Err(Refused::Host));
    }

    #[test]
    fn other_addresses_are_served_only_where_the_page_is() {
        let other = headers(&["192.168.1.10:8088"], None);
        assert_eq!((check(&other, true), check(&other, false)), (Err(Refused::Host), Ok(())));
    }

    #[test]
    fn another_origin_is_refused() {
        for origin in ["https://evil.example", "null", "http://127.0.0.1:9999", "https://127.0.0.1:8088"] {
            let refused = check(&headers(&["127.0.0.1:8088"], Some(origin)), true);
            assert_eq!(refused, Err(Refused::Origin), "{origin}");
        }
    }
}
