//! A scenario's parameter by its path in the file: `world.traffic`, `agents.rsu.link.delay_ms`.

use std::fmt;
use std::str::FromStr;

/// The names on the path to a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Path(Vec<String>);

/// Why a parameter cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OverrideError {
    /// Names are missing.
    #[error("{0:?} is no path: write names with a dot between them, such as world.traffic")]
    Malformed(String),
    /// There are no such agents.
    #[error(
        "{path}: the scenario has no agent {agent:?}; it has {known}, and `*` is all of them, `others` all but the first"
    )]
    UnknownAgent {
        /// The path.
        path: String,
        /// The unknown agent.
        agent: String,
        /// The known agents.
        known: String,
    },
    /// A value on the path is no table.
    #[error(
        "{path}: {part} is {value} in the scenario, which has no parts; write it as a table there, or vary it whole: {path_of_part}=NAME;NAME:loss=0.1"
    )]
    NotATable {
        /// The path.
        path: String,
        /// The name of the value.
        part: String,
        /// The value.
        value: String,
        /// The path to it.
        path_of_part: String,
    },
}

impl FromStr for Path {
    type Err = OverrideError;

    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let names: Vec<String> = text.split('.').map(str::to_owned).collect();
        if names.len() < 2 || names.iter().any(String::is_empty) {
            return Err(OverrideError::Malformed(text.to_owned()));
        }
        Ok(Self(names))
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("."))
    }
}

impl Path {
    /// Sets the parameter. Missing tables on the path are made. An unknown parameter is an error when the scenario is read.
    pub(crate) fn set(&self, scenario: &mut toml::Table, value: &toml::Value) -> Result<(), OverrideError> {
        let Some((first, rest)) = self.0.split_first() else { return Ok(()) };
        if first != "agents" || rest.len() < 2 {
            return self.set_in(scenario, &self.0, value);
        }
        let (selector, rest) = (&rest[0], &rest[1..]);
        let agents = scenario.get_mut("agents").and_then(toml::Value::as_array_mut);
        let agents = agents.map(Vec::as_mut_slice).unwrap_or_default();
        let known: Vec<String> = agents.iter().map(|agent| id(agent).to_owned()).collect();
        let mut is_set = false;
        for (place, agent) in agents.iter_mut().enumerate() {
            let is_meant = match selector.as_str() {
                "*" => true,
                "others" => place > 0,
                selector => id(agent) == selector,
            };
            if let (true, toml::Value::Table(agent)) = (is_meant, agent) {
                self.set_in(agent, rest, value)?;
                is_set = true;
            }
        }
        // A single agent has no others: nothing is set, and this is no error.
        if is_set || (selector == "others" && known.len() == 1) {
            return Ok(());
        }
        let known = known.join(", ");
        Err(OverrideError::UnknownAgent { path: self.to_string(), agent: selector.clone(), known })
    }

    fn set_in(
        &self,
        table: &mut toml::Table,
        names: &[String],
        value: &toml::Value,
    ) -> Result<(), OverrideError> {
        match names {
            [] => Ok(()),
            [name] => {
                table.insert(name.clone(), value.clone());
                Ok(())
            }
            [name, rest @ ..] => {
                let part = table.entry(name.clone()).or_insert_with(|| toml::Table::new().into());
                match part {
                    toml::Value::Table(part) => self.set_in(part, rest, value),
                    other => Err(OverrideError::NotATable {
                        path: self.to_string(),
                        part: name.clone(),
                        value: other.to_string(),
                        path_of_part: self.0[..=self.0.len() - 1 - rest.len()]
                            .join(".")
                            .trim_end_matches('.')
                            .to_owned(),
                    }),
                }
            }
        }
    }
}

fn id(agent: &toml::Value) -> &str {
    agent.get("id").and_then(toml::Value::as_str).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "[world]\ntraffic = 0.5\n[[agents]]\nid = \"a\"\nlink = \"pc5\"\n[[agents]]\nid = \"b\"\n";

    fn set(path: &str, value: i64) -> Result<toml::Table, OverrideError> {
        let mut scenario = TEXT.parse().unwrap();
        path.parse::<Path>()?.set(&mut scenario, &toml::Value::Integer(value))?;
        Ok(scenario)
    }

    #[test]
    fn parameters_are_found_by_name_and_agents_by_id() {
        assert_eq!(set("world.traffic", 1).unwrap()["world"]["traffic"].as_integer(), Some(1));
        let scenario = set("agents.b.link.delay_ms", 7).unwrap();
        assert_eq!(scenario["agents"][1]["link"]["delay_ms"].as_integer(), Some(7));
        assert_eq!(scenario["agents"][0]["link"].as_str(), Some("pc5"));
        assert_eq!(set("hub.lag_ms", 3).unwrap()["hub"]["lag_ms"].as_integer(), Some(3));
    }

    #[test]
    fn all_agents_and_all_but_the_first_have_names() {
        let all = set("agents.*.rate_hz", 5).unwrap();
        assert!(
            all["agents"].as_array().unwrap().iter().all(|agent| agent["rate_hz"].as_integer() == Some(5))
        );
        let others = set("agents.others.rate_hz", 5).unwrap();
        assert!(others["agents"][0].get("rate_hz").is_none() && others["agents"][1].get("rate_hz").is_some());
    }

    #[test]
    fn errors_list_the_available_parameters() {
        let message = |path: &str| set(path, 1).unwrap_err().to_string();
        assert!(message("agents.c.rate_hz").contains("it has a, b"));
        assert!(message("agents.a.link.delay_ms").contains("\"pc5\""));
        assert!(message("traffic").contains("no path"));
        assert!(message("world..x").contains("no path"));
    }
}
