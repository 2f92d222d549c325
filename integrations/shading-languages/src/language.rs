//! naga's writers.

use naga::ShaderStage;
use naga::back::{glsl, hlsl};
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// The entry point that naga's writers need; it is cut off.
const ENTRY: &str = "aogrid_entry";

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Language {
    Glsl,
    Hlsl,
}

impl Language {
    pub const ALL: [Self; 2] = [Self::Glsl, Self::Hlsl];

    pub fn ending(self) -> &'static str {
        match self {
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
        }
    }

    /// Returns what a user must know to include a file.
    pub fn note(self) -> &'static str {
        match self {
            Self::Glsl => {
                "For GLSL ES 3.00 and GLSL 3.30\n// or later: write `#version` and, for ES, `precision highp \
                 float; precision highp int;` before it."
            }
            Self::Hlsl => "For shader model 5.0 or later.",
        }
    }

    /// Returns the condition of versions in which a function can be compiled, if not in all.
    pub fn condition(self, function: &str) -> Option<&'static str> {
        let is_newer = self == Self::Glsl && function.contains("findLSB(");
        is_newer.then_some("(defined(GL_ES) && __VERSION__ >= 310) || __VERSION__ >= 400")
    }

    /// Returns a WGSL library in this language, without directives and entry point.
    pub fn translate(self, wgsl: &str) -> Result<String, String> {
        let source = format!("{wgsl}\n@fragment fn {ENTRY}() {{}}\n");
        let module =
            naga::front::wgsl::parse_str(&source).map_err(|error| error.emit_to_string(&source))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .map_err(|error| error.emit_to_string(&source))?;
        let mut out = String::new();
        match self {
            Self::Glsl => {
                let options = glsl::Options {
                    version: glsl::Version::new_gles(300),
                    writer_flags: glsl::WriterFlags::empty(),
                    ..glsl::Options::default()
                };
                let pipeline = glsl::PipelineOptions {
                    shader_stage: ShaderStage::Fragment,
                    entry_point: ENTRY.into(),
                    multiview: None,
                };
                let policies = naga::proc::BoundsCheckPolicies::default();
                let mut writer =
                    glsl::Writer::new(&mut out, &module, &info, &options, &pipeline, policies)
                        .map_err(|error| error.to_string())?;
                writer.write().map_err(|error| error.to_string())?;
                Ok(between(&out, "precision highp int;\n", "void main() {"))
            }
            Self::Hlsl => {
                let options = hlsl::Options {
                    shader_model: hlsl::ShaderModel::V5_0,
                    ..hlsl::Options::default()
                };
                let pipeline = hlsl::PipelineOptions::default();
                hlsl::Writer::new(&mut out, &options, &pipeline)
                    .write(&module, &info, None)
                    .map_err(|error| error.to_string())?;
                Ok(between(&out, "", &format!("void {ENTRY}()")))
            }
        }
    }
}

/// Returns what is between two texts.
fn between(text: &str, before: &str, behind: &str) -> String {
    let (_, text) = text.split_once(before).unwrap_or(("", text));
    let (text, _) = text.split_once(behind).unwrap_or((text, ""));
    text.to_owned()
}
