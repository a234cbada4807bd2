//! Which build this is.

/// The version of all programs of the project.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit that was built: 12 hexadecimal digits, with `+dirty` where files differed from it when the commit was checked
/// out or made; `unknown` where it was not built in the repository. `+dev` is a debug build, of this commit or a later one.
pub const COMMIT: &str = env!("V2X_COMMIT");

/// Version and commit, as `--version` prints them.
pub const LONG: &str = concat!(env!("CARGO_PKG_VERSION"), " (commit ", env!("V2X_COMMIT"), ")");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commit_is_hexadecimal_or_unknown() {
        let (digits, marks) = COMMIT.split_once('+').unwrap_or((COMMIT, ""));
        let is_commit = digits.len() == 12 && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
        assert!(is_commit || digits == "unknown", "{COMMIT}");
        assert!(["", "dev", "dirty", "dirty+dev"].contains(&marks), "{COMMIT}");
        assert_eq!(LONG, format!("{VERSION} (commit {COMMIT})"));
    }
}
