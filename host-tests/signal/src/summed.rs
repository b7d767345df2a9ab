//! Sums of several rows into one: slow signals are kept, fast ones averaged.

use super::axes::Triad;
use super::streams::Streams;

impl Streams {
    /// Reduces `block` rows of gyros, case, pickoff, force, temperature and field to one, usable where all of its rows are.
    /// Rows at the end short of a block are dropped, as are accelerometers on rows of their own and stamps.
    pub fn sum_rows(&mut self, block: usize) {
        let rows = self.rows / block;
        let blocks = |values: &[f64]| -> Vec<f64> {
            values[..rows * block]
                .chunks_exact(block)
                .map(|rows| rows.iter().sum())
                .collect()
        };
        let sums = |triad: &Triad| -> Triad { [0, 1, 2].map(|axis: usize| blocks(&triad[axis])) };
        let means = |triad: &Triad| -> Triad {
            let mut means = sums(triad);
            let values = means.iter_mut().flatten();
            values.for_each(|value| *value /= block as f64);
            means
        };
        self.sensed_rad = sums(&self.sensed_rad);
        self.case_rad = sums(&self.case_rad);
        // Angles are at the rows' ends, after the one before the first row.
        self.pickoff_rad = self.pickoff_rad.as_ref().map(|triad| {
            let at_ends = |axis: usize| triad[axis].iter().step_by(block).take(rows + 1).copied();
            [0, 1, 2].map(|axis: usize| at_ends(axis).collect())
        });
        self.force_m_s2 = self.force_m_s2.as_ref().map(means);
        self.temperature_k = self.temperature_k.as_ref().map(means);
        self.magnetic_t = self.magnetic_t.as_ref().map(means);
        self.others.clear();
        self.stamps_s = None;
        let all = |flags: &[bool]| -> Vec<bool> {
            let blocks = flags[..rows * block].chunks_exact(block);
            blocks.map(|rows| rows.iter().all(|&row| row)).collect()
        };
        self.usable = all(&self.usable);
        self.measured = all(&self.measured);
        self.accelerometers = Err("rows were summed".to_string());
        self.rows = rows;
        self.rate_hz /= block as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::Streams;

    #[test]
    fn four_rows_become_one_and_a_row_out_of_use_takes_its_block() {
        let ramp: Vec<f64> = (0..10).map(f64::from).collect();
        let mut streams = Streams::of_motion(8.0, [ramp.clone(), ramp.clone(), ramp.clone()]);
        streams.temperature_k = Some([ramp.clone(), ramp.clone(), ramp]);
        streams.usable[5] = false;
        streams.sum_rows(4);
        assert_eq!((streams.rows, streams.rate_hz), (2, 2.0));
        assert_eq!(streams.sensed_rad[1], [6.0, 22.0]);
        assert_eq!(streams.usable, [true, false]);
        assert_eq!(streams.rows, 2);
        let temperature_k = streams.temperature_k.expect("measured");
        assert_eq!(temperature_k[2], [1.5, 5.5]);
    }
}
