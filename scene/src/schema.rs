//! The keys of scene files; `docs/scenes.md` documents them for users.

use aogrid_bake_core::Preset;
use aogrid_bake_core::surface::Weights;
use aogrid_grid_format::{
    BoundaryMode, Encoding, Interior, MAX_RESOLUTION, MIN_RESOLUTION, TexelFormat,
};
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::values::{Color, Finite, NonNegative, OneOrThree, Positive, Triple, Whole};

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub up: Option<UpAxis>,
    pub camera: Option<Spanned<CameraFile>>,
    pub picture: Option<PictureFile>,
    pub truth: Option<TruthFile>,
    pub volumes: Option<Spanned<VolumesFile>>,
    pub ambient: Option<Color>,
    pub area_light: Option<Spanned<AreaLightFile>>,
    pub environment: Option<Spanned<EnvironmentFile>>,
    pub receivers: Option<Spanned<ReceiversFile>>,
    #[serde(default, rename = "material")]
    pub materials: Vec<MaterialFile>,
    #[serde(default, rename = "mesh")]
    pub meshes: Vec<Spanned<MeshFile>>,
    #[serde(default, rename = "instance")]
    pub instances: Vec<Spanned<InstanceFile>>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum UpAxis {
    #[default]
    Y,
    Z,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraFile {
    pub position: Triple,
    pub target: Triple,
    pub vertical_fov: Option<Positive>,
    pub height: Option<Positive>,
    #[serde(default = "default_resolution")]
    pub resolution: [Whole<1, 4096>; 2],
}

fn default_resolution() -> [Whole<1, 4096>; 2] {
    [Whole(480), Whole(360)]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PictureFile {
    pub exposure: Option<Positive>,
    pub show: Option<ShowFile>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ShowFile {
    Ao,
    Light,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VolumesFile {
    pub extent: Option<Positive>,
    pub weight: Option<WeightFile>,
    pub exponent: Option<Spanned<NonNegative>>,
    #[serde(default)]
    pub two_sided: bool,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum WeightFile {
    None,
    #[default]
    Linear,
    Edges,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TruthFile {
    pub samples: Option<Whole<2, 1_000_000>>,
    pub error: Option<Positive>,
    pub seed: Option<Whole<0, { u32::MAX }>>,
    pub max_distance: Option<Positive>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AreaLightFile {
    pub center: Triple,
    pub half_u: Triple,
    pub half_v: Triple,
    pub radiance: Color,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentFile {
    pub file: Option<String>,
    pub color: Option<Color>,
    pub room: Option<RoomFile>,
    pub yaw: Option<Finite>,
    pub up: Option<UpAxis>,
    pub scale: Option<NonNegative>,
}

/// The walls of a room that is infinitely large compared with the scene.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RoomFile {
    pub right: Color,
    pub left: Color,
    pub ceiling: Color,
    pub floor: Color,
    pub front: Color,
    pub back: Color,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceiversFile {
    pub csv: Option<String>,
    pub corner: Option<Triple>,
    pub u: Option<Triple>,
    pub v: Option<Triple>,
    pub count: Option<[Whole<1, 100_000>; 2]>,
    pub object: Option<Spanned<String>>,
    pub lift: Option<NonNegative>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialFile {
    pub name: Spanned<String>,
    pub albedo: Color,
    pub gloss: Option<Spanned<Positive>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshFile {
    pub name: Spanned<String>,
    pub file: Option<String>,
    pub sample: Option<Spanned<String>>,
    pub triangles: Option<Whole<1, 20_000_000>>,
    pub rectangle: Option<[Positive; 2]>,
    pub parts: Option<bool>,
    pub part: Option<Spanned<String>>,
    pub pose: Option<Spanned<PoseFile>>,
    pub grid: Option<Spanned<GridFile>>,
    pub surface: Option<Spanned<SurfaceFile>>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SurfaceFile {
    pub file: Option<String>,
    pub rays: Option<Whole<1, 65_536>>,
    pub weights: Option<WeightsFile>,
}

/// A time of an animation.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PoseFile {
    pub animation: Option<String>,
    pub time: Option<Finite>,
}

/// A number of cells along an axis.
pub(super) type Cells = Whole<MIN_RESOLUTION, MAX_RESOLUTION>;

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GridFile {
    pub file: Option<String>,
    pub resolution: Option<OneOrThree<Cells>>,
    pub preset: Option<PresetFile>,
    pub epsilon: Option<Positive>,
    pub snap: Option<bool>,
    pub half_extents: Option<[Positive; 3]>,
    pub face_size: Option<Whole<8, 128>>,
    pub rays: Option<Whole<1, 100_000>>,
    pub seed: Option<Whole<0, { u32::MAX }>>,
    pub max_distance: Option<Positive>,
    pub encoding: Option<EncodingFile>,
    pub format: Option<FormatFile>,
    pub boundary: Option<BoundaryFile>,
    pub interior: Option<InteriorFile>,
    pub fit: Option<bool>,
    pub self_offset: Option<NonNegative>,
    pub sample_offset: Option<[Finite; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InstanceFile {
    pub mesh: Spanned<String>,
    pub name: Option<String>,
    pub id: Option<Whole<1, 65535>>,
    pub translate: Option<Triple>,
    pub rotate: Option<Spanned<RotationFile>>,
    pub scale: Option<Spanned<OneOrThree<Finite>>>,
    pub material: Option<Spanned<String>>,
    pub casts: Option<bool>,
    pub strength: Option<NonNegative>,
    pub far_field: Option<NonNegative>,
    pub layers: Option<Vec<Layer>>,
    pub casts_on: Option<Vec<Layer>>,
    #[serde(default)]
    pub excludes: Vec<Whole<1, 65535>>,
}

/// A layer's number.
pub(super) type Layer = Whole<0, 31>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotationFile {
    pub axis: Triple,
    pub degrees: Finite,
}

/// Defines the form of an enumeration in scenes: the names that its values have on
/// command lines.
macro_rules! names {
    ($file:ident for $target:ident) => {
        #[derive(Clone, Copy)]
        pub(super) struct $file($target);

        impl From<$file> for $target {
            fn from(file: $file) -> Self {
                file.0
            }
        }

        impl<'de> Deserialize<'de> for $file {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let name = String::deserialize(deserializer)?;
                $target::from_name(&name)
                    .map(Self)
                    .ok_or_else(|| unknown_name(&name, &$target::ALL.map($target::name)))
            }
        }
    };
}

/// Returns serde's error of an unknown variant, for names that are not known at compile time.
fn unknown_name<E: Error>(name: &str, known: &[&str]) -> E {
    let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
    let expected = match &known[..] {
        [first, second] => format!("{first} or {second}"),
        _ => format!("one of {}", known.join(", ")),
    };
    E::custom(format!("unknown variant `{name}`, expected {expected}"))
}

names!(EncodingFile for Encoding);
names!(FormatFile for TexelFormat);
names!(BoundaryFile for BoundaryMode);
names!(InteriorFile for Interior);
names!(PresetFile for Preset);
names!(WeightsFile for Weights);
