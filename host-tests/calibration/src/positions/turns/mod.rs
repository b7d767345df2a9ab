//! Gyros of a unit that stands still in positions and is turned by hand between them.
//!
//! At a rest a gyro reads its bias and the Earth's rotation; over a turn the integrated gyros carry the direction of gravity
//! from one position to the next, where the accelerometers measure it again (Tedaldi, Pretto and Menegatti 2014, sec. III-B;
//! Shin and El-Sheimy 2002). In the order of the data: [`readings`] (means of the rests, rows of the turns) → [`prediction`]
//! (direction carried by the gyros, with its derivatives) → [`fit`] (weighted least squares with a scatter of its own for
//! rests and for turns) → [`findings`].
//!
//! The axes are those of the accelerometers: a common rotation of both triads against the case is not observable.

pub mod readings;

pub mod prediction;

pub mod fit;

pub mod findings;
