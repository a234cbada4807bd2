//! The scenarios that are shipped with the programs: wherever a scenario file is asked for, their names do as well.

use std::borrow::Cow;
use std::io;
use std::path::Path;

use crate::spelling;

/// Name and text of each shipped scenario.
pub const SHIPPED: [(&str, &str); 4] = [
    ("crossing", include_str!("../../deploy/scenarios/crossing.toml")),
    ("ten-agents", include_str!("../../deploy/scenarios/ten-agents.toml")),
    ("highway", include_str!("../../deploy/scenarios/highway.toml")),
    ("latency", include_str!("../../deploy/scenarios/latency.toml")),
];

/// The text of the shipped scenario of this name, where there is no file of it.
pub fn named(name_or_file: &Path) -> Option<&'static str> {
    let shipped = SHIPPED.iter().find(|(name, _)| name_or_file.as_os_str() == *name);
    shipped.filter(|_| !name_or_file.exists()).map(|(_, text)| *text)
}

/// The text of a file, or of a shipped scenario by its name; the error of a file that is not there lists the names.
pub fn read(name_or_file: &Path) -> io::Result<Cow<'static, str>> {
    if let Some(text) = named(name_or_file) {
        return Ok(Cow::Borrowed(text));
    }
    std::fs::read_to_string(name_or_file).map(Cow::Owned).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            let names: Vec<_> = SHIPPED.iter().map(|(name, _)| *name).collect();
            let file = name_or_file.display();
            let meant = names.iter().find(|name| name_or_file.file_stem().is_some_and(|stem| stem == **name));
            let near = || spelling::nearest(name_or_file.to_str()?, names.iter().copied());
            let words = match meant {
                None if let Some(near) = near() => {
                    format!("no scenario file {file} (did you mean `{near}`, which is shipped?)")
                }
                Some(name) => {
                    format!("no scenario file {file}; the shipped scenario is `{name}`, without `.toml`")
                }
                None => format!("no scenario file {file}; shipped scenarios are {}", names.join(", ")),
            };
            io::Error::new(error.kind(), words)
        }
        io::ErrorKind::InvalidData => io::Error::new(
            error.kind(),
            "it is not written as UTF-8: save it so in your editor (Windows writes UTF-16 or Latin-1 at times)",
        ),
        _ => error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_another_encoding_is_an_error_that_says_what_to_do() {
        let path = std::env::temp_dir().join(format!("v2x-shipped-{}.toml", std::process::id()));
        let utf_16: Vec<u8> = "[hub]\n".encode_utf16().chain([0xd800]).flat_map(u16::to_le_bytes).collect();
        std::fs::write(&path, utf_16).unwrap();
        let message = read(&path).unwrap_err().to_string();
        std::fs::remove_file(path).unwrap();
        assert!(message.contains("UTF-8: save it so"), "{message}");
    }

    #[test]
    fn a_name_is_a_shipped_scenario_and_a_missing_file_is_named_with_them() {
        assert!(read(Path::new("crossing")).unwrap().contains("name = \"crossing\""));
        let message = read(Path::new("no-such.toml")).unwrap_err().to_string();
        assert!(
            message.contains("no scenario file no-such.toml") && message.contains("ten-agents"),
            "{message}"
        );
        for (name, meant) in [
            ("crossin", "crossing"),
            ("Crossing", "crossing"),
            ("ten_agents", "ten-agents"),
            ("higway", "highway"),
        ] {
            let message = read(Path::new(name)).unwrap_err().to_string();
            assert!(message.contains(&format!("{name} (did you mean `{meant}`")), "{message}");
        }
        for file in ["crossing.toml", "scenarios/crossing.toml"] {
            let message = read(Path::new(file)).unwrap_err().to_string();
            assert!(message.contains(file) && message.contains("`crossing`, without `.toml`"), "{message}");
        }
    }
}
