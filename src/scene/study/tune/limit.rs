//! Errors that have to be held, as a command line says them.

use std::{fmt, str::FromStr};

use super::super::super::words::shown;

/// What an error is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Height of the crest above the still level, metres.
    Crest,
    /// How far the wave has come, metres.
    Front,
    /// Height of the highest water that hangs together with the body, metres.
    RunUp,
    /// ½ v² + g h a mass over the domain's least corner, m²/s².
    Energy,
    /// At the scene's probes of pressure, Pa.
    Pressure,
    /// Mean of max(0, ρ/ρ0 − 1); held against rest, not against a finer run.
    Density,
}

impl Quantity {
    /// With the names of the command line.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("crest", Self::Crest),
        ("front", Self::Front),
        ("run_up", Self::RunUp),
        ("energy", Self::Energy),
        ("pressure", Self::Pressure),
        ("density", Self::Density),
    ];

    /// As the command line names it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Units of a limit beside the per cent.
    pub fn unit(self) -> Option<&'static str> {
        match self {
            Self::Crest | Self::Front | Self::RunUp => Some("m"),
            Self::Pressure => Some("Pa"),
            Self::Energy | Self::Density => None,
        }
    }

    /// In words, for an axis.
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

/// How much of an error is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// A part of the greatest value of the reference; of a density error a part of rest density.
    Part(f64),
    /// In the quantity's unit.
    Absolute(f64),
}

/// An error that has to be held: `crest=2%`, `front=0.05m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Of what.
    pub quantity: Quantity,
    /// How much.
    pub bound: Bound,
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.quantity.name();
        match self.bound {
            Bound::Part(part) => {
                // 0.07 is no sum of powers of two: 7.000000000000001 % is not what was typed.
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
            format!("no \"=\" and no value; allowed is NAME=VALUE% or, in its unit, NAME=VALUE, as in crest=2% or front=0.05m; names: {names}")
        })?;
        let named = Quantity::NAMED
            .into_iter()
            .find(|(known, _)| *known == name);
        let (_, quantity) = named
            .ok_or_else(|| format!("{name:?} is no error that is measured; allowed: {names}"))?;
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
            .map_err(|_| fault(format!("{number:?} is no number")))?;
        if !(number.is_finite() && number > 0.0) {
            return Err(fault(format!("{} is no limit", shown(number))));
        }
        let bound = match unit {
            "%" => Bound::Part(number / 100.0),
            "" => return Err(fault(format!("{} has no unit", shown(number)))),
            unit if Some(unit) == quantity.unit() => Bound::Absolute(number),
            unit => return Err(fault(format!("{unit:?} is no unit of it"))),
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
            ("crset=2%", "\"crset\" is no error"),
            ("crest=2", "crest: 2 has no unit"),
            ("crest=2Pa", "crest: \"Pa\" is no unit of it"),
            ("energy=2m", "energy: \"m\" is no unit of it"),
            ("crest=%", "crest: \"\" is no number"),
            ("crest=-1%", "crest: -1 is no limit"),
            ("run_up=0m", "run_up: 0 is no limit"),
            ("front=infm", "is no"),
        ] {
            let error = of(text).expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
        for (name, quantity) in Quantity::NAMED {
            assert_eq!(quantity.name(), name);
        }
    }
}
