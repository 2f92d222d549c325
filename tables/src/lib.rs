//! The tables `T_clip` and `T_merge`, with which a renderer clips an occlusion cone by a
//! receiver's tangent plane and unites two cones (RR-5779, section 5; JGT supplement).
//!
//! Nothing here yet: the crate's place in the workspace is fixed, its contents are to come.
