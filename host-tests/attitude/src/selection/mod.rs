//! Selection of registration groups and effects, and scans for effects of one gyro.

pub(crate) mod group_selection;

pub(crate) mod residual_scan;

pub(crate) mod expression_scan;

pub(crate) mod line_scan;

pub(crate) mod step_scan;

pub(crate) mod self_test;

pub(crate) mod search;
