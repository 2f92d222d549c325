//! The sweep's kernels: their sources with generated constants, and their bindings.

use wgpu::Device;

use super::gpu_data::{MAX_BATCHES, MAX_ROWS, SUBSET_SUMS, TABLE_LEN};
use super::mesh;
use super::plan::LANES;
use crate::kernel::{Binding, Kernel};
use crate::shaders::{Constants, Shader, WORKGROUP};

/// The increment for one pair in the word that counts both the pairs and the pieces of a
/// workgroup. [`deltas_per_piece`](super::pass::deltas_per_piece) keeps the number of pieces
/// below it.
pub(super) const ONE_PAIR: u32 = 1 << 21;
const _: () = assert!(WORKGROUP * MAX_BATCHES < u32::MAX / ONE_PAIR && WORKGROUP <= 64);

/// The kernels of the sweep, compiled for narrow or wide counters, with or without directions.
pub(super) struct Kernels {
    pub silhouettes: Kernel,
    pub levels: Kernel,
    pub crossings: Kernel,
    pub row_hits: Kernel,
    pub summation: Kernel,
    pub moments: Kernel,
}

impl Kernels {
    pub(super) fn new(device: &Device, wide: bool, directions: bool) -> Self {
        use Binding::{Read, Uniform, Write};
        let compile = |shader: &Shader, bindings: &[Binding]| {
            Kernel::new(device, shader, &[&[Uniform], bindings].concat())
        };
        let crossings = [Write, Write, Uniform, Read, Read, Read, Read];
        let row_hits = [Write, Write, Uniform, Read, Read, Read];
        Self {
            silhouettes: compile(&silhouettes(), &[Read, Write]),
            levels: compile(&levels(), &[Uniform, Uniform, Read, Write]),
            crossings: compile(&self::crossings(wide), &crossings),
            row_hits: compile(&self::row_hits(wide), &row_hits),
            summation: compile(&summation(wide), &[Write, Write]),
            moments: compile(&moments(directions), &[Read, Uniform, Write]),
        }
    }
}

/// Returns the sources of all kernels, in every variant.
pub(crate) fn shaders() -> Vec<Shader> {
    let mut all = vec![silhouettes(), levels()];
    for wide in [false, true] {
        all.extend([crossings(wide), row_hits(wide), summation(wide)]);
    }
    all.extend([false, true].map(moments));
    all
}

fn constants() -> Constants {
    Constants::default()
        .unsigned("WORKGROUP", WORKGROUP)
        .unsigned("LANES", LANES)
        .unsigned("LANE_MASK", (1 << LANES) - 1)
        .unsigned("ROW_SLOPE_VECTORS", MAX_ROWS / 4)
        .unsigned("TABLE_LEN", TABLE_LEN as u32)
}

fn with_counters(wide: bool) -> Constants {
    constants()
        .boolean("WIDE", wide)
        // The number of counter planes of a side: a word holds one direction, or four.
        .unsigned("SIDE_PLANES", if wide { LANES } else { LANES / 4 })
        .unsigned("BYTE_BIAS", 0x8080_8080)
}

const CHUNK: &str = include_str!("../chunk.wgsl");
const FRAME: &str = include_str!("frame.wgsl");
const INTEGERS: &str = include_str!("integers.wgsl");
const COUNTERS: &str = include_str!("counters.wgsl");

fn silhouettes() -> Shader {
    let constants = constants()
        // The smallest ratio of a normal's u component to its other components that is used.
        // Below it the flip lies beyond the ends of a row of texels, or the triangle is seen
        // edge-on.
        .float("MIN_NORMAL_RATIO", 1e-12)
        .float("MIN_NORMAL", 1e-30);
    Shader {
        name: "sweep: silhouettes",
        source: constants.before(&[CHUNK, FRAME, include_str!("silhouettes.wgsl")]),
        entry_point: "silhouettes",
    }
}

fn levels() -> Shader {
    Shader {
        name: "sweep: levels",
        source: constants().before(&[CHUNK, FRAME, include_str!("levels.wgsl")]),
        entry_point: "levels_of_vertices",
    }
}

fn crossings(wide: bool) -> Shader {
    let constants = with_counters(wide)
        .unsigned("QUEUE_LEN", WORKGROUP * MAX_BATCHES)
        .unsigned("ONE_PAIR", ONE_PAIR)
        .unsigned("TRIANGLE_MASK", !mesh::REVERSED)
        .unsigned("REVERSED", mesh::REVERSED)
        .unsigned("ALL_REVERSED", 0x8080_8080)
        .unsigned("LOW_BITS", 0x7f7f_7f7f)
        .unsigned("HIGH_BITS", 0x8080_8080)
        // A multiplication with this moves bits 0, 8, 16 and 24 to 28, 29, 30 and 31.
        .unsigned("GATHER", 0x1020_4080)
        // Four roundings of 2⁻²⁴, doubled for safety.
        .float("PRODUCT_ROUNDING", 1.0 / (1 << 21) as f32);
    let parts = [
        CHUNK,
        FRAME,
        INTEGERS,
        COUNTERS,
        include_str!("crossings.wgsl"),
    ];
    Shader {
        name: if wide {
            "sweep: wide crossings"
        } else {
            "sweep: crossings"
        },
        source: constants.before(&parts),
        entry_point: "crossings",
    }
}

fn row_hits(wide: bool) -> Shader {
    let constants = with_counters(wide)
        .unsigned("ABOVE", super::row_hits::ABOVE)
        .unsigned("ABOVE_IF_UP", super::row_hits::ABOVE_IF_UP)
        .unsigned("ABOVE_IF_DOWN", super::row_hits::ABOVE_IF_DOWN);
    Shader {
        name: if wide {
            "sweep: wide piercings"
        } else {
            "sweep: piercings"
        },
        source: constants.before(&[CHUNK, FRAME, COUNTERS, include_str!("row_hits.wgsl")]),
        entry_point: "piercings",
    }
}

fn summation(wide: bool) -> Shader {
    let rows = include_str!("rows.wgsl");
    if wide {
        let parts = [CHUNK, FRAME, rows, include_str!("wide_summation.wgsl")];
        return Shader {
            name: "sweep: wide summation",
            source: with_counters(wide).before(&parts),
            entry_point: "wide_summation",
        };
    }
    let constants = with_counters(wide)
        .unsigned("EVEN_BYTES", 0x00ff_00ff)
        .unsigned("EVEN_BYTE_BIAS", 0x0080_0080)
        .unsigned("HALF_BIAS", 0x8000_8000);
    Shader {
        name: "sweep: summation",
        source: constants.before(&[CHUNK, FRAME, rows, include_str!("summation.wgsl")]),
        entry_point: "summation",
    }
}

fn moments(directions: bool) -> Shader {
    let constants = constants()
        .boolean("WITH_DIRECTIONS", directions)
        .unsigned("SUBSET_SUMS", SUBSET_SUMS);
    Shader {
        name: match directions {
            true => "sweep: moments",
            false => "sweep: moments without directions",
        },
        source: constants.before(&[CHUNK, FRAME, include_str!("moments.wgsl")]),
        entry_point: "moments",
    }
}
