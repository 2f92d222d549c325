//! The complete shader sources: WGSL preceded by constants that are generated here.

use std::fmt::Write;

/// The complete source of a shader module.
#[derive(Clone, Debug)]
pub struct Shader {
    /// The name in labels and reports.
    pub name: &'static str,
    /// The WGSL, constants included.
    pub source: String,
    /// The compute entry point.
    pub entry_point: &'static str,
}

/// Invocations per workgroup in all kernels: two waves of 32 or one of 64.
pub(crate) const WORKGROUP: u32 = 64;

/// A builder of WGSL constant declarations.
#[derive(Clone, Default)]
pub(crate) struct Constants(String);

impl Constants {
    pub(crate) fn unsigned(mut self, name: &str, value: u32) -> Self {
        let _ = writeln!(self.0, "const {name}: u32 = {value}u;");
        self
    }

    pub(crate) fn float(mut self, name: &str, value: f32) -> Self {
        let _ = writeln!(self.0, "const {name}: f32 = {value:e}f;");
        self
    }

    pub(crate) fn boolean(mut self, name: &str, value: bool) -> Self {
        let _ = writeln!(self.0, "const {name}: bool = {value};");
        self
    }

    /// Returns the constants followed by the parts of a shader.
    pub(crate) fn before(&self, parts: &[&str]) -> String {
        format!("{}\n{}", self.0, parts.join("\n"))
    }
}
