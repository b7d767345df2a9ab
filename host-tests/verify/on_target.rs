//! Whole recordings through both images, held against the firmware's budgets: one of gyros alone, one with
//! accelerometers.
//!
//! Plays `bench-coning` from `RLG_RECORDINGS`, or else a recording that `rlg simulate` makes; the one with
//! accelerometers is always simulated. It fails if an output differs, if accelerometer codes do not reach the outputs,
//! or if a budget is exceeded.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

use rlg::target::TargetCore;
use rlg::target::budgets::Budgets;

use crate::step::{cargo_command, recordings, run};

/// Both cores.
const CORES: [TargetCore; 2] = [TargetCore::F32, TargetCore::Fixed];

/// 250 s of the unit's time: every phase of three dithers and the coning against each other. The recording
/// is played there and back until it is so many.
const SAMPLES: u64 = 1_000_000;

/// With accelerometers: 50 s, the simulated recording once.
const SAMPLES_WITH_ACCELEROMETERS: u64 = 200_000;

/// A recording, its model, and how it is played.
#[derive(Debug)]
pub struct Recording {
    folder: PathBuf,
    model: PathBuf,
    /// Results go here, a folder for each core.
    out: PathBuf,
    samples: u64,
    /// Whether its accelerometers are played.
    accelerometers: bool,
}

/// The bench recording if there is one, or a simulated one; played without accelerometers.
pub fn gyros_alone(root: &Path) -> Result<Recording, String> {
    let bench = recordings().map(|recordings| recordings.join("bench-coning"));
    let folder = match bench {
        Some(bench) if bench.is_dir() => bench,
        Some(bench) => return Err(format!("{} is not there", bench.display())),
        None => simulated(root, "coning")?,
    };
    Ok(Recording {
        model: folder.join("model.toml"),
        folder,
        out: results(root),
        samples: SAMPLES,
        accelerometers: false,
    })
}

/// A simulated recording with accelerometers, none of whose parameters is zero.
pub fn with_accelerometers(root: &Path) -> Result<Recording, String> {
    let folder = simulated(root, "accelerometers")?;
    Ok(Recording {
        model: folder.join("model.toml"),
        folder,
        out: results(root).join("with-accelerometers"),
        samples: SAMPLES_WITH_ACCELEROMETERS,
        accelerometers: true,
    })
}

/// Everything of this step is written below this folder.
fn results(root: &Path) -> PathBuf {
    root.join("target").join("verify")
}

/// Simulates the scenario `name`; the recording's folder.
fn simulated(root: &Path, name: &str) -> Result<PathBuf, String> {
    let folder = results(root).join(format!("simulated-{name}"));
    let scenario = format!("host-tests/scenarios/{name}.toml");
    let mut command = rlg(&["simulate", &scenario, "--out"]);
    command.arg(&folder);
    run(command)?;
    Ok(folder)
}

/// Both cores at once, as each emulator keeps one processor busy for minutes.
pub fn hold_their_budgets(recording: &Recording) -> [Result<(), String>; 2] {
    thread::scope(|scope| {
        CORES
            .map(|core| scope.spawn(move || holds_its_budgets(recording, core)))
            .map(|run| run.join().unwrap_or_else(|_| Err("panicked".to_owned())))
    })
}

/// Runs `core` over the recording: every output equal, and the cost within its budgets. What it says is
/// printed in one piece.
fn holds_its_budgets(recording: &Recording, core: TargetCore) -> Result<(), String> {
    let mut command = rlg(&["on-target", "--json", "--core", core.name()]);
    command
        .args(["--samples", &recording.samples.to_string()])
        // The strip follows the pickoff, as it would on the unit.
        .args(["--adapt-s", "2"])
        .arg("--model")
        .arg(&recording.model)
        .arg("--out")
        .arg(recording.out.join(core.name()));
    if recording.accelerometers {
        command.arg("--accelerometers");
    }
    command.arg(&recording.folder);
    let budgets = Budgets::of_workspace().map_err(|error| error.to_string())?;
    let output = command
        .output()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    if !output.status.success() {
        return Err(format!("{command:?}: {}", output.status));
    }
    let result: serde_json::Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| format!("{command:?} printed no JSON ({error})"))?;
    let figure = |pointer: &str| {
        result
            .pointer(pointer)
            .and_then(serde_json::Value::as_f64)
            .ok_or_else(|| format!("on_target.json has no {pointer}"))
    };

    if result["bit_equal"] != true {
        return Err(format!(
            "{}: outputs differ, first {}",
            core.name(),
            result["first_difference"]
        ));
    }
    let samples = figure("/samples")?;
    if samples != recording.samples as f64 {
        return Err(format!("{}: {samples} samples", core.name()));
    }
    // Gravity alone puts a velocity into every frame: one without means that codes did not reach the output.
    let with_velocity = match recording.accelerometers {
        true => figure("/frames")?,
        false => 0.0,
    };
    let found = figure("/frames_with_velocity")?;
    if result["accelerometers"] != recording.accelerometers || found != with_velocity {
        return Err(format!(
            "{}: accelerometers {}, velocity in {found} frames, expected in {with_velocity}",
            core.name(),
            result["accelerometers"]
        ));
    }
    let budgets = budgets.chain(core, recording.accelerometers);
    let mean = figure("/instructions_per_sample/mean")?;
    let most_over_least =
        figure("/instructions_between_outputs/max")? / figure("/instructions_between_outputs/min")?;
    for (name, found, budget) in [
        ("instructions_mean", mean, &budgets.instructions_mean),
        (
            "between_outputs_ratio",
            most_over_least,
            &budgets.between_outputs_ratio,
        ),
    ] {
        if let Some(sentence) = budget.exceeded_by(name, found) {
            return Err(format!("{}: {sentence}", core.name()));
        }
    }
    for count in ["/missed", "/late", "/outputs_lost"] {
        if figure(count)? != 0.0 {
            return Err(format!("{}: {count} is not 0", core.name()));
        }
    }
    Ok(())
}

/// The tool itself.
fn rlg(arguments: &[&str]) -> Command {
    let mut command = cargo_command(&["run", "--release", "--quiet", "--package", "rlg"]);
    command.args(["--bin", "rlg", "--"]).args(arguments);
    command
}
