//! A bound on an error as an expression that both computes and prints itself, so that the printed
//! derivation cannot differ from the number.
//!
//! `bound!` takes the expression once: it compiles to a function, and its source text is what is
//! printed. The expression reads magnitudes, each named and explained in its declaration; a
//! magnitude may be another bound, which is then printed too.

use std::fmt;

/// An expression of `N` magnitudes.
pub struct BoundExpression<const N: usize> {
    /// Printed form and explanation.
    pub text: Text,
    /// Evaluates the bound, from the magnitudes in the order of their declaration.
    pub of: fn([f64; N]) -> f64,
}

impl<const N: usize> BoundExpression<N> {
    /// Evaluates the bound, from the magnitudes in the order of their declaration.
    pub fn of(&self, magnitudes: [f64; N]) -> f64 {
        (self.of)(magnitudes)
    }
}

/// Printed form of a [`BoundExpression`].
pub struct Text {
    /// Source text of the expression.
    pub expression: &'static str,
    /// Magnitudes that the expression reads.
    pub magnitudes: &'static [Magnitude],
    /// Reason for the bound; may be empty.
    pub reason: &'static str,
}

/// A magnitude that an expression reads.
pub struct Magnitude {
    /// Name in the expression.
    pub name: &'static str,
    /// Description, followed by its bound if it has one.
    pub words: &'static str,
    /// Bound that gives the magnitude, or with which it was found.
    pub bound: Option<&'static Text>,
}

impl Text {
    /// Returns the expression in the form used in tables.
    pub fn expression(&self) -> String {
        match self.expression {
            "0.0" => "equal".into(),
            expression => plain(expression),
        }
    }

    /// Returns the reason for the bound, or the first one among the bounds that it is made of;
    /// empty if there is none.
    pub fn why(&self) -> &'static str {
        if !self.reason.is_empty() {
            return self.reason;
        }
        let bounds = self
            .magnitudes
            .iter()
            .filter_map(|magnitude| magnitude.bound);
        bounds
            .map(Self::why)
            .find(|why| !why.is_empty())
            .unwrap_or("")
    }

    /// Returns the meaning of each name in the expression, separated by commas.
    pub fn meanings(&self) -> String {
        let mut told = Vec::new();
        tell(self.magnitudes, &mut told);
        told.join(", ")
    }
}

/// Formats the expression, then the reason, then the meaning of each name.
impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.expression())?;
        if !self.reason.is_empty() {
            write!(f, " ({})", self.reason)?;
        }
        if !self.magnitudes.is_empty() {
            write!(f, "; {}", self.meanings())?;
        }
        Ok(())
    }
}

/// Appends the meaning of each name, once.
fn tell(magnitudes: &[Magnitude], told: &mut Vec<String>) {
    for Magnitude { name, words, bound } in magnitudes {
        let mut meaning = format!("{name} = {words}");
        if let Some(bound) = bound {
            meaning += &plain(bound.expression);
            if !bound.reason.is_empty() {
                meaning += &format!(" ({})", bound.reason);
            }
        }
        if !told.contains(&meaning) {
            told.push(meaning);
        }
        if let Some(bound) = bound {
            tell(bound.magnitudes, told);
        }
    }
}

/// Converts source text to the form used in tables: whole numbers without a point, × for a product.
fn plain(expression: &str) -> String {
    let words = expression.split_whitespace().map(|word| match word {
        "*" => "×".to_owned(),
        word => whole_numbers(word),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Removes `.0` from numbers that end with it.
fn whole_numbers(word: &str) -> String {
    let mut out = String::new();
    let mut rest = word;
    while let Some(at) = rest.find(".0") {
        let (before, after) = rest.split_at(at);
        let is_end = !after[2..].starts_with(|c: char| c.is_ascii_digit() || c == 'e');
        let is_number = before.ends_with(|c: char| c.is_ascii_digit());
        out += before;
        out += if is_end && is_number { "" } else { ".0" };
        rest = &after[2..];
    }
    out + rest
}

/// Builds a [`BoundExpression`]:
/// `[name: "what it is", other: "what it is" ITS_BOUND] expression, "reason"`.
#[doc(hidden)]
#[macro_export]
macro_rules! bound {
    ([$($name:ident: $words:literal $($bound:ident)?),* $(,)?] $value:expr, $reason:literal) => {
        $crate::tolerance::BoundExpression {
            text: $crate::tolerance::Text {
                expression: stringify!($value),
                magnitudes: &[$($crate::tolerance::Magnitude {
                    name: stringify!($name),
                    words: $words,
                    bound: $crate::tolerance::optional!($(&$bound.text)?),
                }),*],
                reason: $reason,
            },
            of: |[$($name),*]| $value,
        }
    };
}
pub use crate::bound;

/// `Some` of the argument, or `None` without one.
#[doc(hidden)]
#[macro_export]
macro_rules! optional {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}
pub use crate::optional;

/// Declares bounds, one per line: `NAME = [magnitudes] expression, "reason";`.
#[doc(hidden)]
#[macro_export]
macro_rules! bounds {
    ($($(#[$meta:meta])* $visible:vis $name:ident = [$($magnitudes:tt)*]
        $value:expr, $reason:literal;)+) => {
        $($(#[$meta])* $visible static $name: $crate::tolerance::BoundExpression<
            { $crate::tolerance::count!($($magnitudes)*) }
        > = $crate::tolerance::bound!([$($magnitudes)*] $value, $reason);)+
    };
}
pub use crate::bounds;

/// Counts the declared magnitudes.
#[doc(hidden)]
#[macro_export]
macro_rules! count {
    ($($name:ident: $words:literal $($bound:ident)?),* $(,)?) => {
        <[&str]>::len(&[$($words),*])
    };
}
pub use crate::count;

#[cfg(test)]
mod tests {
    use super::Text;
    use crate::rounding::U;

    bounds! {
        INNER = [n: "terms", size: "Σ|t|"] U * (n + 2.0) * size, "a sum";
        OUTER = [scale: "a part", sum: "the sum's error " INNER, x: "|x|"]
            scale * sum + 0.5 * x.max(10.05), "two of them";
        EQUAL = [] 0.0, "a copy";
        SILENT = [x: "|x|", sum: "" INNER] x + sum, "";
    }

    #[test]
    fn a_bound_computes_what_it_prints() {
        assert_eq!(INNER.of([3.0, 8.0]), 40.0 * U);
        assert_eq!(OUTER.of([2.0, 3.0, 12.0]), 12.0);
        assert_eq!(EQUAL.of([]), 0.0);
        assert_eq!(
            OUTER.text.to_string(),
            "scale × sum + 0.5 × x.max(10.05) (two of them); scale = a part, \
             sum = the sum's error U × (n + 2) × size (a sum), n = terms, size = Σ|t|, x = |x|"
        );
        assert_eq!(EQUAL.text.to_string(), "equal (a copy)");
        let why = [&OUTER.text, &SILENT.text].map(Text::why);
        assert_eq!(why, ["two of them", "a sum"]);
    }
}
