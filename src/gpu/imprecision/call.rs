//! Functions that stand for operations, for scalars and vectors.

/// A call of one of the functions, for arguments with these numbers of components.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Call {
    pub(super) what: &'static str,
    pub(super) sizes: Vec<usize>,
}

/// Begins the name of each function.
pub(super) const PREFIX: &str = "imprecise_";
const ARGUMENTS: [&str; 3] = ["a", "b", "c"];
const COMPONENTS: [&str; 4] = ["x", "y", "z", "w"];

impl Call {
    pub(super) fn name(&self) -> String {
        let sizes = self.sizes.iter().filter(|_| !self.is_scalar());
        let sizes: String = sizes.map(|size| format!("_{size}")).collect();
        format!("{PREFIX}{}{sizes}", self.what)
    }

    fn is_scalar(&self) -> bool {
        self.sizes.iter().all(|&size| size == 1)
    }

    /// Text of the version for vectors; empty for scalars, which have theirs.
    pub(super) fn declaration(&self) -> String {
        if self.is_scalar() {
            return String::new();
        }
        let arguments = ARGUMENTS.iter().zip(&self.sizes);
        let declared: Vec<String> = arguments
            .map(|(name, &size)| format!("{name}: {}", ty(size)))
            .collect();
        let (size, value) = self.value();
        format!(
            "fn {}({}) -> {} {{ return {value}; }}\n",
            self.name(),
            declared.join(", "),
            ty(size)
        )
    }

    /// Number of components of the result, and its expression.
    fn value(&self) -> (usize, String) {
        let size = self.sizes.iter().max().copied().unwrap_or(1);
        let components = &COMPONENTS[..size];
        match self.what {
            "dot" => (1, format!("{PREFIX}flush({})", dot(components, "b"))),
            "length" => (1, length(components, |c| format!("a.{c}"))),
            "distance" => (1, length(components, |c| format!("(a.{c} - b.{c})"))),
            "normalize" => (
                size,
                format!("a * {PREFIX}inverse_sqrt({})", dot(components, "a")),
            ),
            "cross" => {
                let component =
                    |[y, z]: [&str; 2]| format!("{PREFIX}fused_less(a.{y}, b.{z}, a.{z} * b.{y})");
                let components = [["y", "z"], ["z", "x"], ["x", "y"]].map(component);
                (size, format!("vec3f({})", components.join(", ")))
            }
            _ => {
                let components: Vec<String> =
                    components.iter().map(|c| self.component(c)).collect();
                (size, format!("{}({})", ty(size), components.join(", ")))
            }
        }
    }

    /// Call of the version for scalars with a component of each vector.
    fn component(&self, c: &str) -> String {
        let of = |(name, &size): (&&str, &usize)| match size {
            1 => (*name).to_owned(),
            _ => format!("{name}.{c}"),
        };
        let of: Vec<String> = ARGUMENTS.iter().zip(&self.sizes).map(of).collect();
        format!("{PREFIX}{}({})", self.what, of.join(", "))
    }
}

fn ty(size: usize) -> String {
    match size {
        1 => "f32".to_owned(),
        size => format!("vec{size}f"),
    }
}

/// a · b as a chain of fused multiply-adds.
fn dot(components: &[&str], b: &str) -> String {
    let (first, rest) = (components[0], &components[1..]);
    let add = |sum: String, c: &&str| format!("{PREFIX}fused(a.{c}, {b}.{c}, {sum})");
    rest.iter().fold(format!("a.{first} * {b}.{first}"), add)
}

/// Length of a vector with these components.
fn length(components: &[&str], of: impl Fn(&str) -> String) -> String {
    let square = |c: &&str| format!("f64({0}) * f64({0})", of(c));
    let squares: Vec<String> = components.iter().map(square).collect();
    let sum = squares.join(" + ");
    format!("{PREFIX}round(sqrt({sum}), IMPRECISE_LENGTH)")
}
