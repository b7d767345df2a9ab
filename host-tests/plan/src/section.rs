//! Sections of the tree: structures whose numbers can be visited by name.

use crate::number::{Entry, Slots};

/// Facts of a field, from its declaration.
#[derive(Debug, Clone, Copy)]
pub struct Facts {
    /// Unit.
    pub unit: &'static str,
    /// Smallest and largest permitted value.
    pub range: [f64; 2],
    /// Documentation.
    pub doc: &'static str,
}

/// A field of a section: a number, a list of numbers, or a section.
pub trait Field {
    /// Calls `visitor` for each number below this field, in the order of declaration.
    fn walk(&mut self, name: &str, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>));
}

/// Calls `visitor` for the number `name`.
fn give(name: &str, slots: Slots<'_>, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>)) {
    visitor(Entry {
        name: name.to_owned(),
        slots,
        unit: facts.unit,
        range: facts.range,
        doc: facts.doc,
    });
}

impl Field for f64 {
    fn walk(&mut self, name: &str, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>)) {
        give(
            name,
            Slots::Reals(std::slice::from_mut(self)),
            facts,
            visitor,
        );
    }
}

impl Field for usize {
    fn walk(&mut self, name: &str, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>)) {
        give(
            name,
            Slots::Counts(std::slice::from_mut(self)),
            facts,
            visitor,
        );
    }
}

impl<const N: usize> Field for [f64; N] {
    fn walk(&mut self, name: &str, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>)) {
        give(name, Slots::Reals(self), facts, visitor);
    }
}

impl<const N: usize> Field for [usize; N] {
    fn walk(&mut self, name: &str, facts: Facts, visitor: &mut dyn FnMut(Entry<'_>)) {
        give(name, Slots::Counts(self), facts, visitor);
    }
}

/// Declares a section: `name: type = default, "unit", [smallest, largest];` for a number, `name: Section;` for a section.
macro_rules! section {
    (
        $(#[$about:meta])*
        $section:ident {
            $(
                $(#[doc = $doc:literal])+
                $name:ident: $of:ty $(= $value:expr, $unit:literal, $range:expr)?;
            )*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $section {
            $(
                $(#[doc = $doc])+
                $(#[doc = concat!("\nUnit: ", $unit, ".")])?
                pub $name: $of,
            )*
        }

        impl Default for $section {
            fn default() -> Self {
                Self { $($name: $crate::section::section!(@value $of $(, $value)?),)* }
            }
        }

        impl $crate::section::Field for $section {
            fn walk(
                &mut self,
                name: &str,
                _: $crate::section::Facts,
                visitor: &mut dyn FnMut($crate::number::Entry<'_>),
            ) {
                $({
                    let path = match name {
                        "" => stringify!($name).to_owned(),
                        outer => format!("{outer}.{}", stringify!($name)),
                    };
                    let facts = $crate::section::section!(@facts concat!($($doc),+) $(, $unit, $range)?);
                    self.$name.walk(&path, facts, visitor);
                })*
            }
        }
    };
    (@value $of:ty, $value:expr) => { $value };
    (@value $of:ty) => { <$of>::default() };
    (@facts $doc:expr, $unit:literal, $range:expr) => {
        $crate::section::Facts { unit: $unit, range: $range, doc: $doc }
    };
    (@facts $doc:expr) => {
        $crate::section::Facts { unit: "", range: [0.0; 2], doc: $doc }
    };
}

pub(crate) use section;
