//! `rlg model new`: writes an initial model.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;

use crate::error::InputError;
use crate::import::still;
use crate::model::{Model, MotionSource};
use crate::output::write_file;
use crate::terminal::Terminal;

/// Make a model to start from
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg model new --grade mems --out model.toml\n  rlg model new --grade rlg --at-rest --out model.toml"
)]
pub struct ModelCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Write the model of an ideal unit, with the usual noise of its grade as comments
    New(New),
}

#[derive(Debug, Args)]
struct New {
    /// Grade of the gyros
    #[arg(long, value_enum)]
    grade: Grade,
    /// The unit lies still on the Earth, without a reference
    #[arg(long)]
    at_rest: bool,
    /// File to write
    #[arg(short, long)]
    out: PathBuf,
}

/// Grades of gyros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Grade {
    /// Dithered ring-laser gyros of navigation grade
    Rlg,
    /// Fibre-optic gyros of tactical grade
    Fog,
    /// Industrial MEMS gyros
    Mems,
    /// MEMS gyros of telephones and toys
    Consumer,
}

/// Usual noise of a grade, in orders of magnitude as on data sheets.
struct Usual {
    name: &'static str,
    angle_random_walk_deg_sqrt_h: f64,
    flicker_deg_h: f64,
}

impl Grade {
    fn usual(self) -> Usual {
        let (name, angle_random_walk_deg_sqrt_h, flicker_deg_h) = match self {
            Self::Rlg => (
                "dithered ring-laser gyros of navigation grade",
                0.002,
                0.003,
            ),
            Self::Fog => ("fibre-optic gyros of tactical grade", 0.05, 0.5),
            Self::Mems => ("industrial MEMS gyros", 0.2, 5.0),
            Self::Consumer => ("consumer MEMS gyros", 0.4, 30.0),
        };
        Usual {
            name,
            angle_random_walk_deg_sqrt_h,
            flicker_deg_h,
        }
    }
}

impl ModelCommand {
    /// Writes the model.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let Action::New(new) = &self.action;
        let motion = match new.at_rest {
            true => MotionSource::Static,
            false => MotionSource::Reference,
        };
        let model = Model {
            motion,
            ..still::model([0.0; 3])
        };
        write_file(&new.out, text(&model, new.grade).as_bytes())?;
        terminal.say(format!(
            "{}: put in what you know of the unit",
            new.out.display()
        ));
        terminal.result(&json!({ "model": new.out }))
    }
}

/// Formats the model as text. Noise stands in comments, because a declared figure is taken as exact and an absent one is
/// estimated.
fn text(model: &Model, grade: Grade) -> String {
    let usual = grade.usual();
    let mut text = format!(
        "# An ideal unit with {}. Bias, scale and installation: what you know of the unit.\n\
         # A reference relative to the Earth (turntable, cameras) has earth_rate = false, a reference gyro true.\n{}",
        usual.name,
        model.to_toml()
    );
    let walk = (usual.angle_random_walk_deg_sqrt_h / 60.0).to_radians();
    let flicker = (usual.flicker_deg_h / 3600.0).to_radians();
    // Writing to a String cannot fail, so the results of write! are dropped.
    let _ = write!(
        text,
        "# Noise that no key declares is measured. Usual of the grade; the data sheet's figure may take its place:\n\
         # angle_random_walk_rad_sqrt_s = [{walk:.1e}, {walk:.1e}, {walk:.1e}]    # {} deg/sqrt(h)\n\
         # flicker_rad_s = [{flicker:.1e}, {flicker:.1e}, {flicker:.1e}]    # {} deg/h, B of IEEE 952\n",
        usual.angle_random_walk_deg_sqrt_h, usual.flicker_deg_h
    );
    if grade == Grade::Rlg {
        text.push_str(
            "# Gyros that count pulses need the angle of one:\n\
             # pulse_weight_rad = [3.9e-6, 3.9e-6, 3.9e-6]\n",
        );
    }
    text
}
