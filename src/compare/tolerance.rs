//! A bound on an error as an expression that both computes it and prints itself, so that no printed derivation can
//! differ from the number.
//!
//! `bound!` takes the expression once: the compiler makes the function of it, and its own text is what is shown.
//! What the expression reads are magnitudes, each named and explained where it is declared; a magnitude may be
//! another bound, which is then printed too.

use std::fmt;

/// An expression of `N` magnitudes.
pub struct Bound<const N: usize> {
    /// Printed form and explanation.
    pub text: Text,
    /// The number, from the magnitudes in the order of their declaration.
    pub of: fn([f64; N]) -> f64,
}

impl<const N: usize> Bound<N> {
    /// The number, from the magnitudes in the order of their declaration.
    pub fn of(&self, magnitudes: [f64; N]) -> f64 {
        (self.of)(magnitudes)
    }
}

/// What is shown of a [`Bound`].
pub struct Text {
    /// The expression's own source text.
    pub expression: &'static str,
    /// What it reads.
    pub magnitudes: &'static [Magnitude],
    /// Why it is so; may be empty.
    pub reason: &'static str,
}

/// What an expression reads.
pub struct Magnitude {
    /// In the expression.
    pub name: &'static str,
    /// What it is, with its bound after it where it has one.
    pub words: &'static str,
    /// The bound that gives it, or by which it was found.
    pub bound: Option<&'static Text>,
}

/// Expression, then what each name stands for, then the reason.
impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = match self.expression {
            "0.0" => "equal".into(),
            expression => plain(expression),
        };
        let mut told = Vec::new();
        tell(self.magnitudes, &mut told);
        for (k, meaning) in told.iter().enumerate() {
            text += if k == 0 { "; " } else { ", " };
            text += meaning;
        }
        if !self.reason.is_empty() {
            text += ": ";
            text += self.reason;
        }
        f.write_str(&text)
    }
}

/// Appends what each name stands for, once.
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

/// Source text as it is read in a table: whole numbers without a point, × for a product.
fn plain(expression: &str) -> String {
    let words = expression.split_whitespace().map(|word| match word {
        "*" => "×".to_owned(),
        word => whole_numbers(word),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Takes `.0` from numbers that end with it.
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

/// A [`Bound`]: `[name: "what it is", other: "what it is" ITS_BOUND] expression, "reason"`.
macro_rules! bound {
    ([$($name:ident: $words:literal $($bound:ident)?),* $(,)?] $value:expr, $reason:literal) => {
        $crate::compare::tolerance::Bound {
            text: $crate::compare::tolerance::Text {
                expression: stringify!($value),
                magnitudes: &[$($crate::compare::tolerance::Magnitude {
                    name: stringify!($name),
                    words: $words,
                    bound: $crate::compare::tolerance::optional!($(&$bound.text)?),
                }),*],
                reason: $reason,
            },
            of: |[$($name),*]| $value,
        }
    };
}
pub(crate) use bound;

/// `Some` of what is there.
macro_rules! optional {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}
pub(crate) use optional;

/// Declares bounds, one a line: `NAME = [magnitudes] expression, "reason";`.
macro_rules! bounds {
    ($($(#[$meta:meta])* $visible:vis $name:ident = [$($magnitudes:tt)*] $value:expr, $reason:literal;)+) => {
        $($(#[$meta])* $visible static $name: $crate::compare::tolerance::Bound<
            { $crate::compare::tolerance::count!($($magnitudes)*) }
        > = $crate::compare::tolerance::bound!([$($magnitudes)*] $value, $reason);)+
    };
}
pub(crate) use bounds;

/// How many magnitudes are declared.
macro_rules! count {
    ($($name:ident: $words:literal $($bound:ident)?),* $(,)?) => {
        <[&str]>::len(&[$($words),*])
    };
}
pub(crate) use count;

#[cfg(test)]
mod tests {
    use crate::compare::rounding::U;

    bounds! {
        INNER = [n: "terms", size: "Σ|t|"] U * (n + 2.0) * size, "a sum";
        OUTER = [scale: "", sum: "the sum's error " INNER, x: "|x|"] scale * sum + 0.5 * x.max(10.05), "two of them";
        EQUAL = [] 0.0, "a copy";
    }

    #[test]
    fn a_bound_computes_what_it_prints() {
        assert_eq!(INNER.of([3.0, 8.0]), 40.0 * U);
        assert_eq!(OUTER.of([2.0, 3.0, 12.0]), 12.0);
        assert_eq!(EQUAL.of([]), 0.0);
        assert_eq!(
            OUTER.text.to_string(),
            "scale × sum + 0.5 × x.max(10.05); scale = , sum = the sum's error U × (n + 2) × size (a sum), n = terms, \
             size = Σ|t|, x = |x|: two of them"
        );
        assert_eq!(EQUAL.text.to_string(), "equal: a copy");
    }
}
