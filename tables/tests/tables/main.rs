//! Tests of the tables: one binary, the most independent checks first.

/// Cases with a solution in elementary geometry.
mod geometry;
/// Exact relations between entries.
mod invariants;
/// Random directions against integration, which share no formula.
mod monte_carlo;

/// Integration against closed form, f32 against f64, and invalid inputs.
mod agreement;

/// Look-ups: positions of the nodes and filtering between them.
mod look_ups;

/// The committed files against the generator.
mod committed;
/// The error report, and bounds on the errors.
mod errors;
/// Both tables as readable text.
mod snapshots;

/// The arguments that several modules sweep over.
mod sweeps;
