//! A whole recording through both images, held against the firmware's budgets.
//!
//! Enters: `bench-coning` from `RLG_RECORDINGS`, or else a recording that `rlg simulate` makes. Leaves:
//! the figures, and a failure where an output differs or a budget is exceeded.

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

/// A recording and its model.
#[derive(Debug)]
pub struct Recording {
    folder: PathBuf,
    model: PathBuf,
    /// Results go here.
    out: PathBuf,
}

/// The bench recording if there is one, or a simulated one.
pub fn recording(root: &Path) -> Result<Recording, String> {
    let out = root.join("target").join("verify");
    let bench = recordings().map(|recordings| recordings.join("bench-coning"));
    let folder = match bench {
        Some(bench) if bench.is_dir() => bench,
        Some(bench) => return Err(format!("{} is not there", bench.display())),
        None => {
            let simulated = out.join("simulated-coning");
            let mut command = rlg(&["simulate", "host-tests/scenarios/coning.toml", "--out"]);
            command.arg(&simulated);
            run(command)?;
            simulated
        }
    };
    Ok(Recording {
        model: folder.join("model.toml"),
        folder,
        out,
    })
}

/// Both cores at once, as each emulator keeps one processor busy for minutes.
pub fn hold_their_marks(recording: &Recording) -> [Result<(), String>; 2] {
    thread::scope(|scope| {
        CORES
            .map(|core| scope.spawn(move || holds_its_marks(recording, core)))
            .map(|run| run.join().unwrap_or_else(|_| Err("panicked".to_owned())))
    })
}

/// Runs `core` over the recording: every output equal, and the cost within its marks. What it says is printed in one piece.
fn holds_its_marks(recording: &Recording, core: TargetCore) -> Result<(), String> {
    let mut command = rlg(&["on-target", "--json", "--core", core.name()]);
    command
        .args(["--samples", &SAMPLES.to_string()])
        // The strip follows the pickoff, as it would on the unit.
        .args(["--adapt-s", "2"])
        .arg("--model")
        .arg(&recording.model)
        .arg("--out")
        .arg(recording.out.join(core.name()))
        .arg(&recording.folder);
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
    if samples != SAMPLES as f64 {
        return Err(format!("{}: {samples} samples", core.name()));
    }
    let budgets = match core {
        TargetCore::F32 => budgets.f32,
        TargetCore::Fixed => budgets.fixed,
    };
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
