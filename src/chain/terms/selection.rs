//! Chooses one term of a list, for builds that measure the cost of each alone.

/// A list of terms of which one can be chosen by its place; [`EVERY_TERM`] stands for all.
pub trait Select<const PLACE: usize> {
    /// The term at that place.
    type Term;
}

/// The place that stands for the whole list.
pub const EVERY_TERM: usize = usize::MAX;

/// Parses the place of a build, a decimal number; [`EVERY_TERM`] without one.
///
/// # Panics
/// At compile time, where it is no number.
pub const fn place(asked: Option<&str>) -> usize {
    match asked {
        None => EVERY_TERM,
        Some(digits) => match usize::from_str_radix(digits, 10) {
            Ok(place) => place,
            Err(_) => panic!("the place of a term is no number"),
        },
    }
}

macro_rules! select {
    ($($term:ident $place:tt),+) => {
        impl<$($term),+> Select<EVERY_TERM> for ($($term,)+) {
            type Term = Self;
        }
        select!(@each ($($term),+) $($term $place),+);
    };
    (@each $all:tt $($term:ident $place:tt),+) => {
        $(select!(@one $all $term $place);)+
    };
    (@one ($($all:ident),+) $term:ident $place:tt) => {
        impl<$($all),+> Select<$place> for ($($all,)+) {
            type Term = ($term,);
        }
    };
}

select!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11);
