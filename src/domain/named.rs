//! Values that files refer to by name.

/// Implements `Deserialize` and `Serialize` by the names in the type's `NAMED` table.
#[doc(hidden)]
#[macro_export]
macro_rules! read_by_name {
    ($type:ty) => {
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let word = <String as serde::Deserialize>::deserialize(deserializer)?;
                let mut named = Self::NAMED.iter();
                let found = named.find(|(name, _)| *name == word);
                let unknown = || serde::de::Error::custom(format!("{word:?} is no name here"));
                found.map(|(_, value)| *value).ok_or_else(unknown)
            }
        }

        impl serde::Serialize for $type {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }
    };
}
pub use crate::read_by_name;
