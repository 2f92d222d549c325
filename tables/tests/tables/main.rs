//! What the tables must be: one binary, its modules in the order of trust.

/// Cases with an answer that a formula of school geometry gives.
mod geometry;
/// Exact relations between entries.
mod invariants;
/// Random directions against integration: neither shares a formula with the other.
mod monte_carlo;

/// Integration against closed form, f32 against f64, and inputs that nobody should pass.
mod agreement;

/// Look-ups: where the nodes lie and how it is filtered between them.
mod look_ups;

/// The committed files against the generator.
mod committed;
/// The error report, and the errors it may report.
mod errors;
/// Both tables to read.
mod snapshots;

/// The arguments that several modules sweep over.
mod sweeps;
