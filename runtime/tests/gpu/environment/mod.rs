/// The functions of the library, one by one.
mod functions;
/// The pass, on whole images.
mod pass;

/// The evaluation of single functions.
mod harness;
