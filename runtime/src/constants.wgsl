// aogrid: constants of the shading library, generated from Rust (`runtime/src/wgsl.rs`).

// T_clip has nodes at both ends of its axes: x is looked up at x * SCALE + OFFSET.
const AOGRID_CLIP_FRACTION_SCALE = 0.984375;
const AOGRID_CLIP_FRACTION_OFFSET = 0.0078125;
// The same for (cos beta + 1) / 2, with cos beta as the argument.
const AOGRID_CLIP_COS_SCALE = 0.4921875;
const AOGRID_CLIP_COS_OFFSET = 0.5;
// The same for T_merge: fractions AO/2 with 1 - AO as the argument, and gamma / pi with gamma.
const AOGRID_MERGE_FRACTION_SCALE = -0.48958334;
const AOGRID_MERGE_FRACTION_OFFSET = 0.5;
const AOGRID_MERGE_ANGLE_SCALE = 0.3083627;
const AOGRID_MERGE_ANGLE_OFFSET = 0.015625;
// The squared length below which an axis is rounding noise and counts as no axis.
const AOGRID_AXIS_EPSILON = 1e-8;
// The lower bound of a squared length in any unit that is a divisor.
const AOGRID_SQUARE_EPSILON = 1e-30;
// The cross product of two corners up to which the edge between them counts as seen from its end.
const AOGRID_LENGTH_EPSILON = 1e-18;
// Keeps the closed form of T_clip finite where the tangent plane touches the cone's rim.
const AOGRID_RIM_EPSILON = 1e-12;
// The lower bound for fractions and cosines used as divisors; smaller values count as zero.
const AOGRID_FRACTION_EPSILON = 1e-6;
// The upper bound of the flatness times the hull's squared sine of alpha.
const AOGRID_MAX_FLATNESS = 0.97;
// The environment map: its last level, whose cones are hemispheres, and the rows of level 0.
const AOGRID_ENVIRONMENT_LAST_LEVEL = 4.0;
const AOGRID_ENVIRONMENT_HEIGHT = 256.0;
// The id that stands for no object.
const AOGRID_NO_OBJECT = 4294967295u;
// Tiles: the side in pixels, the maximum number of words (32 occluders) in a list, the lists.
const AOGRID_TILE = 16u;
const AOGRID_TILE_WORDS = 128u;
const AOGRID_LIST_OPAQUE = 0u;
const AOGRID_LIST_ALL_DEPTHS = 1u;
// The weights of volumes.
const AOGRID_WEIGHT_NONE = 0u;
const AOGRID_WEIGHT_LINEAR = 1u;
const AOGRID_WEIGHT_EDGES = 2u;
const AOGRID_PI = 3.1415927;
