//! NumPy array files.

use std::path::Path;

use npyz::WriterBuilder;

use crate::output;

/// Writes `values` as an array of f32 of this shape, in C order.
pub fn write(path: &Path, shape: &[usize], values: Vec<f32>) -> anyhow::Result<()> {
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    output::write_with(path, |file| {
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&shape)
            .writer(file)
            .begin_nd()?;
        writer.extend(values)?;
        writer.finish()
    })
}
