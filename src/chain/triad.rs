//! Holds one value for each of three axes, or for each of the six pairs of different axes.

use core::ops::BitOr;

/// One value for each body axis x, y, z (right-handed).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Triad<T> {
    /// Along body x.
    pub x: T,
    /// Along body y.
    pub y: T,
    /// Along body z.
    pub z: T,
}

impl<T: Copy> Triad<T> {
    /// Applies `f` to the value of each axis.
    #[inline(always)]
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Triad<U> {
        Triad {
            x: f(self.x),
            y: f(self.y),
            z: f(self.z),
        }
    }

    /// From `[x, y, z]`.
    #[inline(always)]
    pub fn from_array([x, y, z]: [T; 3]) -> Self {
        Self { x, y, z }
    }

    /// As `[x, y, z]`.
    #[inline(always)]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }
}

/// Six terms `ij`: gyro i, body axis j ≠ i.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CrossAxis<T> {
    /// Gyro x, axis y.
    pub xy: T,
    /// Gyro x, axis z.
    pub xz: T,
    /// Gyro y, axis x.
    pub yx: T,
    /// Gyro y, axis z.
    pub yz: T,
    /// Gyro z, axis x.
    pub zx: T,
    /// Gyro z, axis y.
    pub zy: T,
}

impl<T: Copy> CrossAxis<T> {
    /// Applies `f` to each term.
    #[inline(always)]
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> CrossAxis<U> {
        CrossAxis {
            xy: f(self.xy),
            xz: f(self.xz),
            yx: f(self.yx),
            yz: f(self.yz),
            zx: f(self.zx),
            zy: f(self.zy),
        }
    }

    /// From `[xy, xz, yx, yz, zx, zy]`.
    #[inline(always)]
    pub fn from_array([xy, xz, yx, yz, zx, zy]: [T; 6]) -> Self {
        Self {
            xy,
            xz,
            yx,
            yz,
            zx,
            zy,
        }
    }

    /// As `[xy, xz, yx, yz, zx, zy]`.
    #[inline(always)]
    pub fn to_array(self) -> [T; 6] {
        [self.xy, self.xz, self.yx, self.yz, self.zx, self.zy]
    }
}

/// True if all three values are zero. Compares word by word: `==` on arrays is a loop of the core library (`memcmp`),
/// which the sampling interrupt must not contain.
#[inline(always)]
pub fn are_zero<T: BitOr<Output = T> + Default + PartialEq>([x, y, z]: [T; 3]) -> bool {
    (x | y | z) == T::default()
}

/// True if two triples are equal, axis by axis; word by word, as [`are_zero`].
#[inline(always)]
pub fn are_equal([ax, ay, az]: [i32; 3], [bx, by, bz]: [i32; 3]) -> bool {
    are_zero([ax ^ bx, ay ^ by, az ^ bz])
}
