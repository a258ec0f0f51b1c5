//! Effects that a scene may name under `[effects]`: one word in a list, and a file in each room.
//!
//! An effect's file here holds its settings and what they may be. What it adds to each solver stands in a file of the
//! same name in `solve::effects`, its f64 twins in `reference`, and what holds the two against each other in `check`.

/// What an effect's settings say of themselves.
pub(super) trait Effect {
    /// The first setting that is out of its range: key, its value, and what is allowed.
    fn fault(&self) -> Option<(&'static str, f64, &'static str)>;

    /// Part of the velocity that a frame of FLIP takes from the grid for it.
    fn blend(&self) -> f64 {
        0.0
    }
}

/// Gives the list of effects, in the order in which they act, to a macro.
macro_rules! with_effects {
    ($callback:ident) => {
        $callback!(viscosity, vorticity_confinement);
    };
}
pub(crate) use with_effects;

macro_rules! effects {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// The effects that a scene names; what is `None` does not exist.
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Effects {
            $(
                #[doc = concat!("`effects.", stringify!($name), "`.")]
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub $name: Option<$name::Settings>,
            )+
        }

        impl Effects {
            /// Keys of all effects.
            pub const NAMES: &[&str] = &[$(stringify!($name)),+];

            /// Part of the velocity that a frame of FLIP takes from the grid, of each of the named effects.
            pub(super) fn blends(&self) -> Vec<f64> {
                let mut blends = Vec::new();
                $(blends.extend(self.$name.as_ref().map(Effect::blend));)+
                blends
            }

            /// The first setting that is out of its range: dotted key, its value, and what is allowed.
            pub fn fault(&self) -> Option<(String, f64, &'static str)> {
                $(
                    if let Some((key, value, allowed)) = self.$name.as_ref().and_then(Effect::fault) {
                        return Some((format!("effects.{}.{key}", stringify!($name)), value, allowed));
                    }
                )+
                None
            }
        }
    };
}

with_effects!(effects);
