//! Tables of keys with their types: one declaration of a key gives the field that it is read into
//! and written from, and its [`Key`] for validation, messages and the page of keys.

use super::key::Key;

/// What a table of a file is read into and written from.
pub(super) trait Keyed {
    /// Keys of the table in the order in which they are written.
    const KEYS: &'static [Key];
}

impl<T: Keyed> Keyed for Option<T> {
    const KEYS: &'static [Key] = T::KEYS;
}

impl<T: Keyed> Keyed for Vec<T> {
    const KEYS: &'static [Key] = T::KEYS;
}

/// Declares the keys of a table.
///
/// ```text
/// keys! { struct WaterSpec {
///     rest_density: f64 = number(0.01..=1e5).unit("kg/m³").default("1000.0").about("at rest"),
///     gravity: [f64; 3] = acceleration,
///     #[serde(default)]
///     block: Vec<BoxSpec> = tables().about("A box full of water"),
/// } }
/// ```
///
/// A key has a name, the type of its field, a constructor of [`Key`] and its builder methods.
/// `table()`, `inline()` and `tables()` take the keys below from the type. A name without
/// parentheses is a function of the key's name, for a key that several tables have.
///
/// `struct` defines the type. `fields of` takes a type of `swell-scene` that is itself what a scene
/// holds, and does not compile unless the keys are its fields.
macro_rules! keys {
    ($(#[$meta:meta])* struct $table:ident { $(
        $(#[$attribute:meta])*
        $name:ident: $type:ty = $make:ident $(($($arg:tt)*))? $(.$with:ident($($more:tt)*))*,
    )+ }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, serde::Deserialize, serde::Serialize)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $table {
            $($(#[$attribute])* pub(crate) $name: $type,)+
        }

        impl $crate::declare::Keyed for $table {
            const KEYS: &'static [$crate::key::Key] = &[$(
                $crate::declare::keys!(@key $name, $type, $make $(($($arg)*))?)
                    $(.$with($($more)*))*
            ),+];
        }
    };
    (fields of $table:ident { $(
        $name:ident: $type:ty = $make:ident $(($($arg:tt)*))? $(.$with:ident($($more:tt)*))*,
    )+ }) => {
        impl $crate::declare::Keyed for $table {
            const KEYS: &'static [$crate::key::Key] = &[$(
                $crate::declare::keys!(@key $name, $type, $make $(($($arg)*))?)
                    $(.$with($($more)*))*
            ),+];
        }

        const _: fn($table) = |$table { $($name),+ }| {
            $(let _: $type = $name;)+
        };
    };
    (@key $name:ident, $type:ty, table()) => {
        $crate::key::Key::table(stringify!($name), <$type as $crate::declare::Keyed>::KEYS)
    };
    (@key $name:ident, $type:ty, inline()) => {
        $crate::key::Key::inline(stringify!($name), <$type as $crate::declare::Keyed>::KEYS)
    };
    (@key $name:ident, $type:ty, tables()) => {
        $crate::key::Key::tables(stringify!($name), <$type as $crate::declare::Keyed>::KEYS)
    };
    (@key $name:ident, $type:ty, $make:ident($($arg:tt)*)) => {
        $crate::key::Key::$make(stringify!($name), $($arg)*)
    };
    (@key $name:ident, $type:ty, $make:ident) => {
        $make(stringify!($name))
    };
}
pub(super) use keys;
