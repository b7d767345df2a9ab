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

/// One thing that may or may not be there, as a block of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Number of parameters.
    pub parameters: usize,
    /// What they do.
    pub terms: Vec<Term>,
    /// What it does besides, without a parameter of its own.
    pub fixed: Vec<Fixed>,
    /// ln of the number of places it was picked from, less what makes it likelier than others: a price in log posterior.
    pub price: f64,
}

impl Hypothesis {
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
