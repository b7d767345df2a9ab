//! Whole recordings through both images, compared with the firmware's budgets: one of gyros alone, one with accelerometers.
//!
//! The first is `bench-coning` from `RLG_RECORDINGS`, or simulated if that is not set; the one with accelerometers is always
//! simulated. A test fails if an output differs, if accelerometer codes do not reach the outputs, or if a budget is
//! exceeded.

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use rlg::target::TargetCore;
use rlg::target::budgets::Budgets;
use serde_json::Value;

/// 15 s of the unit's time: seven times the settling time of the strip. A recording is played forward and backward up to
/// this number of samples.
const SAMPLES: u64 = 60_000;

/// 250 s of the unit's time: all relative phases of three dithers and the coning.
const SAMPLES_IN_FULL: u64 = 1_000_000;

/// A recording with its model, in a folder that exists as long as this.
struct Played {
    folder: PathBuf,
    /// Folder of results, and of a simulated recording.
    own: tempfile::TempDir,
}

impl Played {
    fn bench() -> Self {
        let Some(recordings) = std::env::var_os("RLG_RECORDINGS") else {
            return Self::simulated("coning");
        };
        let folder = Path::new(&recordings).join("bench-coning");
        assert!(folder.is_dir(), "{} is not there", folder.display());
        let own = tempfile::tempdir().expect("a temporary folder");
        Self { folder, own }
    }

    /// Simulates a scenario of `host-tests/scenarios`.
    fn simulated(scenario: &str) -> Self {
        let own = tempfile::tempdir().expect("a temporary folder");
        let folder = own.path().join("recording");
        let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
        let output = rlg()
            .arg("simulate")
            .arg(scenarios.join(scenario).with_extension("toml"))
            .arg("--out")
            .arg(&folder)
            .output()
            .expect("it starts");
        succeeded(&output);
        Self { folder, own }
    }

    /// Returns the output of `rlg on-target` for `samples` samples of it.
    fn on_target(&self, core: TargetCore, samples: u64, accelerometers: bool) -> Value {
        let mut command = rlg();
        command
            .args(["on-target", "--json", "--core", core.name()])
            .args(["--samples", &samples.to_string()])
            // The strip tracks the pickoff, as it would on the unit.
            .args(["--adapt-s", "2"])
            .arg("--model")
            .arg(self.folder.join("model.toml"))
            .arg("--out")
            .arg(self.own.path().join(core.name()));
        if accelerometers {
            command.arg("--accelerometers");
        }
        let output = command.arg(&self.folder).output().expect("it starts");
        succeeded(&output);
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    }
}

fn rlg() -> Command {
    Command::cargo_bin("rlg").expect("the command is built")
}

fn succeeded(output: &Output) {
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {words}", output.status);
}

/// Checks that every output is equal, and the cost within its budgets.
fn holds_its_budgets(played: &Played, core: TargetCore, samples: u64, accelerometers: bool) {
    let result = played.on_target(core, samples, accelerometers);
    let figure = |pointer: &str| {
        let figure = result.pointer(pointer).and_then(Value::as_f64);
        figure.unwrap_or_else(|| panic!("on_target.json has no {pointer}"))
    };
    let difference = &result["first_difference"];
    assert_eq!(
        result["bit_equal"], true,
        "outputs differ, first {difference}"
    );
    assert_eq!(figure("/samples"), samples as f64);
    // Gravity alone puts a velocity into every frame: one without means that codes did not reach the output.
    let with_velocity = if accelerometers {
        figure("/frames")
    } else {
        0.0
    };
    assert_eq!(result["accelerometers"], accelerometers);
    assert_eq!(figure("/frames_with_velocity"), with_velocity);
    for count in ["/missed", "/late", "/outputs_lost"] {
        assert_eq!(figure(count), 0.0, "{count}");
    }

    let budgets = Budgets::of_workspace().expect("the budgets");
    let budgets = budgets.chain(core, accelerometers);
    let mean = figure("/instructions_per_sample/mean");
    let most_over_least =
        figure("/instructions_between_outputs/max") / figure("/instructions_between_outputs/min");
    for (name, found, budget) in [
        ("instructions_mean", mean, &budgets.instructions_mean),
        (
            "between_outputs_ratio",
            most_over_least,
            &budgets.between_outputs_ratio,
        ),
    ] {
        let exceeded = budget.exceeded_by(name, found);
        assert!(exceeded.is_none(), "{exceeded:?}");
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn gyros_alone_in_f32_keep_their_budgets() {
    holds_its_budgets(&Played::bench(), TargetCore::F32, SAMPLES, false);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn gyros_alone_in_fixed_point_keep_their_budgets() {
    holds_its_budgets(&Played::bench(), TargetCore::Fixed, SAMPLES, false);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn accelerometers_too_in_f32_keep_their_budgets() {
    let played = Played::simulated("accelerometers");
    holds_its_budgets(&played, TargetCore::F32, SAMPLES, true);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn accelerometers_too_in_fixed_point_keep_their_budgets() {
    let played = Played::simulated("accelerometers");
    holds_its_budgets(&played, TargetCore::Fixed, SAMPLES, true);
}

#[test]
#[ignore = "needs qemu-system-arm, and minutes: --test target -- --ignored in_full"]
fn gyros_alone_keep_their_budgets_in_full() {
    let played = Played::bench();
    for core in [TargetCore::F32, TargetCore::Fixed] {
        holds_its_budgets(&played, core, SAMPLES_IN_FULL, false);
    }
}

#[test]
#[ignore = "needs qemu-system-arm, and minutes: --test target -- --ignored in_full"]
fn accelerometers_too_keep_their_budgets_in_full() {
    let played = Played::simulated("accelerometers");
    for core in [TargetCore::F32, TargetCore::Fixed] {
        holds_its_budgets(&played, core, SAMPLES_IN_FULL, true);
    }
}
