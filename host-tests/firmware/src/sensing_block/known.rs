//! Writes down the parameters of the chain for a unit, with its known flexure.

use trueaxis::{FlexureResponse, Parameters};

use super::{Flexure, Unit};

/// Samples in one output period: frames at 1 kHz, so that no more than the chain's flexure is measured.
const SAMPLES_PER_OUTPUT: u16 = 4;

impl Unit {
    /// The chain's parameters for this unit if its flexure were `known`: the only place where a [`Flexure`] becomes
    /// [`Parameters`].
    pub fn chain_parameters(&self, known: &Flexure) -> Parameters {
        Parameters::default().with(|p| {
            p.samples_per_output = SAMPLES_PER_OUTPUT;
            p.pulse_weight_rad = self.pulse_weight_rad;
            p.bias_rad_s = self.bias_rad_s;
            p.scale_error = self.scale_error;
            p.installation_rad = self.installation_rad;
            p.pickoff_gain = self.pickoff_gain;
            p.pickoff_weight_rad = self.pickoff_weight_rad;
            p.flexure_s2 = known.s2;
            // The chain takes each pair's frequency from its K.
            p.flexure_response = match &known.mode {
                None => FlexureResponse::Static,
                Some(mode) => FlexureResponse::Mode {
                    damping: mode.damping,
                },
            };
        })
    }
}
