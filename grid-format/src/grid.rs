//! The in-memory form of a grid file.

use crate::{BakeRecord, Check, EncodeError, Encoding, GridSpec, TexelFormat};

/// An encoded grid: texels ready for upload, their box in object space, and their bake record.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub(crate) spec: GridSpec,
    pub(crate) encoding: Encoding,
    pub(crate) format: TexelFormat,
    pub(crate) record: BakeRecord,
    pub(crate) statistics: Statistics,
    pub(crate) writer: String,
    pub(crate) checksum: Option<String>,
    pub(crate) texels: Vec<u8>,
}

/// Statistics of the stored occlusion over all cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The mean of a, 0..1.
    pub mean: f64,
    /// The largest a, 0..1.
    pub largest: f32,
}

impl Grid {
    /// Encodes `cells`, one `[x, y, z, a]` for each cell of `spec`, x fastest. a is the occluded
    /// fraction of the sphere. The vector points toward the object, in object axes: for
    /// [`Encoding::Cone`] it is the unit axis d, zero where nothing is occluded; for
    /// [`Encoding::Moment`] it is v = m/(a(1 − a)); an encoding [without a
    /// direction](Encoding::has_direction) drops it.
    ///
    /// # Errors
    ///
    /// The number of cells is not that of `spec`, an a is outside 0..=1, or a component of the
    /// vector is outside −1..=1.
    pub fn encode(
        spec: GridSpec,
        encoding: Encoding,
        format: TexelFormat,
        cells: &[[f32; 4]],
        record: BakeRecord,
    ) -> Result<Self, EncodeError> {
        if cells.len() != spec.cell_count() {
            return Err(EncodeError::CellCount {
                expected: spec.cell_count(),
                found: cells.len(),
            });
        }
        let mut texels =
            Vec::with_capacity(cells.len() * encoding.channels() * format.channel_bytes());
        for (idx, &value) in cells.iter().enumerate() {
            if !is_in_range(value) {
                let cell = spec.cell_at(idx);
                return Err(EncodeError::Value { cell, value });
            }
            encoding.push_cell(format, value, &mut texels);
        }
        let mut grid = Self {
            spec,
            encoding,
            format,
            record,
            statistics: Statistics {
                mean: 0.0,
                largest: 0.0,
            },
            writer: Self::current_writer(),
            checksum: Some(checksum(&texels)),
            texels,
        };
        grid.statistics = grid.measure();
        Ok(grid)
    }

    /// Returns the writer's name that this version stores in its files.
    pub fn current_writer() -> String {
        format!("aogrid {}", env!("CARGO_PKG_VERSION"))
    }

    /// Returns the grid's box and resolution.
    pub fn spec(&self) -> &GridSpec {
        &self.spec
    }

    /// Returns the meaning of a texel's channels.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Returns the storage format of a channel.
    pub fn format(&self) -> TexelFormat {
        self.format
    }

    /// Returns the record of the bake.
    pub fn record(&self) -> &BakeRecord {
        &self.record
    }

    /// Returns the grid with the error that its shading was measured to have.
    pub fn with_check(self, check: Check) -> Self {
        let record = BakeRecord {
            check: Some(check),
            ..self.record
        };
        Self { record, ..self }
    }

    /// Returns the grid with the names of the model's parts that were left out of its bake.
    pub fn with_parts_left_out(self, without: Vec<String>) -> Self {
        let record = BakeRecord {
            without,
            ..self.record
        };
        Self { record, ..self }
    }

    /// Returns the grid of the same model moved so that its [origin](GridSpec::origin) is zero, for those
    /// who add the origin in double precision.
    pub fn at_zero(self) -> Self {
        let spec = self.spec.with_origin([0.0; 3]).expect("zero is finite");
        Self { spec, ..self }
    }

    /// Returns the mean and the largest occlusion as recorded in the file.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Computes the mean and the largest occlusion from the texels. They differ from
    /// [`Grid::statistics`] only if the texels were changed after the bake.
    pub fn measure(&self) -> Statistics {
        let fractions = (0..self.spec.cell_count()).map(|idx| self.cell(idx)[3]);
        let (mut sum, mut largest) = (0.0_f64, 0.0_f32);
        for a in fractions {
            sum += f64::from(a);
            largest = largest.max(a);
        }
        Statistics {
            mean: sum / self.spec.cell_count() as f64,
            largest,
        }
    }

    /// Whether the texels are those that were baked: they have the recorded BLAKE3 hash or, in files
    /// without one, the recorded statistics.
    pub fn is_unchanged(&self) -> bool {
        match &self.checksum {
            Some(recorded) => *recorded == checksum(&self.texels),
            None => self.statistics == self.measure(),
        }
    }

    /// Returns the program that wrote the file, for example `aogrid 0.1.0`.
    pub fn writer(&self) -> &str {
        &self.writer
    }

    /// Returns the texels as they are uploaded: x fastest, no padding, little-endian.
    pub fn texels(&self) -> &[u8] {
        &self.texels
    }

    /// Returns the number of bytes per texel.
    pub fn texel_bytes(&self) -> usize {
        self.encoding.channels() * self.format.channel_bytes()
    }

    /// Decodes the cell with index `idx` (see [`GridSpec::cell_idx`]): `[x, y, z, a]` as
    /// [`Grid::encode`] takes it, but for quantization; the vector is zero if the encoding [has
    /// none](Encoding::has_direction).
    ///
    /// # Panics
    ///
    /// If `idx` is not below [`GridSpec::cell_count`].
    pub fn cell(&self, idx: usize) -> [f32; 4] {
        let texel = &self.texels[idx * self.texel_bytes()..][..self.texel_bytes()];
        self.encoding.cell(self.format, texel)
    }

    /// Decodes all texels, x fastest, with the [channels](Encoding::channel_names) as stored.
    pub fn decode(&self) -> Vec<f32> {
        let channels = self.encoding.channels();
        let mut decoded = Vec::with_capacity(channels * self.spec.cell_count());
        for texel in self.texels.chunks_exact(self.texel_bytes()) {
            let values = self.encoding.values(self.format, texel);
            decoded.extend_from_slice(&values[..channels]);
        }
        decoded
    }
}

/// Returns the BLAKE3 hash of texels, in hexadecimal.
fn checksum(texels: &[u8]) -> String {
    blake3::hash(texels).to_hex().to_string()
}

/// Whether all values are in range: each component of the vector in −1..=1, a in 0..=1.
fn is_in_range([x, y, z, a]: [f32; 4]) -> bool {
    // Comparisons with NaN are false.
    [x, y, z].iter().all(|d| d.abs() <= 1.0) && (0.0..=1.0).contains(&a)
}
