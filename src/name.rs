//! Things by their names in files and on the command line.

/// A value for each of several names, in their order.
#[cfg(feature = "fit")]
pub(crate) type ByName<T> = indexmap::IndexMap<String, T>;

/// A name that is unknown for its kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{name}\" is no {kind}; expected one of {}", known.join(", "))]
pub struct UnknownName {
    /// The kind, such as "fidelity".
    pub kind: &'static str,
    /// The name.
    pub name: String,
    /// The names of this kind.
    pub known: Vec<&'static str>,
}

/// Returns the thing that has a name; of several names of a thing the first is what is expected.
pub(crate) fn named<T: Copy, const N: usize>(
    kind: &'static str,
    all: &[T],
    names: fn(T) -> [&'static str; N],
    name: &str,
) -> Result<T, UnknownName> {
    let known = all.iter().copied().find(|one| names(*one).contains(&name));
    known.ok_or_else(|| UnknownName {
        kind,
        name: name.to_owned(),
        known: all.iter().filter_map(|one| names(*one).first().copied()).collect(),
    })
}

/// Implements `FromStr` by names.
macro_rules! by_name {
    ($thing:ty, $kind:literal, $all:ident, $($name:ident),+) => {
        impl std::str::FromStr for $thing {
            type Err = $crate::name::UnknownName;

            fn from_str(name: &str) -> Result<Self, Self::Err> {
                $crate::name::named($kind, &Self::$all, |one| [$(one.$name()),+], name)
            }
        }
    };
}
pub(crate) use by_name;

/// Defines an enum whose variants have texts beside them, and a function for each text, in order.
macro_rules! worded {
    (
        $(#[$about:meta])*
        $vis:vis enum $thing:ident { $($(#[$variant_about:meta])* $variant:ident = $($text:literal)|+,)+ }
        $($(#[$function_about:meta])* $function_vis:vis fn $function:ident;)+
    ) => {
        $(#[$about])*
        $vis enum $thing { $($(#[$variant_about])* $variant),+ }

        const _: () = {
            #[allow(non_camel_case_types)] // named as its function
            enum Column { $($function),+ }

            const COLUMNS: usize = [$(stringify!($function)),+].len();
            const TEXTS: [[&str; COLUMNS]; $thing::ALL.len()] = [$([$($text),+]),+];

            impl $thing {
                /// All variants, in this order.
                $vis const ALL: [Self; [$(stringify!($variant)),+].len()] = [$(Self::$variant),+];

                $(
                    $(#[$function_about])*
                    $function_vis fn $function(self) -> &'static str {
                        TEXTS[self as usize][Column::$function as usize]
                    }
                )+
            }
        };
    };
}
pub(crate) use worded;
