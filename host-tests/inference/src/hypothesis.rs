//! A hypothesis: parameters, and how each scales columns into records.

/// `parameter · coefficient · column` is part of a record.
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

/// `size · column` is part of a record whatever the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixed {
    /// Place of the record.
    pub record: usize,
    /// Place of the column.
    pub column: usize,
    /// Factor.
    pub size: f64,
}

/// What is known of a parameter before looking: its size, and values that it cannot have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Standard deviation of its prior about 0, in its unit; infinite where its size is not known.
    pub std: f64,
    /// Least and largest possible value.
    pub range: [f64; 2],
}

impl Bound {
    /// Nothing is known.
    pub const NONE: Self = Self {
        std: f64::INFINITY,
        range: [f64::NEG_INFINITY, f64::INFINITY],
    };

    /// The same of what a parameter is beyond `base`: the prior of a size is about 0, and none is left of it about another value.
    pub fn about(self, base: f64) -> Self {
        Self {
            std: if base == 0.0 { self.std } else { f64::INFINITY },
            range: self.range.map(|end| end - base),
        }
    }

    /// Whether an estimate lies outside the range by more than `deviations` of its standard deviations.
    pub fn excludes(&self, value: f64, std: f64, deviations: f64) -> bool {
        let [least, largest] = self.range;
        value < least - deviations * std || value > largest + deviations * std
    }
}

/// One thing that may or may not be there, as a block of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Number of parameters.
    pub parameters: usize,
    /// What they do.
    pub terms: Vec<Term>,
    /// What it does besides, without a parameter of its own.
    pub fixed: Vec<Fixed>,
    /// Place of a hypothesis without which this one means something else: its columns are made behind that one.
    pub requires: Option<usize>,
    /// What is known of each parameter; empty where nothing is known of any.
    pub bounds: Vec<Bound>,
    /// ln of the number of places it was picked from, less what makes it likelier than others: a price in log posterior.
    pub price: f64,
}

impl Hypothesis {
    /// Parameters of which nothing is known, at no price.
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

    /// What is known of a parameter.
    pub fn bound(&self, parameter: usize) -> Bound {
        self.bounds.get(parameter).copied().unwrap_or(Bound::NONE)
    }

    /// The same with what it does without a parameter as one more, whose value is 1.
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
