// aogrid: constants of the shading library, generated from Rust (`runtime/src/wgsl.rs`).

// T_clip's nodes lie at the ends of its axes: a look-up at x goes to x * SCALE + OFFSET.
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
// Squared length below which an axis is rounding and counts as none.
const AOGRID_AXIS_GUARD = 1e-8;
// Keeps the closed form of T_clip finite where the plane touches the cone's rim.
const AOGRID_RIM_GUARD = 1e-12;
// Fractions and cosines below which there is none.
const AOGRID_FRACTION_GUARD = 1e-6;
// An environment's map: its last level, whose cones are hemispheres, and level 0's rows.
const AOGRID_ENVIRONMENT_LAST_LEVEL = 4.0;
const AOGRID_ENVIRONMENT_HEIGHT = 256.0;
// The id of no object.
const AOGRID_NO_OBJECT = 4294967295u;
// Pixels along a tile's side, words of 32 occluders that a tile has room for, its lists.
const AOGRID_TILE = 16u;
const AOGRID_TILE_WORDS = 128u;
const AOGRID_LIST_OF_RECEIVERS = 0u;
const AOGRID_LIST_OF_ANYTHING = 1u;
const AOGRID_PI = 3.1415927;
