//! Presets: placements and options that belong together.

use aogrid_grid_format::{BoundaryMode, Encoding, Interior};

use crate::{BakeOptions, Extent, Placement};

/// A placement and options that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// 32³ cells of moments, fitted near the surface, without a boundary treatment: 128 KiB in 8
    /// bits.
    Default,
    /// The same with 16³ cells, 16 KiB in 8 bits.
    Economy,
    /// The same with 48³ cells, 432 KiB in 8 bits.
    Fine,
    /// The method as printed in the papers: 32³ cones, ε = 0.1, the boundary treatment of the
    /// journal paper, and an interior of cells that see no sky.
    Paper,
}

impl Preset {
    /// Every preset, the recommended one first.
    pub const ALL: [Self; 4] = [Self::Default, Self::Economy, Self::Fine, Self::Paper];

    /// Returns the name on command lines and in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Economy => "economy",
            Self::Fine => "fine",
            Self::Paper => "paper",
        }
    }

    /// Returns the preset with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Returns the placement.
    pub fn placement(self) -> Placement {
        let epsilon = match self {
            Self::Paper => 0.1,
            Self::Default | Self::Economy | Self::Fine => 0.8,
        };
        Placement {
            resolution: match self {
                Self::Economy => [16; 3],
                Self::Default | Self::Paper => [32; 3],
                Self::Fine => [48; 3],
            },
            extent: Extent::Epsilon(epsilon),
            snap: self != Self::Paper,
        }
    }

    /// Returns the options.
    pub fn options(self) -> BakeOptions {
        match self {
            Self::Paper => BakeOptions {
                interior: Interior::Enclosed,
                ..BakeOptions::recommended()
            },
            Self::Default | Self::Economy | Self::Fine => BakeOptions {
                interior: Interior::Signed,
                boundary: BoundaryMode::None,
                encoding: Encoding::Moment,
                fit: true,
                self_offset: None,
                ..BakeOptions::recommended()
            },
        }
    }
}
