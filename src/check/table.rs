//! Results of a check: each pass's outputs compared with its reference pass, value by value.

use std::{fmt, ops::Range};

use serde::{Serialize, Serializer};

use swell_compare::{
    deviation::{ComparedValue, Deviation, relative},
    tolerance::{BoundExpression, Text},
};
use swell_domain::parallel;

/// A row of a check: one field that one pass writes.
#[derive(Debug, Serialize)]
pub struct CheckField {
    /// Name of the pass, or of the comparison if several passes produced the field.
    pub pass: &'static str,
    /// Name of the field.
    pub name: &'static str,
    /// Unit; empty if dimensionless.
    pub unit: &'static str,
    /// Derivation of the tolerance.
    pub derivation: Derivation,
}

impl PartialEq for CheckField {
    fn eq(&self, other: &Self) -> bool {
        (self.pass, self.name) == (other.pass, other.name)
    }
}

/// Derivation of a field's tolerance, in printable form.
pub struct Derivation {
    /// Tolerance.
    pub tolerance: &'static Text,
    /// Bound within which rounding decides the outcome, so that a value is left out, with the
    /// reason.
    pub tie: Option<&'static Text>,
}

impl fmt::Display for Derivation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.tolerance)?;
        let Some(tie) = self.tie else {
            return Ok(());
        };
        write!(f, "; a tie within {} of {}", tie.expression(), tie.reason)?;
        match tie.magnitudes {
            [] => Ok(()),
            _ => write!(f, "; {}", tie.meanings()),
        }
    }
}

impl fmt::Debug for Derivation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl Serialize for Derivation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A field with its tolerance: an expression of `N` magnitudes that each value supplies.
pub struct CheckEntry<const N: usize> {
    /// Compared field.
    pub field: CheckField,
    /// Largest allowed difference.
    pub tolerance: &'static BoundExpression<N>,
}

/// Declares entries, grouped by pass:
/// `"pass" { NAME = "field", "unit": [magnitudes] tolerance, "reason"; }`. An optional
/// `, tie BOUND` precedes the last `;`.
macro_rules! entries {
    ($($pass:literal {
        $($name:ident = $field:literal, $unit:literal:
            [$($magnitudes:tt)*] $value:expr, $reason:literal $(, tie $tie:ident)?;)+
    })+) => {
        $($(pub(super) static $name: $crate::table::CheckEntry<
            { swell_compare::tolerance::count!($($magnitudes)*) }
        > = {
            static TOLERANCE: swell_compare::tolerance::BoundExpression<
                { swell_compare::tolerance::count!($($magnitudes)*) }
            > = swell_compare::tolerance::bound!([$($magnitudes)*] $value, $reason);
            $crate::table::CheckEntry {
                field: $crate::table::CheckField {
                    pass: $pass,
                    name: $field,
                    unit: $unit,
                    derivation: $crate::table::Derivation {
                        tolerance: &TOLERANCE.text,
                        tie: swell_compare::tolerance::optional!($(&$tie.text)?),
                    },
                },
                tolerance: &TOLERANCE,
            }
        };)+)+
    };
}
pub(super) use entries;

/// A value, its reference, and the magnitudes that determine the tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Pair<T, const N: usize> {
    /// Index of the value: a particle's sorted index, or a cell's element.
    pub index: usize,
    /// Value from the GPU.
    pub value: T,
    /// Value from the reference pass.
    pub reference: T,
    /// Magnitudes of the tolerance.
    pub magnitudes: [f64; N],
}

/// Maps `one` over a range in parallel, preserving the order.
pub fn each<T: Send>(range: Range<usize>, one: impl Fn(usize) -> T + Sync) -> Vec<T> {
    parallel::map(range, one)
}

/// Creates a [`Pair`].
pub fn pair<T, const N: usize>(
    index: usize,
    value: impl Into<T>,
    reference: T,
    magnitudes: [f64; N],
) -> Pair<T, N> {
    Pair {
        index,
        value: value.into(),
        reference,
        magnitudes,
    }
}

/// The worst value, relative to its own tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Worst {
    /// Error over tolerance; above 1 is a failure. Infinity becomes null in JSON.
    pub ratio: f64,
    /// Error, in the unit of the field.
    pub error: f64,
    /// Tolerance, in the unit of the field.
    pub tolerance: f64,
    /// Index of the value.
    pub index: usize,
}

/// Summary of all compared runs of a pass in a traced substep.
#[derive(Clone, Debug, Serialize)]
pub struct CheckRow {
    /// Compared field.
    #[serde(flatten)]
    pub field: &'static CheckField,
    /// Number of compared runs of the pass.
    pub runs: usize,
    /// Number of compared values.
    pub values: usize,
    /// Number of values left out because either outcome is correct within rounding.
    pub ties: usize,
    /// Number of values out of tolerance.
    pub over: usize,
    /// Worst value.
    pub worst: Worst,
    /// Statistics of the run that contains it.
    pub deviation: Deviation,
}

impl CheckRow {
    /// Returns whether every value is within its tolerance.
    pub fn is_within(&self) -> bool {
        self.over == 0
    }
}

/// The rows of a check, in the order in which their passes first ran.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CheckTable {
    /// One row per field.
    pub rows: Vec<CheckRow>,
    /// Passes that ran without a comparison, each with the reason.
    pub unchecked: Vec<(&'static str, &'static str)>,
}

impl CheckTable {
    /// Adds a run of a pass. `None` is a value that is left out because either outcome is correct
    /// within rounding; a NaN is out of tolerance.
    pub fn add<T: ComparedValue, const N: usize, P: Into<Option<Pair<T, N>>>>(
        &mut self,
        entry: &'static CheckEntry<N>,
        pairs: impl IntoIterator<Item = P>,
    ) {
        let mut row = CheckRow {
            field: &entry.field,
            runs: 1,
            values: 0,
            ties: 0,
            over: 0,
            worst: Worst::default(),
            deviation: Deviation::default(),
        };
        let mut compared = Vec::new();
        for pair in pairs {
            let Some(pair) = pair.into() else {
                row.ties += 1;
                continue;
            };
            compared.push((pair.value, pair.reference));
            let error = pair.value.error(pair.reference);
            let tolerance = entry.tolerance.of(pair.magnitudes);
            let ratio = match relative(error, tolerance) {
                ratio if tolerance.is_nan() => ratio.max(f64::INFINITY),
                ratio => ratio,
            };
            row.over += usize::from(ratio > 1.0);
            if ratio > row.worst.ratio {
                row.worst = Worst {
                    ratio,
                    error,
                    tolerance,
                    index: pair.index,
                };
            }
        }
        row.values = compared.len();
        row.deviation = Deviation::of(compared);
        self.merge(row);
    }

    /// Adds a run of a pass, evaluating the values of a range in parallel.
    pub fn each<T: ComparedValue + Send, const N: usize, P: Into<Option<Pair<T, N>>> + Send>(
        &mut self,
        entry: &'static CheckEntry<N>,
        range: Range<usize>,
        one: impl Fn(usize) -> P + Sync,
    ) {
        self.add(entry, each(range, one));
    }

    /// Adds to the number of values left out of a row, if they were only counted.
    pub fn add_ties<const N: usize>(&mut self, entry: &'static CheckEntry<N>, ties: usize) {
        let known = self.rows.iter_mut().find(|row| *row.field == entry.field);
        if let Some(row) = known {
            row.ties += ties;
        }
    }

    /// Adds a run in which rounding decides all `count` values.
    pub fn leave_out<const N: usize>(&mut self, entry: &'static CheckEntry<N>, count: usize) {
        self.add(entry, vec![None::<Pair<f64, N>>; count]);
    }

    /// Adds a run with integer outputs: every difference is out of tolerance.
    pub fn add_exact(&mut self, entry: &'static CheckEntry<0>, value: &[u32], reference: &[u32]) {
        let same = value.len() == reference.len();
        let one = |(index, (&value, &reference)): (usize, (&u32, &u32))| {
            let value = if same { f64::from(value) } else { f64::NAN };
            pair(index, value, f64::from(reference), [])
        };
        self.add(entry, value.iter().zip(reference).enumerate().map(one));
    }

    /// Merges the rows of another check, for example of another frame.
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

    fn merge(&mut self, row: CheckRow) {
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

    /// Returns the first row that is out of tolerance.
    pub fn first_over(&self) -> Option<&CheckRow> {
        self.rows.iter().find(|row| !row.is_within())
    }

    /// Returns whether a pass has a row.
    pub fn has(&self, pass: &str) -> bool {
        self.rows.iter().any(|row| row.field.pass == pass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    entries! {
        "a/pass" {
            FIELD = "field", "m": [most: "what the test allows"] most, "a test";
            WHOLE = "whole", "": [] 0.0, "a test";
        }
    }

    fn one(index: usize, value: f64, tolerance: f64) -> Pair<f64, 1> {
        pair(index, value, 1.0, [tolerance])
    }

    #[test]
    fn the_worst_is_that_of_the_least_room() {
        let mut table = CheckTable::default();
        // The larger error has the larger tolerance.
        let pairs = [Some(one(3, 1.5, 1.0)), None, None, Some(one(4, 1.25, 0.3))];
        table.add(&FIELD, pairs);
        let row = &table.rows[0];
        assert_eq!((row.worst.index, row.worst.error, row.over), (4, 0.25, 0));
        assert_eq!((row.values, row.ties, row.deviation.max), (2, 2, 0.5));
        assert!(table.first_over().is_none());
        table.each(&FIELD, 7..8, |index| one(index, 1.5, 0.25));
        let row = table.first_over().unwrap();
        assert_eq!((row.runs, row.values, row.over), (2, 3, 1));
        assert_eq!((row.worst.ratio, row.worst.index), (2.0, 7));
        assert_eq!(row.deviation.count, 1);
        let derivation = row.field.derivation.to_string();
        assert_eq!(derivation, "most (a test); most = what the test allows");
    }

    #[test]
    fn no_number_and_no_tolerance_are_out() {
        for (value, tolerance) in [(f64::NAN, 1.0), (1.0 + 1e-9, 0.0), (1.1, f64::NAN)] {
            let mut table = CheckTable::default();
            table.add(&FIELD, [one(0, value, tolerance)]);
            assert!(table.first_over().is_some(), "{value} {tolerance}");
        }
        let mut table = CheckTable::default();
        table.add(&FIELD, [one(0, 1.0, 0.0)]);
        table.add_exact(&WHOLE, &[1, 2], &[1, 2]);
        assert!(table.first_over().is_none());
        table.add_exact(&WHOLE, &[1, 2], &[1, 3]);
        assert_eq!(table.rows[1].over, 1);
    }
}
