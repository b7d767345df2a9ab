//! Names the two number systems and their images.

/// A number system that has an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum TargetCore {
    /// Single precision.
    F32,
    /// Fixed point.
    Fixed,
}

impl TargetCore {
    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Fixed => "fixed",
        }
    }
}

/// Platform of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Platform {
    /// On the reference board.
    Board,
    /// In QEMU, with a counter bank from a file.
    Emulator,
}

impl Platform {
    /// The cargo feature of its images.
    pub fn feature(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Emulator => "emulator",
        }
    }

    /// The binary of its image with `core`.
    pub fn binary(self, core: TargetCore) -> &'static str {
        match (self, core) {
            (Self::Board, TargetCore::F32) => "firmware",
            (Self::Board, TargetCore::Fixed) => "firmware-fixed",
            (Self::Emulator, TargetCore::F32) => "emulated",
            (Self::Emulator, TargetCore::Fixed) => "emulated-fixed",
        }
    }
}
