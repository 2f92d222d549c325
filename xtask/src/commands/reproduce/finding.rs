//! The result of a figure: a verdict on the paper's claim, with tables and plots.

use std::fmt::Write;

use anyhow::Context;
use serde_json::Value;

use super::plot::Plot;

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Holds,
    Partly,
    Fails,
}

impl Verdict {
    /// Returns `Holds` or `Fails`.
    pub(super) fn of(holds: bool) -> Self {
        if holds { Self::Holds } else { Self::Fails }
    }

    /// Returns the word in the report.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Partly => "holds in part",
            Self::Fails => "does not hold",
        }
    }

    /// Returns the class in the report's style sheet.
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Partly => "partly",
            Self::Fails => "fails",
        }
    }
}

/// The RMSE of AO up to which two pictures look alike beside each other.
pub(super) const SIMILAR: f64 = 0.05;

/// A table with a heading for each column.
pub(super) struct Table {
    pub(super) header: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates a table without rows.
    pub(super) fn new(header: &[&str]) -> Self {
        Self {
            header: header.iter().map(|&text| text.to_owned()).collect(),
            rows: Vec::new(),
        }
    }
}

/// The result of a figure.
pub(super) struct Finding {
    pub(super) verdict: Verdict,
    /// The observation, and the reason where the claim does not hold.
    pub(super) text: String,
    pub(super) tables: Vec<Table>,
    pub(super) plots: Vec<Plot>,
}

impl Finding {
    /// Creates a finding of text alone.
    pub(super) fn new(verdict: Verdict, text: String) -> Self {
        Self {
            verdict,
            text,
            tables: Vec::new(),
            plots: Vec::new(),
        }
    }
}

/// The outputs of a figure's steps.
pub(super) struct Results(pub(super) Vec<(String, Value)>);

impl Results {
    /// Returns the number at a JSON pointer into a step's output.
    pub(super) fn number(&self, step: &str, pointer: &str) -> anyhow::Result<f64> {
        let value = self.value(step)?.pointer(pointer).and_then(Value::as_f64);
        value.with_context(|| format!("step {step}: no number at {pointer}"))
    }

    /// Returns a step's output.
    pub(super) fn value(&self, step: &str) -> anyhow::Result<&Value> {
        let found = self.0.iter().find(|(name, _)| name == step);
        let (_, value) = found.with_context(|| format!("no step {step}"))?;
        Ok(value)
    }

    /// Returns the RMSE, over all receivers, of the mode at `idx` in the output of `compare`.
    pub(super) fn rmse(&self, step: &str, idx: usize) -> anyhow::Result<f64> {
        self.number(step, &format!("/modes/{idx}/all/rmse"))
    }

    /// Returns the bias, over all receivers, of the mode at `idx` in the output of `compare`.
    pub(super) fn bias(&self, step: &str, idx: usize) -> anyhow::Result<f64> {
        self.number(step, &format!("/modes/{idx}/all/bias"))
    }
}

/// Returns a list of numbers with three digits, with commas between.
pub(super) fn list(numbers: &[f64]) -> String {
    let mut text = String::new();
    for (idx, number) in numbers.iter().enumerate() {
        let comma = if idx > 0 { ", " } else { "" };
        _ = write!(text, "{comma}{number:.3}");
    }
    text
}
