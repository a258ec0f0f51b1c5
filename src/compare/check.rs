//! What a check finds: each pass's outputs against its twin's, value by value.

use serde::Serialize;

use super::deviation::{Deviation, Value, relative};

/// A line of a check: one field that one pass writes.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Field {
    /// Pass name, or what is compared when several passes made it.
    pub pass: &'static str,
    /// What it writes.
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// Where the tolerance comes from.
    pub derivation: &'static str,
}

/// Declares fields, one a line: pass, name, unit, derivation.
macro_rules! fields {
    ($($name:ident = $pass:literal, $field:literal, $unit:literal, $derivation:literal;)+) => {
        $(pub(crate) static $name: $crate::compare::check::Field = $crate::compare::check::Field {
            pass: $pass,
            name: $field,
            unit: $unit,
            derivation: $derivation,
        };)+
    };
}
pub(crate) use fields;

/// A value, what its twin says, and by how much they may differ.
#[derive(Clone, Copy, Debug)]
pub struct Pair<T> {
    /// Of what: a particle's sorted index, a cell's element.
    pub index: usize,
    /// The GPU's.
    pub value: T,
    /// The twin's.
    pub reference: T,
    /// In the unit of the field.
    pub tolerance: f64,
}

/// The value that is furthest out, as a part of its own tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Worst {
    /// Error over tolerance; above 1 is a failure. JSON has no infinity: there it is null.
    pub ratio: f64,
    /// In the unit of the field.
    pub error: f64,
    /// In the unit of the field.
    pub tolerance: f64,
    /// Of what.
    pub index: usize,
}

/// What all runs of a pass in a traced substep came to.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What was compared.
    #[serde(flatten)]
    pub field: &'static Field,
    /// Runs of the pass.
    pub runs: usize,
    /// Values compared in them.
    pub values: usize,
    /// Values left out: within rounding both outcomes are right.
    pub ties: usize,
    /// Values out of tolerance.
    pub over: usize,
    /// The furthest out.
    pub worst: Worst,
    /// Of the run that holds it.
    pub deviation: Deviation,
}

impl Row {
    /// Whether every value is within its tolerance.
    pub fn is_within(&self) -> bool {
        self.over == 0
    }
}

/// The rows of a check, in the order in which their passes first ran.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// One a field.
    pub rows: Vec<Row>,
    /// Passes that ran and have no twin, each with the reason.
    pub unchecked: Vec<(&'static str, &'static str)>,
}

impl Table {
    /// Adds a run of a pass. What is not a number is out of tolerance.
    pub fn add<T: Value>(&mut self, field: &'static Field, pairs: &[Pair<T>], ties: usize) {
        let mut worst = Worst::default();
        let mut over = 0;
        for pair in pairs {
            let error = pair.value.error(pair.reference);
            let ratio = match relative(error, pair.tolerance) {
                ratio if pair.tolerance.is_nan() => ratio.max(f64::INFINITY),
                ratio => ratio,
            };
            over += usize::from(ratio > 1.0);
            if ratio > worst.ratio {
                worst = Worst {
                    ratio,
                    error,
                    tolerance: pair.tolerance,
                    index: pair.index,
                };
            }
        }
        let row = Row {
            field,
            runs: 1,
            values: pairs.len(),
            ties,
            over,
            worst,
            deviation: Deviation::of(pairs.iter().map(|pair| (pair.value, pair.reference))),
        };
        self.merge(row);
    }

    /// Adds a run whose outputs are whole numbers: those of `value` that are not `reference` are out of tolerance.
    pub fn add_exact(&mut self, field: &'static Field, value: &[u32], reference: &[u32]) {
        let same = value.len() == reference.len();
        let pairs: Vec<Pair<f64>> = (value.iter().zip(reference).enumerate())
            .map(|(index, (&value, &reference))| Pair {
                index,
                value: if same { f64::from(value) } else { f64::NAN },
                reference: f64::from(reference),
                tolerance: 0.0,
            })
            .collect();
        self.add(field, &pairs, 0);
    }

    /// Takes over the rows of another check, such as of another frame.
    pub fn absorb(&mut self, other: Self) {
        for row in other.rows {
            self.merge(row);
        }
        for pass in other.unchecked {
            if !self.unchecked.contains(&pass) {
                self.unchecked.push(pass);
            }
        }
    }

    fn merge(&mut self, row: Row) {
        let Some(known) = self.rows.iter_mut().find(|known| known.field == row.field) else {
            self.rows.push(row);
            return;
        };
        known.runs += row.runs;
        known.values += row.values;
        known.ties += row.ties;
        known.over += row.over;
        if row.worst.ratio > known.worst.ratio || known.deviation.count == 0 {
            known.worst = row.worst;
            known.deviation = row.deviation;
        }
    }

    /// The first row out of tolerance.
    pub fn first_over(&self) -> Option<&Row> {
        self.rows.iter().find(|row| !row.is_within())
    }

    /// Whether a pass has a row.
    pub fn has(&self, pass: &str) -> bool {
        self.rows.iter().any(|row| row.field.pass == pass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static FIELD: Field = Field {
        pass: "a/pass",
        name: "field",
        unit: "m",
        derivation: "a test",
    };

    fn pair(index: usize, value: f64, tolerance: f64) -> Pair<f64> {
        Pair {
            index,
            value,
            reference: 1.0,
            tolerance,
        }
    }

    #[test]
    fn the_worst_is_that_of_the_least_room() {
        let mut table = Table::default();
        // The larger error has the larger tolerance.
        table.add(&FIELD, &[pair(3, 1.5, 1.0), pair(4, 1.25, 0.3)], 2);
        let row = &table.rows[0];
        assert_eq!((row.worst.index, row.worst.error, row.over), (4, 0.25, 0));
        assert_eq!((row.values, row.ties, row.deviation.max), (2, 2, 0.5));
        assert!(table.first_over().is_none());
        table.add(&FIELD, &[pair(7, 1.5, 0.25)], 0);
        let row = table.first_over().unwrap();
        assert_eq!((row.runs, row.values, row.over), (2, 3, 1));
        assert_eq!((row.worst.ratio, row.worst.index), (2.0, 7));
        assert_eq!(row.deviation.count, 1);
    }

    #[test]
    fn no_number_and_no_tolerance_are_out() {
        for (value, tolerance) in [(f64::NAN, 1.0), (1.0 + 1e-9, 0.0), (1.1, f64::NAN)] {
            let mut table = Table::default();
            table.add(&FIELD, &[pair(0, value, tolerance)], 0);
            assert!(table.first_over().is_some(), "{value} {tolerance}");
        }
        let mut table = Table::default();
        table.add(&FIELD, &[pair(0, 1.0, 0.0)], 0);
        table.add_exact(&FIELD, &[1, 2], &[1, 2]);
        assert!(table.first_over().is_none());
        table.add_exact(&FIELD, &[1, 2], &[1, 3]);
        assert_eq!(table.rows[0].over, 1);
    }
}
