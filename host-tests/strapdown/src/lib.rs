//! Strapdown inertial navigation: increments of a unit in, attitude, velocity and position out.
//!
//! # Conventions
//! | | |
//! |---|---|
//! | body frame b | right-handed, x y z; forward, right, down where angles are named |
//! | local level frame n | north, east, down (NED), at the unit, turning with Earth and transport rate |
//! | attitude | unit quaternion `ned_from_body`; heading, pitch, roll about z, y, x in that order |
//! | velocity | relative to the Earth, in n \[m/s\] |
//! | position | geodetic latitude and longitude \[rad\], height over the WGS-84 ellipsoid \[m\] |
//! | rotation vector | of the body over a period, seen in the body frame at its beginning \[rad\] |
//!
//! # The data flow
//! ```text
//! increments ─ alignment ─▶ attitude at the start ┐
//! increments ─────────────────────────────────────┴▶ mechanisation ─▶ attitude, velocity, position
//!                           earth (radii, gravity, rates) ┘ └ vertical (height aid)
//! ```
//! Source of the equations: P. D. Groves, *Principles of GNSS, Inertial, and Multisensor Integrated
//! Navigation Systems*, 2nd ed. 2013, chapters 2 and 5; NIMA TR8350.2 for the Earth.
//!
//! # Outside its scope
//! Coning and sculling (the increments come corrected, as the firmware's chain gives them), navigation
//! within a degree of the poles (longitude has no rate there), filters, aids other than a height.

pub mod alignment;
pub mod attitude;
pub mod earth;
pub mod mechanisation;
pub mod vertical;

pub use alignment::{Alignment, AlignmentError, align, level};
pub use attitude::EulerAngles;
pub use mechanisation::{Increment, Navigator, Solution};
pub use vertical::VerticalChannel;
