/// The functions of the library, one by one.
mod functions;
/// The pass, on whole images.
mod pass;

/// Light on baked surfaces, and its cones and coordinates.
mod surface;

/// The evaluation of single functions.
mod harness;
