//! Limits on errors, as written on the command line.

use std::{fmt, str::FromStr};

use swell_scene::words::shown;

/// Quantity whose error is limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Height of the crest above the still-water level, metres.
    Crest,
    /// Distance that the wave has travelled, metres.
    Front,
    /// Height of the highest water connected to the main body, metres.
    RunUp,
    /// Energy per mass, ½ v² + g h with h above the domain's least corner, m²/s².
    Energy,
    /// Pressure at the scene's probes, Pa.
    Pressure,
    /// Mean of max(0, ρ/ρ0 − 1), compared with rest and not with a finer run.
    Density,
}

impl Quantity {
    /// All quantities with the names used on the command line.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("crest", Self::Crest),
        ("front", Self::Front),
        ("run_up", Self::RunUp),
        ("energy", Self::Energy),
        ("pressure", Self::Pressure),
        ("density", Self::Density),
    ];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Returns the unit that a limit accepts beside the percent sign.
    pub fn unit(self) -> Option<&'static str> {
        match self {
            Self::Crest | Self::Front | Self::RunUp => Some("m"),
            Self::Pressure => Some("Pa"),
            Self::Energy | Self::Density => None,
        }
    }

    /// Returns the title of an axis.
    pub fn title(self) -> &'static str {
        match self {
            Self::Crest => "height of the crest",
            Self::Front => "place of the front",
            Self::RunUp => "run-up",
            Self::Energy => "energy a mass",
            Self::Pressure => "pressure at the probes",
            Self::Density => "density error, mean",
        }
    }
}

/// Largest error allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Relative to the largest value of the reference, or to the rest density for a density error.
    Part(f64),
    /// Absolute, in the unit of the quantity.
    Absolute(f64),
}

/// A limit on an error: `crest=2%`, `front=0.05m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Quantity whose error is limited.
    pub quantity: Quantity,
    /// Largest error allowed.
    pub bound: Bound,
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.quantity.name();
        match self.bound {
            Bound::Part(part) => {
                // 0.07 is not exact in binary: 7.000000000000001 % is not what was typed.
                let percent = (1e12 * 100.0 * part).round() / 1e12;
                write!(f, "{name} {} %", shown(percent))
            }
            Bound::Absolute(value) => {
                let unit = self.quantity.unit().unwrap_or_default();
                write!(f, "{name} {} {unit}", shown(value))
            }
        }
    }
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = Quantity::NAMED.map(|(name, _)| name).join(", ");
        let (name, value) = text.split_once('=').ok_or_else(|| {
            format!(
                "no \"=\" and no value; allowed is NAME=VALUE% or, in its unit, NAME=VALUE, as in \
                 crest=2% or front=0.05m; names: {names}"
            )
        })?;
        let named = Quantity::NAMED
            .into_iter()
            .find(|(known, _)| *known == name);
        let (_, quantity) = named.ok_or_else(|| {
            format!("{name:?} is not an error that is measured; allowed: {names}")
        })?;
        let units = match quantity.unit() {
            None => "%".to_owned(),
            Some(unit) => format!("% or {unit}"),
        };
        let value = value.trim();
        let digits = value
            .find(|c: char| c == '%' || (c.is_alphabetic() && c != 'e' && c != 'E'))
            .unwrap_or(value.len());
        let (number, unit) = (value[..digits].trim(), value[digits..].trim());
        let fault =
            |what: String| format!("{name}: {what}; allowed is a number above 0 with {units}");
        let number: f64 = number
            .parse()
            .map_err(|_| fault(format!("{number:?} is not a number")))?;
        if !(number.is_finite() && number > 0.0) {
            return Err(fault(format!("{} is not a limit", shown(number))));
        }
        let bound = match unit {
            "%" => Bound::Part(number / 100.0),
            "" => return Err(fault(format!("{} has no unit", shown(number)))),
            unit if Some(unit) == quantity.unit() => Bound::Absolute(number),
            unit => return Err(fault(format!("{unit:?} is not one of its units"))),
        };
        Ok(Self { quantity, bound })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_has_a_measure_and_a_unit() {
        let of = |text: &str| text.parse::<Limit>();
        let crest = of("crest=2%").expect("a limit");
        assert_eq!(crest.quantity, Quantity::Crest);
        assert_eq!(crest.bound, Bound::Part(0.02));
        assert_eq!(crest.to_string(), "crest 2 %");
        let front = of("front=5e-2 m").expect("a limit");
        assert_eq!(front.bound, Bound::Absolute(0.05));
        assert_eq!(front.to_string(), "front 0.05 m");
        assert_eq!(
            of("pressure=200Pa").map(|l| l.bound),
            Ok(Bound::Absolute(200.0))
        );
        assert_eq!(
            of("density=0.7%").expect("a limit").to_string(),
            "density 0.7 %"
        );
        for (text, said) in [
            ("crest", "names: crest, front"),
            ("crset=2%", "\"crset\" is not an error"),
            ("crest=2", "crest: 2 has no unit"),
            ("crest=2Pa", "crest: \"Pa\" is not one of its units"),
            ("energy=2m", "energy: \"m\" is not one of its units"),
            ("crest=%", "crest: \"\" is not a number"),
            ("crest=-1%", "crest: -1 is not a limit"),
            ("run_up=0m", "run_up: 0 is not a limit"),
            ("front=infm", "is not"),
        ] {
            let error = of(text).expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
        for (name, quantity) in Quantity::NAMED {
            assert_eq!(quantity.name(), name);
        }
    }
}
