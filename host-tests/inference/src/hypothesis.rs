//! A hypothesis: parameters, and their scaled columns in the records.

/// A contribution `parameter · coefficient · column` to a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Place of the parameter in its hypothesis.
    pub parameter: usize,
    /// Place of the record.
    pub record: usize,
    /// Place of the column.
    pub column: usize,
    /// Factor.
    pub coefficient: f64,
}

/// A contribution `size · column` to a record, independent of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixed {
    /// Place of the record.
    pub record: usize,
    /// Place of the column.
    pub column: usize,
    /// Factor.
    pub size: f64,
}

/// Prior knowledge of a parameter: its size, and its possible range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Standard deviation of its prior about 0, in its unit; infinite for an unknown size.
    pub std: f64,
    /// Least and largest possible value.
    pub range: [f64; 2],
}

impl Bound {
    /// No prior knowledge.
    pub const NONE: Self = Self {
        std: f64::INFINITY,
        range: [f64::NEG_INFINITY, f64::INFINITY],
    };

    /// Bound of the parameter's deviation from `base`: the prior of the size is about 0, and does not apply about another
    /// value.
    pub fn about(self, base: f64) -> Self {
        Self {
            std: if base == 0.0 { self.std } else { f64::INFINITY },
            range: self.range.map(|end| end - base),
        }
    }

    /// True if an estimate lies outside the range by more than `deviations` of its standard deviations.
    pub fn excludes(&self, value: f64, std: f64, deviations: f64) -> bool {
        let [least, largest] = self.range;
        value < least - deviations * std || value > largest + deviations * std
    }
}

/// A possible effect, as a block of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Number of parameters.
    pub parameters: usize,
    /// Contributions scaled by the parameters.
    pub terms: Vec<Term>,
    /// Contributions without a parameter.
    pub fixed: Vec<Fixed>,
    /// Place of a hypothesis required by this one: its columns are made given that one.
    pub requires: Option<usize>,
    /// Prior knowledge of each parameter; empty for none at all.
    pub bounds: Vec<Bound>,
    /// Price in log posterior: ln of the number of places searched (look-elsewhere), less the ln of its prior weight.
    pub price: f64,
}

impl Hypothesis {
    /// Parameters without prior knowledge, at no price.
    pub fn of_terms(parameters: usize, terms: Vec<Term>) -> Self {
        Self {
            parameters,
            terms,
            fixed: Vec::new(),
            bounds: Vec::new(),
            requires: None,
            price: 0.0,
        }
    }

    /// Prior knowledge of a parameter.
    pub fn bound(&self, parameter: usize) -> Bound {
        self.bounds.get(parameter).copied().unwrap_or(Bound::NONE)
    }

    /// Turns the fixed contributions into those of one more parameter, of value 1.
    pub fn with_fixed_as_parameter(&self) -> Self {
        let mut whole = self.clone();
        whole.terms.extend(whole.fixed.drain(..).map(|one| Term {
            parameter: self.parameters,
            record: one.record,
            column: one.column,
            coefficient: one.size,
        }));
        whole.parameters += usize::from(whole.terms.len() > self.terms.len());
        whole
    }
}
