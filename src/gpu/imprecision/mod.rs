//! Computes as imprecisely as Vulkan permits, to show what a result owes to a precise device.
//!
//! Operations of a pass's module are replaced with calls of the functions in `functions.wgsl`.
//! Errors are a hash of the result's bits and a seed, so runs are deterministic. f64 stays exact.

mod call;
mod rewrite;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::{self, Write},
    str::FromStr,
};

use naga::{Function, Handle, Module};

use super::{error::GpuError, reflect::validated};
use call::Call;
use rewrite::rewrite;

const FUNCTIONS: &str = include_str!("functions.wgsl");

/// Largest errors of a device's arithmetic. An operation whose error is 0 is left as the device
/// computes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imprecision {
    /// Chooses the errors.
    pub seed: u32,
    /// Error of a quotient, ulps.
    pub division: f32,
    /// Error of a square root, ulps.
    pub square_root: f32,
    /// Error of an inverse square root, ulps.
    pub inverse_square_root: f32,
    /// Error of a length or distance, ulps.
    pub length: f32,
    /// Error of exponentials and logarithms, ulps beyond those of the device; exponentials of x
    /// have 2 |x| more, and logarithms of 0.5 to 2 an absolute error of 2⁻²¹ instead. A power
    /// x^y is computed as 2^(y log₂ x).
    pub exponential: f32,
    /// Absolute error of sine and cosine beyond that of the device.
    pub sine: f32,
    /// Share of the sums with a product that are rounded only once, as by fused multiply-add.
    pub contraction: f32,
    /// Whether subnormal numbers become 0, when they are read from a buffer and as a result.
    pub flushes: bool,
}

/// A name that is no profile of imprecision.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` is no profile of imprecision; there is vulkan-worst, or vulkan-worst:SEED")]
pub struct UnknownProfile(String);

impl FromStr for Imprecision {
    type Err = UnknownProfile;

    fn from_str(text: &str) -> Result<Self, UnknownProfile> {
        let unknown = || UnknownProfile(text.to_owned());
        let (name, seed) = text.split_once(':').unwrap_or((text, "1"));
        match name {
            "vulkan-worst" => seed.parse().map(Self::vulkan_worst).map_err(|_| unknown()),
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for Imprecision {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self == Self::vulkan_worst(self.seed) {
            true => write!(out, "vulkan-worst:{}", self.seed),
            false => write!(out, "{self:?}"),
        }
    }
}

impl Imprecision {
    /// No error.
    pub const NONE: Self = Self {
        seed: 0,
        division: 0.0,
        square_root: 0.0,
        inverse_square_root: 0.0,
        length: 0.0,
        exponential: 0.0,
        sine: 0.0,
        contraction: 0.0,
        flushes: false,
    };

    /// What the Vulkan specification permits ("Precision and Operation of SPIR-V Instructions").
    /// It leaves sums and products correctly rounded. A square root may be 1 / inverseSqrt: 2 ulp
    /// of that are up to 4 of the root, and the division adds 2.5. The `dot` of a length adds 1.5.
    pub fn vulkan_worst(seed: u32) -> Self {
        Self {
            seed,
            division: 2.5,
            square_root: 6.5,
            inverse_square_root: 2.0,
            length: 8.0,
            exponential: 3.0,
            sine: 1.0 / 2048.0,
            contraction: 0.75,
            flushes: true,
        }
    }

    /// Parses the WGSL text of pass `name` and replaces its operations.
    ///
    /// # Errors
    /// [`GpuError::Shader`].
    pub(super) fn applied(&self, name: &str, text: &str) -> Result<Module, GpuError> {
        let line = |line| format!("line {line}");
        let (mut module, info) = validated(name, text, &line)?;
        let mut wanted = BTreeSet::new();
        rewrite(self, name, &mut module, &info, &mut |call| {
            wanted.insert(call);
            None
        });
        // The functions go first: a function can call only those before it.
        let text = self.functions(&wanted) + text;
        let (mut module, info) = validated(name, &text, &line)?;
        let functions = module.functions.iter();
        let functions: BTreeMap<String, Handle<Function>> = functions
            .filter_map(|(handle, function)| Some((function.name.clone()?, handle)))
            .collect();
        rewrite(self, name, &mut module, &info, &mut |call| {
            functions.get(&call.name()).copied()
        });
        Ok(module)
    }

    /// Text of the constants and functions, with a version for each shape that is wanted.
    fn functions(&self, wanted: &BTreeSet<Call>) -> String {
        let seed = (self.seed.wrapping_mul(0x85eb_ca6b)).wrapping_add(0x0123_4567);
        let mut text = format!(
            "const IMPRECISE_SEED = {seed}u;\nconst IMPRECISE_FLUSHES = {};\n",
            self.flushes
        );
        for (name, value) in [
            ("DIVIDE", self.division),
            ("SQRT", self.square_root),
            ("INVERSE_SQRT", self.inverse_square_root),
            ("LENGTH", self.length),
            ("EXP", self.exponential),
            ("SIN", self.sine),
        ] {
            let _ = writeln!(text, "const IMPRECISE_{name}: f32 = {value:?};");
        }
        text += FUNCTIONS;
        text.extend(wanted.iter().map(Call::declaration));
        text
    }
}

#[cfg(test)]
mod tests {
    use naga::Expression;

    use super::{
        super::{reflect::validator, variants::forms},
        call::PREFIX,
        *,
    };

    /// Calls of this module's functions from a pass's own, by name.
    fn calls(profile: &Imprecision, name: &str, text: &str) -> Vec<String> {
        let module = profile
            .applied(name, text)
            .expect("the functions are valid");
        if let Err(error) = validator().validate(&module) {
            panic!("{name}: {}", error.emit_to_string(text));
        }
        let called = |function: &Function| -> Vec<String> {
            let results = function.expressions.iter().filter_map(|(_, it)| match it {
                Expression::CallResult(called) => module.functions[*called].name.clone(),
                _ => None,
            });
            results.filter(|name| name.starts_with(PREFIX)).collect()
        };
        let functions = module.functions.iter().map(|(_, function)| function);
        let own = functions.filter(|it| !it.name.as_deref().unwrap_or("").starts_with(PREFIX));
        let entries = module.entry_points.iter().map(|entry| &entry.function);
        own.chain(entries).flat_map(called).collect()
    }

    #[test]
    fn every_pass_is_valid_when_it_is_imprecise() {
        let mut replaced = 0;
        for form in forms().expect("they compose") {
            let (name, text) = (&form.pass, &form.text);
            replaced += calls(&Imprecision::vulkan_worst(1), name, text).len();
            assert_eq!(calls(&Imprecision::NONE, name, text), [""; 0], "{name}");
        }
        assert!(replaced > 3000, "{replaced}");
    }

    #[test]
    fn each_operation_is_replaced_unless_the_host_computes_it() {
        let pass = |body: &str| {
            format!(
                "@group(0) @binding(0) var<storage, read_write> values: array<vec4f>;\n\
                 @group(0) @binding(1) var<storage, read_write> wide: array<f64>;\n\
                 override size: f32 = 3.0;\n\
                 @compute @workgroup_size(1) fn main() {{\n\
                 let x = values[1].x;\nlet v = values[2];\nlet k = u32(x);\n{body}\n}}\n"
            )
        };
        let all = Imprecision {
            contraction: 1.0,
            ..Imprecision::vulkan_worst(1)
        };
        // What is called beyond the two loads, without the numbers of components.
        let found = |body: &str| {
            let mut found = calls(&all, "pass", &pass(body));
            found.retain(|name| !name.starts_with("imprecise_flush"));
            let shape = |c: char| c == '_' || c.is_ascii_digit();
            let what = |name: &String| name.trim_end_matches(shape)[PREFIX.len()..].to_owned();
            let mut what: Vec<String> = found.iter().map(what).collect();
            what.sort();
            what
        };
        assert_eq!(calls(&all, "pass", &pass("")).len(), 2);
        for (body, expected) in [
            ("values[0].x = x / 3.0;", &["divide"][..]),
            ("values[0] = v / 3.0;", &["divide"]),
            ("values[0] = v * x - v;", &["fused_less", "multiply"]),
            (
                "let p = x * x;\nvalues[0].x = 2.0 - p;",
                &["less_fused", "multiply"],
            ),
            ("values[0].x = dot(v.xyz, v.xyz);", &["dot"]),
            ("values[0].x = length(v);", &["length"]),
            ("values[0] = mix(v, v, x);", &["mix"]),
            // What the host computes, integers and f64.
            ("values[0].x = size / 3.0;", &[]),
            ("let third = 1.0 / 3.0;\nvalues[0].x = third;", &[]),
            ("values[0].x = f32(k / 3u);", &[]),
            ("wide[0] = wide[1] / 3.0lf;", &[]),
        ] {
            assert_eq!(found(body), expected, "{body}");
        }
    }
}
