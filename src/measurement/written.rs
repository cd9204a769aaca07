//! JSON of results: enums by their names.

use super::loss::Loss;
use super::parameter::Parameter;
use crate::physics::collision::Fidelity;

/// Writes enums by their names, which are all that their schemas allow.
macro_rules! written_by_name {
    ($($thing:ty),+) => {$(
        impl serde::Serialize for $thing {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }

        impl schemars::JsonSchema for $thing {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($thing).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "type": "string", "enum": <$thing>::ALL.map(<$thing>::name) })
            }
        }
    )+};
}
pub(crate) use written_by_name;

written_by_name!(Parameter, Loss, Fidelity);
