//! Builds or finds the firmware image, and sums its use of flash and RAM \[bytes\].
//!
//! Without a path the image is built in the workspace that this tool was compiled from. Sizes come from the sections of
//! the ELF file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};
use trueaxis::terms::TermKinds;

use super::{Platform, TargetCore};
use rlg_recording::error::InputError;

/// The target triple of the image: Cortex-M4 with its single-precision unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Beginning of RAM on every Cortex-M (ARMv7-M reference manual, B3.1); below lies code memory.
const RAM_BEGIN: u64 = 0x2000_0000;

/// The firmware, ready to run.
#[derive(Debug, Clone)]
pub struct Image {
    /// The ELF file.
    pub path: PathBuf,
    /// Its content.
    pub elf: Vec<u8>,
    /// Code, constants and the initial values of variables \[bytes\].
    pub flash_bytes: u64,
    /// Static variables \[bytes\], without the stack.
    pub ram_bytes: u64,
    /// The optional terms of its chain.
    pub term_kinds: TermKinds,
}

impl Image {
    /// The image in the file `path`.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let elf = fs::read(path).map_err(|error| {
            InputError::new(path, format!("cannot be read ({error})"))
                .expected("a firmware image in ELF format")
        })?;
        let (flash_bytes, ram_bytes) = memory(&elf).ok_or_else(|| {
            InputError::new(path, "is not a firmware image")
                .expected(format!("an ELF file for {TARGET}"))
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            term_kinds: term_kinds(&elf),
            elf,
            flash_bytes,
            ram_bytes,
        })
    }

    /// Builds the image of `core` for `platform` in the workspace that this tool was compiled from. Cargo does nothing
    /// where it is up to date.
    pub fn build(platform: Platform, core: TargetCore) -> Result<Self, InputError> {
        Self::build_with(platform, core, &[], None)
    }

    /// [`Image::build`] of the image with every optional term.
    pub fn build_with_terms(platform: Platform, core: TargetCore) -> Result<Self, InputError> {
        // In a folder of its own: the image without terms has the same name, and somebody else may be building it.
        let folder = workspace().join("target").join("terms");
        let folder = folder.to_string_lossy();
        let options = ["--features", "terms", "--target-dir", &folder];
        Self::build_with(platform, core, &options, None)
    }

    /// [`Image::build`] of the emulator's image with the one term at `place` of
    /// [`AllTerms`](trueaxis::terms::AllTerms). The next build of another term replaces its file.
    pub fn build_with_term(core: TargetCore, place: usize) -> Result<Self, InputError> {
        let folder = workspace().join("target").join("one-term");
        let folder = folder.to_string_lossy();
        let options = ["--features", "terms", "--target-dir", &folder];
        Self::build_with(Platform::Emulator, core, &options, Some(place))
    }

    /// [`Image::build`] of the image with the raw stream.
    pub fn build_with_raw(platform: Platform, core: TargetCore) -> Result<Self, InputError> {
        let folder = workspace().join("target").join("raw");
        let folder = folder.to_string_lossy();
        let options = ["--features", "raw", "--target-dir", &folder];
        Self::build_with(platform, core, &options, None)
    }

    fn build_with(
        platform: Platform,
        core: TargetCore,
        options: &[&str],
        only_term: Option<usize>,
    ) -> Result<Self, InputError> {
        let workspace = workspace();
        if !workspace.join("memory.x").is_file() {
            return Err(
                InputError::new(&workspace, "no longer holds the firmware's sources").expected(
                    "the workspace this tool was built from, or an image given with --image",
                ),
            );
        }
        let binary = platform.binary(core);
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        if let Some(place) = only_term {
            command.env("TRUEAXIS_ONLY_TERM", place.to_string());
        }
        let output = command
            .current_dir(&workspace)
            .args(["build", "--release", "--package", "trueaxis"])
            .args(["--target", TARGET, "--bin", binary])
            .args(["--features", platform.feature()])
            // As the aliases of .cargo/config.toml build them.
            .args(["--config", "profile.release.debug='line-tables-only'"])
            .args(options)
            .arg("--message-format=json-render-diagnostics")
            .stdin(Stdio::null())
            .output()
            .map_err(|error| {
                InputError::new("cargo", format!("cannot be started ({error})")).expected(
                    "cargo on the path, to build the image, or an image given with --image",
                )
            })?;
        if !output.status.success() {
            return Err(build_failure(&workspace, platform, &output.stderr));
        }
        let path = executable(&output.stdout, binary).ok_or_else(|| {
            InputError::new(&workspace, format!("was built without a binary `{binary}`"))
        })?;
        Self::read(&path)
    }
}

/// The workspace that this tool was compiled from.
pub(crate) fn workspace() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package).to_path_buf()
}

/// Names the one remedy of a failed build.
fn build_failure(workspace: &Path, platform: Platform, stderr: &[u8]) -> InputError {
    let words = String::from_utf8_lossy(stderr);
    if words.contains("target may not be installed") || words.contains("E0463") {
        return InputError::new(TARGET, "the compiler has no core library for this target")
            .expected(format!("it to be installed: rustup target add {TARGET}"));
    }
    let reason = words
        .lines()
        .find(|line| line.starts_with("error"))
        .unwrap_or("cargo gave no reason");
    InputError::new(workspace, format!("the image does not build: {reason}"))
        .expected(format!("`cargo {}` to succeed", platform.feature()))
}

/// The path of the binary in cargo's messages, one JSON object a line.
fn executable(messages: &[u8], binary: &str) -> Option<PathBuf> {
    messages
        .split(|byte| *byte == b'\n')
        .filter_map(|line| serde_json::from_slice::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == binary)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
}

/// The word `TERM_KINDS` of an image; none in one that lacks it, as images before terms.
fn term_kinds(elf: &[u8]) -> TermKinds {
    let word = || {
        let file = object::File::parse(elf).ok()?;
        let address = file.symbol_by_name("TERM_KINDS")?.address();
        let holds = |section: &object::Section| {
            (section.address()..section.address() + section.size()).contains(&address)
        };
        let section = file.sections().find(holds)?;
        let at = usize::try_from(address - section.address()).ok()?;
        // A word of zeros may stand where nothing is loaded.
        let bytes = section.data().ok()?.get(at..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*bytes))
    };
    TermKinds::from_bits(word().unwrap_or(0))
}

/// Bytes in flash and in RAM. A section that is loaded takes its size where it runs; `.data` counts twice,
/// since its initial values stand in flash.
fn memory(elf: &[u8]) -> Option<(u64, u64)> {
    let file = object::File::parse(elf).ok()?;
    if file.architecture() != object::Architecture::Arm {
        return None;
    }
    let (mut flash_bytes, mut ram_bytes) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else {
            return None;
        };
        if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 {
            continue;
        }
        let has_content = section.file_range().is_some();
        if section.address() >= RAM_BEGIN {
            ram_bytes += section.size();
            flash_bytes += if has_content { section.size() } else { 0 };
        } else if has_content {
            flash_bytes += section.size();
        }
    }
    (flash_bytes > 0).then_some((flash_bytes, ram_bytes))
}
