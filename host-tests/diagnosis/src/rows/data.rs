//! Data of the search: residual of the model, reference, measured inputs, and the use of each row.

use rlg_plan::Plan;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;
use rlg_catalogue::signals::{Inputs, Path, Signals};
use rlg_catalogue::turned::{TURNED, known_turn};
use rlg_catalogue::{Column, Sensed};
use rlg_inference::{Observations, TooFewRows};
use rlg_model::Model;
use rlg_recording::error::InputError;
use rlg_signal::own_lines::OwnLine;
use rlg_signal::partition::{Partition, Use};
use rlg_signal::residual::{body_from_sensing, without_effects};
use rlg_signal::streams::{Streams, Triad, add, add_triad, each_axis, weighted_sum};

use super::model_effects::{is_in, known, known_by_axis, known_path};
use super::preprocessed_parts::Aside;
use super::pulse_resolution::Lattice;

/// Quantities that stay constant while effects are searched for.
pub struct Data<'a> {
    /// Aligned channels.
    pub streams: &'a Streams,
    /// The model.
    pub model: &'a Model,
    /// Sensed minus predicted increments \[rad\], with the model's delays, low passes and mounts in the prediction but not
    /// its other effects.
    pub residual_rad: Triad,
    /// Increments removed from the residual before the search \[rad\].
    pub aside: Aside,
    /// Spectral lines on gyros only, part of the removed increments.
    pub own_lines: Vec<OwnLine>,
    /// Delays, low passes and mounts of the model.
    known_path: Path,
    /// Increments of the reference \[rad\] after the model's delays, low passes and mounts.
    pub reference_rad: Arc<Triad>,
    /// Increments of the block against the case \[rad\].
    pub dither_rad: Option<Triad>,
    /// Constants of unknown size (nuisance parameters): the share of each in each gyro.
    pub free_constants: Vec<Vec<f64>>,
    /// Rates along the sensing axes from body rates: the inverse of Eq. (7)'s matrix.
    pub sensing_from_body: Matrix3<f64>,
    /// Effects of the model: gyro, column, size.
    pub known: Vec<(usize, Sensed, f64)>,
    /// Share of each axis sensed by each gyro \[1\] beyond the model, as found so far.
    pub found_share: Matrix3<f64>,
    /// Largest delay of a gyro against the reference \[rows\], negative if the reference is late.
    pub late_rows: f64,
    /// Use of every row.
    pub partition: Partition,
    /// Rows at which a segment of the recording begins or ends, the first row and the end included.
    pub cuts: Vec<usize>,
    /// Quantisation of the gyros without a dither.
    pub lattice: Lattice,
    /// Noise-free increments predicted by the model for gyros with a detected quantisation step \[rad\]; 0 in rows that only
    /// test.
    pub counted_rad: [Option<Vec<f64>>; 3],
}

impl<'a> Data<'a> {
    /// Prepares an aligned recording and consumes its sensed increments: the residual replaces them.
    ///
    /// # Errors
    /// The installation matrix has no inverse.
    pub fn new(
        streams: &'a mut Streams,
        model: &'a Model,
        plan: &Plan,
        file: &std::path::Path,
    ) -> Result<Self, InputError> {
        let sensing_from_body = body_from_sensing(&model.gyro.installation_rad)
            .try_inverse()
            .ok_or_else(|| {
                InputError::new(file, "the installation matrix has no inverse")
                    .channel("gyro.installation_rad")
            })?;
        let dither_rad = streams.dither_rad();
        let mut residual_rad =
            without_effects(streams, model, sensing_from_body, dither_rad.as_ref());
        let path = known_path(model, streams);
        let reference_rad: Triad = each_axis(|axis| {
            let case_rad = &streams.case_rad[axis];
            path.along(axis, case_rad, streams.rate_hz).into_owned()
        });
        if path != Path::default() {
            let scale = model.gyro.scale_error;
            let sensed = passed(
                &streams.case_rad,
                path,
                (sensing_from_body, scale),
                streams.rate_hz,
            );
            add_triad(&mut residual_rad, &sensed, -1.0);
        }
        let segments = segments(streams);
        let partition = Partition::new(
            streams.rows,
            streams.rate_hz,
            &segments,
            &plan.signal.partition,
        );
        let seen = partition.rows_of(&[Use::Fit], &streams.usable);
        let lattice = Lattice::of(streams, model, &|row| seen[row], plan);
        let counted_rad = std::array::from_fn(|axis| {
            (lattice.counted_rad[axis] > 0.0).then(|| {
                let (sensed_rad, residual_rad) = (&streams.sensed_rad[axis], &residual_rad[axis]);
                let of_row = |row: usize| match seen[row] {
                    true => sensed_rad[row] - residual_rad[row],
                    false => 0.0,
                };
                (0..streams.rows).map(of_row).collect()
            })
        });
        streams.sensed_rad = Triad::default();
        let streams = &*streams;
        Ok(Self {
            residual_rad,
            aside: Aside::default(),
            own_lines: Vec::new(),
            known_path: path,
            reference_rad: Arc::new(reference_rad),
            partition,
            cuts: cuts(&segments, streams.rows),
            late_rows: path.longest_delay_s() * streams.rate_hz,
            known: Vec::new(),
            found_share: Matrix3::zeros(),
            free_constants: Vec::new(),
            lattice,
            counted_rad,
            streams,
            model,
            dither_rad,
            sensing_from_body,
        })
    }

    /// Resets the delay and the shares found by a search, as the next one may select others.
    pub fn forget_found(&mut self) {
        self.late_rows = self.known_path.longest_delay_s() * self.streams.rate_hz;
        self.found_share = Matrix3::zeros();
    }

    /// Measured channels, besides the motion, from which columns are computed.
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs::of(self.streams)
    }

    /// Usable rows that serve one of `uses` and whose reference was recorded, as a mask.
    pub fn rows_of(&self, uses: &[Use]) -> Vec<bool> {
        let rows = self.partition.rows_of(uses, &self.streams.usable);
        reached(&rows, self.late_rows)
    }

    /// Rows that are `seen`, as one span. In a stretch of a longer recording the level is a free parameter: the whole
    /// recording determines it.
    ///
    /// # Errors
    /// They are too few.
    pub fn observed(&self, seen: &[bool]) -> Result<Observations, TooFewRows> {
        let observed = Observations::bridged(seen)?;
        Ok(match self.streams.is_stretch() {
            true => observed.with_free_levels(),
            false => observed,
        })
    }

    /// Contiguous ranges of [`Data::rows_of`].
    pub fn ranges_of(&self, uses: &[Use]) -> Vec<Range<usize>> {
        rlg_inference::observations::runs(&self.rows_of(uses), true)
    }

    /// Reads the model's effects as columns, which need `signals`.
    pub fn set_known(&mut self, signals: &Signals) {
        let turned_rad = known_by_axis(TURNED, self.model, self.streams).into();
        self.known = self
            .model
            .effects
            .iter()
            .filter(|effect| is_in(effect, self.streams))
            .filter_map(|effect| known(effect, turned_rad, signals, self.streams))
            .flatten()
            .chain(known_turn(turned_rad, signals))
            .collect();
    }

    /// Share of each axis sensed by each gyro \[1\], by the model with its effects and by the effects found so far.
    pub fn shared(&self) -> Matrix3<f64> {
        let scaled = self.model.gyro.scale_error.map(|error| 1.0 / (1.0 - error));
        let scaled = Matrix3::from_diagonal(&scaled.into());
        let mut shared = scaled * self.sensing_from_body + self.found_share;
        for (gyro, sensed, size) in &self.known {
            if let Column::Increment(axis) = sensed.column {
                shared[(*gyro, axis)] += size;
            }
        }
        shared
    }

    /// Increment of the case per increment of the reference \[1\], by axes, by the model with its effects and by the effects
    /// found so far.
    pub fn turned_by_all(&self) -> Matrix3<f64> {
        let scaled = self.model.gyro.scale_error.map(|error| 1.0 - error);
        let scaled = Matrix3::from_diagonal(&scaled.into());
        let body_from_sensing = self.sensing_from_body.try_inverse();
        body_from_sensing.map_or_else(Matrix3::identity, |inverse| {
            inverse * scaled * self.shared()
        })
    }

    /// Change of the reference's noise by the model's low passes and mounts, as sensed by the gyros \[rad\]; `None` without
    /// any.
    pub fn passed_noise_rad(&self, signals: &Signals) -> Option<Triad> {
        let path = self.known_path;
        if path.mount == [None; 3] && path.low_pass == [None; 3] {
            return None;
        }
        let rate_hz = signals.rate_hz;
        let noise: Triad = each_axis(|axis| {
            let behind = &signals.likeliest.case_rad[axis];
            let behind_known = signals.path.before(axis, behind, rate_hz);
            let case_rad = path.before(axis, &behind_known, rate_hz);
            let mut noise = self.streams.case_rad[axis].clone();
            add(&mut noise, &case_rad, -1.0);
            noise
        });
        let sensing = (self.sensing_from_body, self.model.gyro.scale_error);
        Some(passed(&noise, path, sensing, rate_hz))
    }

    /// Change of the sensed increments by a path that is not in the model, from the measured reference \[rad\].
    pub(crate) fn passed_by(&self, path: Path) -> Triad {
        let sensing = (self.sensing_from_body, self.model.gyro.scale_error);
        passed(&self.reference_rad, path, sensing, self.streams.rate_hz)
    }

    /// Sensed increments by the model's effects other than delays, low passes and mounts \[rad\].
    pub fn known_rad(&self, signals: &Signals) -> Triad {
        let mut sum: Triad = std::array::from_fn(|_| vec![0.0; signals.rows]);
        for (gyro, column, size) in &self.known {
            add(&mut sum[*gyro], &column.values(signals), *size);
        }
        sum
    }
}

/// Rows of the recording's segments.
fn segments(streams: &Streams) -> Vec<Range<usize>> {
    let segments = streams.piece.segments.iter();
    let row = |time_s: f64| {
        let rows = ((time_s - streams.start_s) * streams.rate_hz).round();
        (rows.max(0.0) as usize).min(streams.rows)
    };
    segments
        .map(|segment| row(segment.start_s)..row(segment.end_s))
        .collect()
}

/// Rows at which a segment begins or ends, the first row and the end included, ascending.
fn cuts(segments: &[Range<usize>], rows: usize) -> Vec<usize> {
    let mut cuts: Vec<usize> = segments
        .iter()
        .flat_map(|segment| [segment.start, segment.end])
        .chain([0, rows])
        .collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

/// Change of the sensed increments by a path \[rad\], for increments of the reference \[rad\].
fn passed(
    reference_rad: &Triad,
    path: Path,
    (sensing_from_body, scale_error): (Matrix3<f64>, [f64; 3]),
    rate_hz: f64,
) -> Triad {
    let mounted: Triad = each_axis(|axis| match path.mount[axis] {
        None => reference_rad[axis].clone(),
        Some(mount) => Path::through(&reference_rad[axis], rate_hz, |hz| mount.whole(hz)),
    });
    let on_gyros = Path {
        mount: [None; 3],
        ..path
    };
    each_axis(|gyro| {
        let along = |triad: &Triad, factor: f64| {
            weighted_sum(
                [0, 1, 2].map(|axis| factor * sensing_from_body[(gyro, axis)]),
                triad,
            )
        };
        let sensed = 1.0 / (1.0 - scale_error[gyro]);
        let mut beyond = on_gyros
            .along(gyro, &along(&mounted, sensed), rate_hz)
            .into_owned();
        add(&mut beyond, &along(reference_rad, sensed), -1.0);
        beyond
    })
}

/// Values on all rows, bridged over rows that may not be used, 0 outside the spans.
pub fn bridged(values: &Triad, observations: &Observations) -> Triad {
    std::array::from_fn(|axis| {
        let mut all = vec![0.0; observations.record_rows];
        for span in &observations.spans {
            all[span.rows.clone()].copy_from_slice(&span.bridge(&values[axis]));
        }
        all
    })
}

/// Rows that may be used and whose reference, `late_rows` before each, was recorded.
pub fn reached(seen: &[bool], late_rows: f64) -> Vec<bool> {
    let mut rows = seen.to_vec();
    let count = rows.len();
    let away = (late_rows.abs().ceil() as usize).min(count);
    if late_rows >= 1.0 {
        rows[..away].fill(false);
    } else if late_rows <= -1.0 {
        rows[count - away..].fill(false);
    }
    rows
}
