//! `rlg navigate`: runs a recording through the chain and a strapdown navigator, before and after the dynamic compensation.
//!
//! Writes `navigation.json`, `navigation.html` and `navigation.parquet` (itself a recording): attitude \[rad\], velocity
//! \[m/s\] and position at the end of each output period.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use strapdown::{AlignmentError, Solution};

use super::inputs::{read_model, results_folder};
use crate::error::InputError;
use crate::json;
use crate::navigate::figures::TrajectoryFigures;
use crate::navigate::trajectory::NotAtRest;
use crate::navigate::{Place, Readings, Start, Trajectory, navigate};
use crate::output::OutputFolder;
use crate::recording::{Channel, Clock, MANIFEST, Quantity, Recording, Table};
use crate::replay::Core;
use crate::report;
use crate::terminal::Terminal;

/// Name of the written table.
const TABLE: &str = "navigation.parquet";

/// Highest latitude \[°\]: at the poles longitude and its scale are undefined and there is no north to navigate by.
const HIGHEST_LATITUDE_DEG: f64 = 89.0;

/// Steepest pitch \[°\]: beyond it heading and roll are nearly degenerate, and both are magnified tenfold.
const STEEPEST_PITCH_DEG: f64 = 85.0;

/// Navigate on a recording: attitude and velocity before and after the dynamic compensation
///
/// The unit stays in one place. It is levelled and gyrocompassed on the first segment of kind "still" and
/// navigates from there to the end. Writes navigation.html, navigation.json and navigation.parquet.
#[derive(Debug, Args)]
#[command(
    name = "navigate",
    after_help = "Example:\n  rlg navigate bench-17 --model bench-17/model.toml --out navigated"
)]
pub struct NavigateCommand {
    /// Folder with recording.toml
    recording: PathBuf,
    /// The model that the chain compensates
    #[arg(short, long, required_unless_present = "compensated")]
    model: Option<PathBuf>,
    /// Folder for the results
    #[arg(short, long)]
    out: PathBuf,
    /// Number system of the chain
    #[arg(long, value_enum, default_value = "reference")]
    core: Core,
    /// Take the rows as they are, without the chain: what `rlg replay` wrote, or increments of a unit that
    /// compensates itself
    #[arg(long, conflicts_with = "model")]
    compensated: bool,
    /// Geodetic latitude of the site [°]; absent: the recording's
    #[arg(long, allow_negative_numbers = true)]
    latitude_deg: Option<f64>,
    /// Align on this many seconds from the beginning; absent: on the first "still" segment
    #[arg(long)]
    align_s: Option<f64>,
    /// Heading of the body's x axis at rest [°], instead of gyrocompassing
    #[arg(long, allow_negative_numbers = true)]
    heading_deg: Option<f64>,
}

/// `navigation.json`.
#[derive(Serialize)]
struct Results {
    format: u32,
    recording: String,
    version: &'static str,
    /// `null` with `--compensated`.
    core: Option<&'static str>,
    latitude_rad: f64,
    gravity_m_s2: f64,
    aligned_s: [f64; 2],
    heading_given: bool,
    navigated_s: [f64; 2],
    /// `null` if the model has no dynamic term.
    before: Option<TrajectoryFigures>,
    after: TrajectoryFigures,
    /// Relative reduction of the largest north and east velocity.
    velocity_reduction: Option<[f64; 2]>,
    /// Kinds of the model's effects without a term in the chain.
    uncompensated: Vec<String>,
}

impl NavigateCommand {
    /// Navigates, compares with the reference, writes and prints the figures.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let spinner = terminal.spinner("reading");
        let recording = Recording::read(&self.recording)?;
        let model_file = self.model.clone().unwrap_or_default();
        let mut out = self.results_folder(&model_file)?;
        let model = match &self.model {
            Some(model_file) => Some(read_model(model_file, terminal)?),
            None => None,
        };
        let place = self.place(&recording)?;
        let heading_rad = self.heading_rad()?;
        spinner.set_message("compensating");
        let readings = match &model {
            Some(model) => Readings::through_chain(&recording, model, &model_file, self.core)?,
            None => Readings::as_recorded(&recording)?,
        };
        let start = Start {
            periods: self.rest(&recording, &readings)?,
            heading_rad,
        };
        spinner.set_message("navigating");
        let reference = readings.reference_rad.as_deref();
        let reference = reference.map(|rotations| (rotations, readings.earth_in_reference));
        let trajectory = |increments: &Vec<_>| {
            navigate(increments, &place, &start, reference)
                .map_err(|why| not_at_rest(&recording, why, heading_rad.is_some()))
        };
        let after = trajectory(&readings.after)?;
        let before = readings.before.as_ref().map(trajectory).transpose()?;
        let results = self.results(
            &recording,
            &readings,
            &place,
            &start,
            before.as_ref(),
            &after,
        );

        spinner.set_message("writing");
        table(&recording, &readings, before.as_ref(), &after).write_into(&mut out)?;
        let text = json::text(&results, &self.out)?;
        let page = report::navigation::page(&report::navigation::Navigation {
            recording: &recording.name,
            readings: &readings,
            before: before.as_ref().zip(results.before.as_ref()),
            after: (&after, &results.after),
            json: &text,
        });
        out.write("navigation.html", page.as_bytes())?;
        out.write("navigation.json", text.as_bytes())?;
        out.commit()?;
        spinner.finish_and_clear();
        if results.after.alignment.pitch_deg.abs() > STEEPEST_PITCH_DEG {
            terminal
                .warn("the body's x axis stands upright: roll and heading are not distinguishable");
        }
        for kind in &results.uncompensated {
            terminal.warn(format!(
                "the chain has no term for {kind}: it stays in what is navigated on"
            ));
        }
        terminal.say(results.table());
        terminal.result(&results)
    }

    /// Creates the folder for the results: not the input's, and not one that holds another recording.
    fn results_folder(&self, model_file: &std::path::Path) -> Result<OutputFolder, InputError> {
        let results = &[TABLE, MANIFEST, "navigation.json", "navigation.html"];
        let out = results_folder(&self.out, &self.recording, model_file, results)?;
        if self.out.join(MANIFEST).exists() && !Recording::lists_table(&self.out, TABLE) {
            return Err(InputError::new(&self.out, "holds another recording")
                .channel("--out")
                .expected("another folder, or one with an earlier navigation"));
        }
        Ok(out)
    }

    fn place(&self, recording: &Recording) -> Result<Place, InputError> {
        let site = recording.site;
        let place = match (self.latitude_deg, site) {
            (Some(latitude_deg), _) => Place {
                latitude_rad: latitude_deg.to_radians(),
                gravity_m_s2: site.map(|site| site.gravity_m_s2),
            },
            (None, Some(site)) => Place {
                latitude_rad: site.latitude_rad,
                gravity_m_s2: Some(site.gravity_m_s2),
            },
            (None, None) => {
                return Err(InputError::new(
                    recording.folder.join(MANIFEST),
                    "does not say where it was",
                )
                .channel("site.latitude_rad")
                .expected("[site] with latitude_rad and gravity_m_s2, or --latitude-deg"));
            }
        };
        let latitude_deg = place.latitude_rad.to_degrees();
        if latitude_deg.is_nan() || latitude_deg.abs() > HIGHEST_LATITUDE_DEG {
            let given = self
                .latitude_deg
                .map_or("site.latitude_rad", |_| "--latitude-deg");
            return Err(InputError::new(
                recording.folder.join(MANIFEST),
                "is too near a pole to navigate",
            )
            .channel(given)
            .value(format!("{latitude_deg}°"))
            .expected(format!("at most {HIGHEST_LATITUDE_DEG}° north or south")));
        }
        Ok(place)
    }

    fn heading_rad(&self) -> Result<Option<f64>, InputError> {
        match self.heading_deg {
            Some(heading_deg) if !heading_deg.is_finite() => {
                Err(InputError::new(&self.recording, "cannot have this heading")
                    .channel("--heading-deg")
                    .value(heading_deg)
                    .expected("an angle in degrees"))
            }
            heading_deg => Ok(heading_deg.map(f64::to_radians)),
        }
    }

    /// Returns the periods to align on.
    fn rest(
        &self,
        recording: &Recording,
        readings: &Readings,
    ) -> Result<std::ops::Range<usize>, InputError> {
        let (start_s, end_s, key) = if let Some(align_s) = self.align_s {
            (readings.start_s, readings.start_s + align_s, "--align-s")
        } else {
            let still = recording.segments.iter().find(|s| s.kind == "still");
            let Some(still) = still else {
                return Err(InputError::new(
                    recording.folder.join(MANIFEST),
                    "names no time of rest to align on",
                )
                .channel("segment")
                .expected("a segment of kind \"still\", or --align-s"));
            };
            (still.start_s, still.end_s, "segment")
        };
        let periods = readings.periods_in(start_s, end_s);
        if periods.is_empty() {
            return Err(InputError::new(
                &recording.folder,
                "has no complete output period to align on",
            )
            .channel(key)
            .value(format!("{start_s} to {end_s} s"))
            .expected(format!("more than {} s", 2.0 * readings.period_s)));
        }
        if periods.end == readings.after.len() {
            return Err(InputError::new(
                &recording.folder,
                "has nothing after the alignment to navigate on",
            )
            .channel(key)
            .value(format!("{start_s} to {end_s} s"))
            .expected("a shorter time of rest: --align-s"));
        }
        Ok(periods)
    }

    fn results(
        &self,
        recording: &Recording,
        readings: &Readings,
        place: &Place,
        start: &Start,
        before: Option<&Trajectory>,
        after: &Trajectory,
    ) -> Results {
        let figures = |trajectory: &Trajectory| {
            TrajectoryFigures::of(trajectory, place, readings, &recording.segments)
        };
        let time_s = |period: usize| readings.start_s + period as f64 * readings.period_s;
        let (before, after) = (before.map(figures), figures(after));
        let reduction = |before: &TrajectoryFigures| {
            [0, 1].map(|axis| 1.0 - after.max_velocity_m_s[axis] / before.max_velocity_m_s[axis])
        };
        Results {
            format: 1,
            recording: recording.name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            core: (!self.compensated).then(|| self.core.name()),
            latitude_rad: place.latitude_rad,
            gravity_m_s2: place.gravity_m_s2(),
            aligned_s: [time_s(start.periods.start), time_s(start.periods.end)],
            heading_given: start.heading_rad.is_some(),
            navigated_s: [time_s(start.periods.end), time_s(readings.after.len())],
            velocity_reduction: before.as_ref().map(reduction),
            before,
            after,
            uncompensated: readings.uncompensated.clone(),
        }
    }
}

/// Formats the reason of a failed alignment as a sentence about the recording.
fn not_at_rest(recording: &Recording, why: NotAtRest, heading_given: bool) -> InputError {
    let still = "a unit at rest on the turning Earth, with its biases in the model";
    let error = |problem: &str| InputError::new(&recording.folder, problem);
    let arcsec = 180.0 / std::f64::consts::PI * 3600.0;
    match why {
        NotAtRest::Alignment(AlignmentError::NoNorth(rate_rad_s)) => {
            error("shows no rotation of the Earth to tell north by")
                .channel("gyros")
                .value(format!(
                    "{:.3} °/h across the vertical",
                    rate_rad_s * arcsec
                ))
                .expected(still)
        }
        NotAtRest::Alignment(problem) => error(&problem.to_string())
            .channel("accelerometers")
            .expected(still),
        NotAtRest::Rate(rate_rad_s) => {
            error("does not turn as the Earth does while it is aligned on")
                .channel("gyros")
                .value(format!(
                    "{:.3} °/h beside the Earth's rate",
                    rate_rad_s * arcsec
                ))
                .expected(if heading_given {
                    "a unit at rest, at this heading, with its biases in the model"
                } else {
                    still
                })
        }
        NotAtRest::Force(force_m_s2) => error("does not feel gravity while it is aligned on")
            .channel("accelerometers")
            .value(format!("{force_m_s2:.4} m/s² beside gravity"))
            .expected(still),
    }
}

/// Writes the trajectories as a recording; a row holds the values at its end.
fn table(
    recording: &Recording,
    readings: &Readings,
    before: Option<&Trajectory>,
    after: &Trajectory,
) -> Recording {
    type Column = (&'static str, fn(&Solution) -> f64);
    const COLUMNS: [Column; 9] = [
        ("roll_rad", |s| s.euler().roll_rad),
        ("pitch_rad", |s| s.euler().pitch_rad),
        ("heading_rad", |s| s.euler().heading_rad),
        ("velocity_north_m_s", |s| s.velocity_m_s.x),
        ("velocity_east_m_s", |s| s.velocity_m_s.y),
        ("velocity_down_m_s", |s| s.velocity_m_s.z),
        ("latitude_rad", |s| s.latitude_rad),
        ("longitude_rad", |s| s.longitude_rad),
        ("height_m", |s| s.height_m),
    ];
    let channel = |when: &str, name: &str, values: Vec<f64>| Channel {
        column: format!("{when}_{name}"),
        quantity: Quantity::Other(format!("navigated_{name}")),
        axis: None,
        scale: 1.0,
        offset: 0.0,
        values,
    };
    let trajectories = before.map(|trajectory| ("before", trajectory));
    let mut channels = Vec::new();
    for (when, trajectory) in trajectories.into_iter().chain([("after", after)]) {
        for (name, value) in COLUMNS {
            channels.push(channel(
                when,
                name,
                trajectory.solutions.iter().map(value).collect(),
            ));
        }
        let Some(errors) = &trajectory.attitude_error_rad else {
            continue;
        };
        for (axis, name) in ["north", "east", "down"].into_iter().enumerate() {
            let values = errors.iter().map(|error| error[axis]).collect();
            channels.push(channel(when, &format!("attitude_error_{name}_rad"), values));
        }
    }
    Recording {
        name: format!("{}-navigation", recording.name),
        folder: PathBuf::new(),
        site: recording.site,
        tables: vec![Table {
            file: TABLE.to_owned(),
            clock: Clock::Uniform {
                rate_hz: 1.0 / readings.period_s,
                start_s: readings.start_s + after.first_period as f64 * readings.period_s,
            },
            rows: after.solutions.len(),
            channels,
        }],
        segments: recording.segments.clone(),
    }
}

impl Results {
    fn table(&self) -> String {
        let mut text = format!(
            "{}: aligned on {:.1} to {:.1} s, navigated to {:.1} s\n{:<34} {:>12} {:>12}",
            self.recording,
            self.aligned_s[0],
            self.aligned_s[1],
            self.navigated_s[1],
            "",
            "before",
            "after"
        );
        let mut row = |name: &str, value: &dyn Fn(&TrajectoryFigures) -> Option<f64>| {
            let cell = |figures: Option<&TrajectoryFigures>| {
                let value = figures.and_then(value);
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.5}"))
            };
            if value(&self.after).is_none() {
                return;
            }
            // writing to a String cannot fail
            let _ = write!(
                text,
                "\n{name:<34} {:>12} {:>12}",
                cell(self.before.as_ref()),
                cell(Some(&self.after))
            );
        };
        for (stretch, rest) in self.after.attitude_change_at_rest.iter().enumerate() {
            let name = |angle: &str| format!("{angle} change, {} [°]", rest.segment);
            let change = |figures: &TrajectoryFigures| {
                figures
                    .attitude_change_at_rest
                    .get(stretch)
                    .map(|rest| rest.change)
            };
            row(&name("roll"), &|f| Some(change(f)?.roll_deg));
            row(&name("pitch"), &|f| Some(change(f)?.pitch_deg));
            row(&name("heading"), &|f| Some(change(f)?.heading_deg));
        }
        row("largest north velocity [m/s]", &|f| {
            Some(f.max_velocity_m_s[0])
        });
        row("largest east velocity [m/s]", &|f| {
            Some(f.max_velocity_m_s[1])
        });
        for (axis, name) in ["north", "east", "down"].into_iter().enumerate() {
            row(&format!("error about {name} at the end [arcsec]"), &|f| {
                Some(f.final_attitude_error_arcsec?[axis])
            });
        }
        text
    }
}
