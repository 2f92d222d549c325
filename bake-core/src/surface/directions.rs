//! The directions of a surface bake.

/// The choice of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directions {
    /// The same for all points: [`shared_directions`] and their opposites.
    Shared,
    /// Random ones in equal strata of each point's hemisphere, from the seed and the point's index.
    Stratified,
    /// Uniformly random ones for each point by rejection, as in listing 17-2 of the chapter.
    Rejection,
}

impl Directions {
    /// All choices.
    pub const ALL: [Self; 3] = [Self::Shared, Self::Stratified, Self::Rejection];

    /// Returns the name that commands and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shared => "shared",
            Self::Stratified => "stratified",
            Self::Rejection => "rejection",
        }
    }
}

/// The cosine and sine of the golden angle, π(3 − √5).
const GOLDEN: [f64; 2] = [-0.737_368_878_078_319_7, 0.675_490_294_261_523_8];

/// The cosine and sine of the first direction's angle. It keeps the first direction out of the planes
/// that contain two axes, in which the faces of many models lie.
const FIRST: [f64; 2] = [0.8, 0.6];

/// Returns `n` unit directions of the hemisphere z > 0, in equal steps of z and of the golden angle.
/// With their opposites they cover the sphere: any hemisphere has `n` of them, but for those in its
/// own plane.
///
/// They come from additions, multiplications and square roots alone, whose results are the same on
/// every machine.
pub fn shared_directions(n: u32) -> Vec<[f64; 3]> {
    let mut angle = FIRST;
    let direction = |i: u32| {
        let z = 1.0 - (f64::from(i) + 0.5) / f64::from(n);
        let radius = (1.0 - z * z).sqrt();
        let [cos, sin] = angle;
        angle = [
            cos * GOLDEN[0] - sin * GOLDEN[1],
            sin * GOLDEN[0] + cos * GOLDEN[1],
        ];
        [radius * cos, radius * sin, z]
    };
    (0..n).map(direction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_length_one_and_spread_evenly() {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        // Machines differ in the last bits of sines.
        assert!((GOLDEN[0] - golden.cos()).abs() < 1e-15);
        assert!((GOLDEN[1] - golden.sin()).abs() < 1e-15);
        let directions = shared_directions(4096);
        let mut mean = [0.0; 3];
        for d in &directions {
            // The recurrence rounds once a step: 4096 half-ulps.
            assert!((crate::surface::dot(*d, *d) - 1.0).abs() < 1e-12);
            assert!(d[2] > 0.0 && d[0] != 0.0 && d[1] != 0.0);
            (0..3).for_each(|x| mean[x] += d[x] / 4096.0);
        }
        // The mean of a hemisphere is half its axis. Along z the steps are exact; across it the error
        // of a spiral is below one step, 1/4096.
        assert!((mean[2] - 0.5).abs() < 1e-9, "{mean:?}");
        assert!(mean[0].hypot(mean[1]) < 1.0 / 4096.0, "{mean:?}");
    }
}
