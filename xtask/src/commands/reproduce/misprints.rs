//! Misprints and gaps of the papers, each with the number that shows it.

use aogrid_tables::clip;

/// A misprint.
pub(super) struct Misprint {
    /// The paper and the place in it.
    pub(super) place: &'static str,
    pub(super) printed: &'static str,
    pub(super) ours: &'static str,
    /// The numbers that show the difference.
    pub(super) number: String,
}

/// Returns the misprints that matter to a reader who implements the papers.
pub(super) fn all() -> Vec<Misprint> {
    vec![
        lerp_order(),
        self_shading(),
        Misprint {
            place: "JGT supplement, the code of the intersection",
            printed: "A cap inside another returns its half-angle.",
            ours: "It returns the cap's fraction, (1 − cos α)/2.",
            number: format!(
                "For a cap of 60°: {:.3} printed, {:.3} right.",
                60f64.to_radians(),
                0.5 * (1.0 - 60f64.to_radians().cos())
            ),
        },
        texel_weights(),
        Misprint {
            place: "RR-5779, environment lighting, line 6",
            printed: "The light that is left is B − A.",
            ours: "It is B − AO · A: A is the mean radiance of the cone, and the cone fills only a share of the \
                   hemisphere.",
            number: "Under a constant sky of radiance 1 and AO 0.3: 0 printed, 0.7 right."
                .to_owned(),
        },
        Misprint {
            place: "GPU Gems 17, the look-up of the latitude-longitude map",
            printed: "The polar angle is divided by π/2.",
            ours: "It is divided by π.",
            number: format!(
                "At the south pole v is {:.0} printed, outside the map, and 1 right.",
                std::f64::consts::PI * 2.0 / std::f64::consts::PI
            ),
        },
        uniform_weights(),
    ]
}

/// An unclipped cone must keep its axis.
fn lerp_order() -> Misprint {
    let (a, beta) = (0.05, 40f64.to_radians());
    let f = clip::closed_form(a, beta.cos()).axis_weight;
    // The axis lies at β from the normal, in one plane with it.
    let angle = |of_axis: f64| {
        let (x, z) = (of_axis * beta.sin(), of_axis * beta.cos() + 1.0 - of_axis);
        (x.atan2(z) - beta).abs().to_degrees()
    };
    Misprint {
        place: "RR-5779 and JGT, the listings that clip a cone",
        printed: "lerp(d, n, f), while the text weighs d by f",
        ours: "lerp(n, d, f): f is the weight of the axis d.",
        number: format!(
            "A cone of fraction {a} at 40° from the normal is not clipped at all: its axis turns by {:.1}° \
             printed, by {:.1}° right.",
            angle(1.0 - f),
            angle(f)
        ),
    }
}

/// The shading of an object by its own grid, with occlusion alone.
fn self_shading() -> Misprint {
    let a = 0.75;
    let ao = 2.0 * a;
    Misprint {
        place: "RR-5779, section 4, self-occlusion",
        printed: "(AO − 1)/2, with AO = 2a",
        ours: "2a − 1: half of all directions lie below the surface, and the rest is what counts.",
        number: format!(
            "A point in a concave corner, a = {a}: {:.3} printed, {:.3} right.",
            0.5 * (ao - 1.0),
            2.0 * a - 1.0
        ),
    }
}

/// The number of texels along a face's side.
const SIDE: i32 = 16;

/// The average direction of a cap's texels, with and without weights.
fn texel_weights() -> Misprint {
    let errors = [true, false].map(|weighted| {
        let degrees = (0..200).map(|i| axis_error(fibonacci(i, 200), weighted));
        degrees.sum::<f64>() / 200.0
    });
    Misprint {
        place: "RR-5779, section 6.1; JGT, section 3",
        printed: "The directions of the occluded texels are averaged.",
        ours: "They are weighted by the solid angles of the texels, which differ fivefold.",
        number: format!(
            "The axis of a cap of 40°, over 200 directions and 16×16 texels a face: {:.2}° off without \
             weights, {:.2}° with them.",
            errors[1], errors[0]
        ),
    }
}

/// Returns the direction with this index among `n` that cover the sphere evenly.
fn fibonacci(i: i32, n: i32) -> [f64; 3] {
    let z = 1.0 - f64::from(2 * i + 1) / f64::from(n);
    let turn = std::f64::consts::PI * (1.0 + 5f64.sqrt()) * f64::from(i);
    let r = (1.0 - z * z).sqrt();
    [r * turn.cos(), r * turn.sin(), z]
}

/// Returns the angle in degrees between a cap's axis and the mean of its texels' directions.
fn axis_error(axis: [f64; 3], weighted: bool) -> f64 {
    let min_cos = 40f64.to_radians().cos();
    let mut sum = [0.0; 3];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for face in 0..6 {
        for (j, i) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (j, i))) {
            let at = |i: i32| f64::from(2 * i + 1 - SIDE) / f64::from(SIDE);
            let mut direction = [0.0; 3];
            direction[face / 2] = if face % 2 == 0 { 1.0 } else { -1.0 };
            direction[(face / 2 + 1) % 3] = at(i);
            direction[(face / 2 + 2) % 3] = at(j);
            let length = dot(direction, direction).sqrt();
            let unit = direction.map(|x| x / length);
            if dot(unit, axis) >= min_cos {
                let weight = if weighted { length.powi(-3) } else { 1.0 };
                (0..3).for_each(|x| sum[x] += weight * unit[x]);
            }
        }
    }
    let cos = dot(sum, axis) / dot(sum, sum).sqrt();
    cos.min(1.0).acos().to_degrees()
}

/// Accessibility by uniform rays, in the middle of the floor of a pit two wide and one deep.
fn uniform_weights() -> Misprint {
    // The square opening of side 2 at height 1 is a face of the cube around the point: a third of the
    // hemisphere's solid angle.
    let uniform = 1.0 / 3.0;
    // Four times the form factor of a unit square above the corner of which the point lies.
    let leg = 1.0 / 2f64.sqrt();
    let cosine = 4.0 * (leg * leg.atan() + leg * leg.atan()) / (2.0 * std::f64::consts::PI);
    Misprint {
        place: "GPU Gems 17, listing 17-1",
        printed: "Rays are uniform over the hemisphere; their open share is the accessibility.",
        ours: "A share weighted by the cosine: only that is right under a constant sky.",
        number: format!(
            "In the middle of a pit two wide and one deep the light is {cosine:.3} of the sky's; the printed \
             share is {uniform:.3}."
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_show_the_misprints() {
        // An unclipped cone keeps its axis with our order.
        let text = lerp_order().number;
        assert!(text.contains("by 0.0° right"), "{text}");
        // The square above the middle of the pit: .5541264 (design, closed form of the opening).
        let text = uniform_weights().number;
        assert!(text.contains("0.554"), "{text}");
        let text = texel_weights().number;
        assert!(text.contains("with them"), "{text}");
        assert!(axis_error([0.0, 0.0, 1.0], true) < 1e-6);
        let mean = |weighted| {
            (0..50)
                .map(|i| axis_error(fibonacci(i, 50), weighted))
                .sum::<f64>()
        };
        assert!(mean(false) > 2.0 * mean(true));
    }
}
