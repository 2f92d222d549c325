//! The complete shader sources: WGSL preceded by constants that are generated here.

use std::fmt::Write;

use crate::{rays, sweep};

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

/// Returns every shader of this crate, in every variant that a bake may use.
pub fn shaders() -> Vec<Shader> {
    let mut all = sweep::shaders();
    all.extend(rays::shaders());
    all
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_is_valid_and_every_wgsl_file_is_used() {
        let all = shaders();
        for shader in &all {
            let module = naga::front::wgsl::parse_str(&shader.source).unwrap_or_else(|e| {
                panic!("{}: {}", shader.name, e.emit_to_string(&shader.source))
            });
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            );
            if let Err(e) = validator.validate(&module) {
                panic!("{}: {}", shader.name, e.emit_to_string(&shader.source));
            }
            let found: Vec<_> = module
                .entry_points
                .iter()
                .map(|e| e.name.as_str())
                .collect();
            assert_eq!(found, [shader.entry_point], "{}", shader.name);
        }
        let mut files = 0;
        for folder in ["", "sweep", "rays"] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("src")
                .join(folder);
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.extension().is_some_and(|e| e == "wgsl") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    assert!(
                        all.iter().any(|s| s.source.contains(&text)),
                        "{}",
                        path.display()
                    );
                    files += 1;
                }
            }
        }
        assert!(files >= 15, "{files}");
    }
}
