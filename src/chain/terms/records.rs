//! Holds the numbers of optional terms as records: a kind and its values.
//!
//! Records stand in the parameter block one after another, little-endian:
//!
//! | bytes | holds |
//! |---|---|
//! | 2 | `u16` kind, a row of [`TermKind`] |
//! | 2 | `u16` bytes of the values |
//! | 8 each | `f64` values, SI units, in the order that the kind documents |
//!
//! A record of a kind that this library does not know, of another length than the kind's, or of a kind that was there
//! before is an error. Ranges are the terms' own ([`Term::new`](crate::terms::Term::new)).

use core::fmt;

/// Room for records in a parameter block \[bytes\]: every kind once; none without the feature `terms`, so that firmware
/// without terms does not carry it through its boot. A record is then refused by its kind.
pub const RECORD_BYTES: usize = if cfg!(feature = "terms") { 1088 } else { 0 };

/// Bytes of a record before its values.
const HEADER_BYTES: usize = 4;

macro_rules! term_kinds {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal, $count:literal;)+) => {
        /// Kinds of records. Numbers and lengths are fixed; kinds may be added. Axes x, y, z.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u16)]
        #[non_exhaustive]
        pub enum TermKind {
            $($(#[$doc])* $name = $number,)+
        }

        impl TermKind {
            /// Every kind, by its number.
            pub const ALL: &'static [Self] = &[$(Self::$name),+];

            /// The kind of this number, if it is one.
            pub const fn from_number(number: u16) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)+
                    _ => None,
                }
            }

            /// The name in models and messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
                }
            }

            /// Values in a record.
            pub const fn values(self) -> usize {
                match self {
                    $(Self::$name => $count,)+
                }
            }
        }
    };
}

term_kinds! {
    /// T₀ ×3 \[K\], c ×3 \[rad/s/K\], c₂ ×3 \[rad/s/K²\]: gyro i reads c_i (T_i − T₀_i) + c₂_i (T_i − T₀_i)² more. A
    /// T₀ of 0 stands for the first temperature after start.
    GyroBiasTemperature = 1, "gyro_bias_temperature", 9;
    /// r ×3 \[rad/K\]: gyro i reads r_i dT_i/dt more.
    GyroBiasTemperatureRate = 2, "gyro_bias_temperature_rate", 3;
    /// T₀ ×3 \[K\], s ×3 \[1/K\], s₂ ×3 \[1/K²\]: gyro i reads (1 + s_i (T_i − T₀_i) + s₂_i (T_i − T₀_i)²) times its rate.
    GyroScaleTemperature = 3, "gyro_scale_temperature", 9;
    /// T₀ ×3 \[K\], c ×6 \[rad/K\], c₂ ×6 \[rad/K²\]: δ_ij = c_ij (T_i − T₀_i) + c₂_ij (T_i − T₀_i)².
    InstallationTemperature = 4, "installation_temperature", 15;
    /// d ×3 \[s\]: gyro i reads ω_i(t − d_i).
    GyroDelay = 5, "gyro_delay", 3;
    /// v ×3 \[s²\]: gyro i reads ω_i + (v_i/2) d²ω_i/dt².
    GyroBandwidth = 6, "gyro_bandwidth", 3;
    /// d ×3 \[s\]: accelerometer i reads f_i(t − d_i).
    AccelDelay = 7, "accel_delay", 3;
    /// a ×3 \[1\]: gyro i reads a_i |ω_i| more.
    GyroScaleAsymmetry = 8, "gyro_scale_asymmetry", 3;
    /// q ×3 \[s/rad\]: gyro i reads q_i ω_i² more.
    GyroScaleQuadratic = 9, "gyro_scale_quadratic", 3;
    /// q ×3 \[s²/rad²\]: gyro i reads q_i ω_i³ more.
    GyroScaleCubic = 10, "gyro_scale_cubic", 3;
    /// G ×9, rows \[rad/s per m/s²\]: gyro i reads Σ G_ij f_j more.
    GyroGBias = 11, "gyro_g_bias", 9;
    /// τ ×6 \[rad per m/s²\]: δ_ij = τ_ij f_k, k the third axis.
    AxisTiltByForce = 12, "axis_tilt_by_force", 6;
    /// g ×3 \[rad/s per (m/s²)²\]: gyro i reads g_i f_i² more.
    GyroG2Bias = 13, "gyro_g2_bias", 3;
    /// q ×3 \[s²/m\]: accelerometer i reads q_i f_i² more.
    AccelQuadratic = 14, "accel_quadratic", 3;
    /// U ×9, rows \[rad per m/s²\]: gyro i reads Σ U_ij df_j/dt more.
    ElasticRateByForce = 15, "elastic_rate_by_force", 9;
    /// W ×9, rows \[s²\]: gyro i reads Σ W_ij d²ω_j/dt² more.
    ElasticRateByJerk = 16, "elastic_rate_by_jerk", 9;
    /// c ×3 \[1/rad²\]: block i turns by c_i p_i³ more than the pickoff's angle p_i.
    DitherCubic = 17, "dither_cubic", 3;
    /// c ×6 \[1\]: gyro i reads c_ij times the rate of block j relative to the case more.
    DitherCrosstalk = 18, "dither_crosstalk", 6;
    /// Q ×6 \[s⁶/rad²\]: δ_ij = −Q_ij α_j³.
    AxisFlexureCubic = 19, "axis_flexure_cubic", 6;
    /// K ×6 \[s²\], frequency \[Hz\], damping \[1\]: δ_ij″ + 2ζΩ₀ δ_ij′ + Ω₀² δ_ij = −Ω₀² K_ij α_j.
    AxisFlexureMode = 20, "axis_flexure_mode", 8;
    /// c ×9, rows \[rad/s/T\]: gyro i reads Σ c_ij B_j more.
    GyroBiasMagnetic = 21, "gyro_bias_magnetic", 9;
}

impl fmt::Display for TermKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of kinds: the bit of a kind is its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TermKinds(u32);

impl TermKinds {
    /// No kind.
    pub const NONE: Self = Self(0);

    /// These kinds.
    pub const fn of(kinds: &[TermKind]) -> Self {
        let mut bits = 0;
        let mut rest = kinds;
        while let [kind, others @ ..] = rest {
            bits |= 1 << *kind as u32;
            rest = others;
        }
        Self(bits)
    }

    /// The kinds that are in either.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// True if the kind is in the set.
    pub const fn contains(self, kind: TermKind) -> bool {
        self.0 >> kind as u32 & 1 != 0
    }

    /// The set of such a word; bits of no kind are kept.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The set as a word; bit n is kind n.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Returns the first kind of this set that is not in `other`.
    pub fn first_beyond(self, other: Self) -> Option<TermKind> {
        let mut kinds = TermKind::ALL.iter();
        let beyond = |kind: &&TermKind| self.contains(**kind) && !other.contains(**kind);
        kinds.find(beyond).copied()
    }
}

/// Reason that bytes are not records, or that a record does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecordError {
    /// No kind of this library has this number.
    Unknown(u16),
    /// A record of this kind has another number of bytes than its values.
    Length(TermKind, u16),
    /// A second record of this kind.
    Repeated(TermKind),
    /// The last record is not whole.
    Truncated,
    /// There is no room for a record of this kind.
    Full(TermKind),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(number) => {
                write!(
                    f,
                    "parameter record of unknown kind {number}, expected 1 to "
                )?;
                write!(f, "{}", TermKind::ALL.len())
            }
            Self::Length(kind, found) => write!(
                f,
                "parameter record {kind} of {found} bytes, expected {}",
                8 * kind.values()
            ),
            Self::Repeated(kind) => write!(f, "parameter record {kind} stands twice"),
            Self::Truncated => f.write_str("the last parameter record is not whole"),
            Self::Full(kind) => write!(
                f,
                "no room for parameter record {kind}: records take at most {RECORD_BYTES} bytes"
            ),
        }
    }
}

impl core::error::Error for RecordError {}

/// Records, each kind at most once.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TermRecords {
    bytes: [u8; RECORD_BYTES],
    length: u16,
    kinds: TermKinds,
}

impl Default for TermRecords {
    fn default() -> Self {
        Self::NONE
    }
}

impl TermRecords {
    /// No record.
    pub const NONE: Self = Self {
        bytes: [0; RECORD_BYTES],
        length: 0,
        kinds: TermKinds::NONE,
    };

    /// Adds a record.
    ///
    /// # Errors
    /// `values` are not as many as the kind has, the kind is there already, or there is no room.
    pub fn push(&mut self, kind: TermKind, values: &[f64]) -> Result<(), RecordError> {
        let bytes = values.len().saturating_mul(8);
        if values.len() != kind.values() {
            return Err(RecordError::Length(kind, bytes as u16));
        }
        if self.kinds.contains(kind) {
            return Err(RecordError::Repeated(kind));
        }
        let place = self.bytes.get_mut(usize::from(self.length)..);
        let place = place.and_then(|rest| rest.get_mut(..HEADER_BYTES + bytes));
        let Some((header, place)) = place.and_then(|p| p.split_first_chunk_mut::<HEADER_BYTES>())
        else {
            return Err(RecordError::Full(kind));
        };
        let [k0, k1] = (kind as u16).to_le_bytes();
        let [b0, b1] = (bytes as u16).to_le_bytes();
        *header = [k0, k1, b0, b1];
        for (chunk, value) in place.as_chunks_mut::<8>().0.iter_mut().zip(values) {
            *chunk = value.to_le_bytes();
        }
        self.length = self.length.saturating_add((HEADER_BYTES + bytes) as u16);
        self.kinds = self.kinds.union(TermKinds::of(&[kind]));
        Ok(())
    }

    /// The bytes of all records.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// The kinds that have a record.
    pub fn kinds(&self) -> TermKinds {
        self.kinds
    }

    /// Reads the bytes of records.
    ///
    /// # Errors
    /// The first record that is not one, by its kind.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RecordError> {
        let mut records = Self::NONE;
        records.read(bytes)?;
        Ok(records)
    }

    /// Replaces these records by those in the bytes.
    ///
    /// # Errors
    /// The first record that is not one, by its kind; those before it are here.
    pub fn read(&mut self, mut bytes: &[u8]) -> Result<(), RecordError> {
        self.bytes.fill(0);
        self.length = 0;
        self.kinds = TermKinds::NONE;
        while let Some((&[k0, k1, b0, b1], rest)) = bytes.split_first_chunk::<HEADER_BYTES>() {
            let number = u16::from_le_bytes([k0, k1]);
            let length = u16::from_le_bytes([b0, b1]);
            let kind = TermKind::from_number(number).ok_or(RecordError::Unknown(number))?;
            if usize::from(length) != 8 * kind.values() {
                return Err(RecordError::Length(kind, length));
            }
            let Some((values, rest)) = rest.split_at_checked(usize::from(length)) else {
                return Err(RecordError::Truncated);
            };
            self.push_bytes(kind, values)?;
            bytes = rest;
        }
        if bytes.is_empty() {
            Ok(())
        } else {
            Err(RecordError::Truncated)
        }
    }

    /// [`push`](Self::push) of values in their bytes.
    fn push_bytes(&mut self, kind: TermKind, values: &[u8]) -> Result<(), RecordError> {
        const MOST: usize = 15;
        let mut numbers = [0.0; MOST];
        let chunks = values.as_chunks::<8>().0;
        for (number, chunk) in numbers.iter_mut().zip(chunks) {
            *number = f64::from_le_bytes(*chunk);
        }
        let numbers = numbers.get(..chunks.len()).unwrap_or(&[]);
        self.push(kind, numbers)
    }

    /// The values of a kind's record, zeros without one. `COUNT` is [`TermKind::values`].
    #[inline]
    pub fn values<const COUNT: usize>(&self, kind: TermKind) -> [f64; COUNT] {
        let mut values = [0.0; COUNT];
        self.read_values(kind, &mut values);
        values
    }

    /// One function for all lengths: it runs at boot, and each costs flash.
    #[inline(never)]
    fn read_values(&self, kind: TermKind, values: &mut [f64]) {
        let mut bytes = self.bytes();
        while let Some((&[k0, k1, b0, b1], rest)) = bytes.split_first_chunk::<HEADER_BYTES>() {
            let length = usize::from(u16::from_le_bytes([b0, b1]));
            let Some((found, rest)) = rest.split_at_checked(length) else {
                break;
            };
            if u16::from_le_bytes([k0, k1]) == kind as u16 {
                for (value, chunk) in values.iter_mut().zip(found.as_chunks::<8>().0) {
                    *value = f64::from_le_bytes(*chunk);
                }
            }
            bytes = rest;
        }
    }
}

/// Multiplies each value. Not inlined, as [`largest`]: arithmetic of f64 at boot costs flash at every place.
#[inline(never)]
pub(crate) fn scale(values: &mut [f64], factor: f64) {
    for value in values {
        *value *= factor;
    }
}

/// The largest magnitude; NaN if any value is NaN, so that no comparison with a limit holds.
#[inline(never)]
pub(crate) fn largest(values: &[f64]) -> f64 {
    let mut most = 0.0;
    for value in values {
        let magnitude = value.abs();
        if magnitude.is_nan() {
            return magnitude;
        }
        if magnitude > most {
            most = magnitude;
        }
    }
    most
}

/// Every kind once fits a block.
#[cfg(feature = "terms")]
const _: () = {
    let mut bytes = 0;
    let mut rest = TermKind::ALL;
    while let [kind, others @ ..] = rest {
        bytes += HEADER_BYTES + 8 * kind.values();
        rest = others;
    }
    assert!(bytes <= RECORD_BYTES);
};
