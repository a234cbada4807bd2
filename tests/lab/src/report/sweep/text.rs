//! A sweep's results as text: matrices of methods against values.

use crate::drive::sweep::method::SweepMethod;
use crate::report::sweep::rows::Row;
use crate::report::table::Table;
use crate::score::sweep::record::Subset;

/// One quantity of a row, as it is printed.
pub(crate) struct Quantity {
    pub(crate) title: &'static str,
    pub(crate) subset: Subset,
    value: fn(&Row) -> Option<f64>,
    digits: usize,
}

/// The printed quantities. The files have more.
pub(crate) const QUANTITIES: [Quantity; 12] = [
    Quantity { title: "mATE, all objects (m)", subset: Subset::All, value: |row| row.mate_m, digits: 3 },
    Quantity {
        title: "mATE, objects faster than 3 m/s (m)",
        subset: Subset::Fast,
        value: |row| row.mate_m,
        digits: 3,
    },
    Quantity {
        title: "what is kept of the gain over the first agent alone, objects faster than 3 m/s",
        subset: Subset::Fast,
        value: |row| row.kept,
        digits: 2,
    },
    Quantity {
        title: "mATE over that of the first agent alone under the same filter, fast objects",
        subset: Subset::Fast,
        value: |row| row.versus_alone.map(|versus| versus.ratio),
        digits: 3,
    },
    Quantity { title: "mAOE, all objects (°)", subset: Subset::All, value: |row| row.maoe_deg, digits: 2 },
    Quantity { title: "precision", subset: Subset::All, value: |row| row.precision, digits: 4 },
    Quantity { title: "recall", subset: Subset::All, value: |row| row.recall, digits: 4 },
    Quantity { title: "other agents' frames: late", subset: Subset::All, value: |row| row.late, digits: 3 },
    Quantity {
        title: "other agents' frames: refused",
        subset: Subset::All,
        value: |row| row.refused,
        digits: 3,
    },
    Quantity { title: "position NEES / 2", subset: Subset::All, value: |row| row.nees_position, digits: 2 },
    Quantity {
        title: "age of the other agents' information in an object, median (ms)",
        subset: Subset::All,
        value: |row| row.other_age_ms.map(|age| age.p50),
        digits: 0,
    },
    Quantity {
        title: "hub's processor time, share of a core",
        subset: Subset::All,
        value: |row| row.cpu_share,
        digits: 3,
    },
];

/// Rows of one curve family: one second value, one Δmax, live or not.
pub(crate) struct Family<'a> {
    pub(crate) y: Option<f64>,
    pub(crate) delta_max_ms: Option<f64>,
    pub(crate) live: bool,
    pub(crate) rows: Vec<&'a Row>,
}

impl Family<'_> {
    /// Its name.
    pub(crate) fn name(&self) -> String {
        self.parts().join(", ")
    }

    /// What distinguishes it from other families: second value, Δmax, and whether it is live.
    pub(crate) fn parts(&self) -> Vec<String> {
        let second = self.rows.first().and_then(|row| row.axis_2.as_deref().zip(row.y_text.as_deref()));
        let parts = [
            second.map(|(axis, y)| format!("{axis} {y}")),
            self.delta_max_ms.map(|ms| format!("Δmax {ms} ms")),
            Some(if self.live { "live" } else { "virtual time" }.to_owned()),
        ];
        parts.into_iter().flatten().collect()
    }

    /// The methods in it, in order.
    pub(crate) fn methods(&self) -> Vec<&'static str> {
        let all = SweepMethod::ALL.into_iter().map(SweepMethod::key);
        all.filter(|key| self.rows.iter().any(|row| row.method == *key)).collect()
    }

    /// A method's rows of a subset, by value.
    pub(crate) fn of(&self, method: &str, subset: Subset) -> impl Iterator<Item = &Row> {
        self.rows.iter().copied().filter(move |row| row.method == method && row.subset == subset.name())
    }

    /// Methods down, values across; the values are named in the header.
    pub(crate) fn table(&self, quantity: &Quantity) -> Table {
        let methods = self.methods();
        let first = methods.first().copied().unwrap_or_default();
        let values = self.of(first, quantity.subset).map(|row| row.x_text.clone());
        let axis = self.rows.first().map_or("", |row| row.axis.as_str());
        let header = std::iter::once(axis.to_owned()).chain(values).collect();
        let cell = |row: &Row| {
            (quantity.value)(row).map_or_else(|| "–".to_owned(), |v| format!("{v:.*}", quantity.digits))
        };
        let line = |method: &&str| {
            let cells = self.of(method, quantity.subset).map(cell);
            std::iter::once((*method).to_owned()).chain(cells).collect::<Vec<_>>()
        };
        // Rows without any number are left out.
        let rows = methods.iter().map(line).filter(|row| row[1..].iter().any(|cell| cell != "–")).collect();
        Table { header, rows }
    }
}

/// All families, in the order of the rows. Where Δmax is the axis, it is the same family.
pub(crate) fn families(rows: &[Row]) -> Vec<Family<'_>> {
    let mut families: Vec<Family<'_>> = Vec::new();
    for row in rows {
        let is_swept = row.axis == "delta-max" || row.axis == "hub.delta_max_ms";
        let delta_max_ms = (!is_swept).then_some(row.delta_max_ms);
        let is_it = |family: &&mut Family<'_>| {
            family.y == row.y && family.delta_max_ms == delta_max_ms && family.live == row.live
        };
        match families.iter_mut().find(is_it) {
            Some(family) => family.rows.push(row),
            None => families.push(Family { y: row.y, delta_max_ms, live: row.live, rows: vec![row] }),
        }
    }
    families
}

/// For a terminal.
pub(crate) fn terminal(rows: &[Row]) -> String {
    in_families(rows, "", |table| table.text())
}

/// As Markdown.
pub(crate) fn markdown(rows: &[Row]) -> String {
    in_families(rows, "## ", |table| format!("\n{}", table.markdown()))
}

/// Family by family, quantity by quantity.
fn in_families(rows: &[Row], heading: &str, table_text: impl Fn(&Table) -> String) -> String {
    let mut text = String::new();
    for family in families(rows) {
        text += &format!("{heading}{}\n", family.name());
        for quantity in &QUANTITIES {
            let table = family.table(quantity);
            if !table.rows.is_empty() {
                text += &format!("\n{}\n{}", quantity.title, table_text(&table));
            }
        }
        text += "\n";
    }
    text
}
