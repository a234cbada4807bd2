//! One name for each object, also where a program gives objects of different kinds the same id, as SUMO does.

use std::borrow::Cow;
use std::collections::HashMap;

/// The names that are given.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// Kind and id of the object that has a name; never iterated.
    owners: HashMap<String, (&'static str, String)>,
}

impl Names {
    /// The name of an object of this kind and id, always the same one: its id, with its kind before it where an object of
    /// another kind had that id first, as in `person:0`.
    pub fn of<'a>(&mut self, kind: &'static str, id: &'a str) -> Cow<'a, str> {
        let mut name = Cow::Borrowed(id);
        loop {
            match self.owners.get(name.as_ref()) {
                Some((owner, of)) if *owner == kind && of == id => return name,
                Some(_) => name = Cow::Owned(format!("{kind}:{name}")),
                None => {
                    self.owners.insert(name.clone().into_owned(), (kind, id.to_owned()));
                    return name;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_of_different_kinds_with_one_id_have_different_names() {
        let mut names = Names::default();
        let asked = [("vehicle", "0"), ("person", "0"), ("person", "1"), ("person", "person:0")];
        for _ in 0..2 {
            let given = asked.map(|(kind, id)| names.of(kind, id).into_owned());
            assert_eq!(given, ["0", "person:0", "1", "person:person:0"]);
        }
    }
}
