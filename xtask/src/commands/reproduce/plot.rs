//! Plots as SVG, in the colors of the page.

use std::fmt::Write;

/// A plot of points, each series joined by lines.
pub(super) struct Plot {
    pub(super) title: String,
    pub(super) x_label: &'static str,
    pub(super) y_label: &'static str,
    /// Whether the axes are logarithmic.
    pub(super) log: [bool; 2],
    pub(super) series: Vec<Series>,
}

/// A named series of points.
pub(super) struct Series {
    pub(super) name: String,
    pub(super) points: Vec<[f64; 2]>,
}

const SIZE: [f64; 2] = [700.0, 400.0];
/// The left, right, top and bottom margins of the plot's frame.
const MARGINS: [f64; 4] = [64.0, 210.0, 16.0, 48.0];

/// The maximum number of ticks of an axis.
const MAX_TICKS: usize = 8;

/// Colors that are told apart in light and dark, also by color-blind people (Okabe and Ito).
const COLORS: [&str; 7] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#8a8a3c",
];

/// An axis from values to pixels.
struct Axis {
    range: [f64; 2],
    pixels: [f64; 2],
    is_log: bool,
}

impl Axis {
    /// Returns the axis that shows all values with some room at its ends.
    fn new(values: impl Iterator<Item = f64>, pixels: [f64; 2], is_log: bool) -> Self {
        let values = values.map(|v| if is_log { v.log10() } else { v });
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        let (low, high) = match (low.is_finite(), is_log) {
            (false, _) => (0.0, 1.0),
            (true, true) => (low, high),
            // Lengths are compared by eye, so a linear axis begins at zero.
            (true, false) => (low.min(0.0), high),
        };
        let room = 0.06 * (high - low).max(1e-9);
        let below = if low == 0.0 && !is_log { 0.0 } else { room };
        Self {
            range: [low - below, high + room],
            pixels,
            is_log,
        }
    }

    fn pixel(&self, value: f64) -> f64 {
        let v = if self.is_log { value.log10() } else { value };
        let t = (v - self.range[0]) / (self.range[1] - self.range[0]);
        self.pixels[0] + t * (self.pixels[1] - self.pixels[0])
    }

    /// Returns round values in the axis' range.
    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        if self.is_log {
            let mantissas: &[f64] = if high - low < 2.0 {
                &[1.0, 2.0, 5.0]
            } else {
                &[1.0]
            };
            let decades = low.floor() as i32..=high.ceil() as i32;
            let all = decades.flat_map(|d| mantissas.iter().map(move |m| m * 10f64.powi(d)));
            let range = low..=high;
            return all.filter(|v| range.contains(&v.log10())).collect();
        }
        let rough = (high - low) / MAX_TICKS as f64;
        let decade = 10f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade);
        let step = steps
            .into_iter()
            .find(|step| *step >= rough)
            .unwrap_or(rough);
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

impl Plot {
    /// Returns the plot as an SVG element.
    pub(super) fn svg(&self) -> String {
        let [left, right, top, bottom] = MARGINS;
        let points = || self.series.iter().flat_map(|series| &series.points);
        let [width, height] = SIZE;
        let x = Axis::new(points().map(|p| p[0]), [left, width - right], self.log[0]);
        let y = Axis::new(points().map(|p| p[1]), [height - bottom, top], self.log[1]);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            self.title
        );
        for tick in x.ticks() {
            let at = x.pixel(tick);
            let (y0, y1) = (y.pixels[0], y.pixels[1]);
            _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{y0}\" y2=\"{y1}\"/>\
                 <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                y0 + 18.0,
                short(tick)
            );
        }
        for tick in y.ticks() {
            let at = y.pixel(tick);
            let (x0, x1) = (x.pixels[0], x.pixels[1]);
            _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{x0}\" x2=\"{x1}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                x0 - 6.0,
                at + 4.0,
                short(tick)
            );
        }
        _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (x.pixels[0] + x.pixels[1]),
            height - 10.0,
            self.x_label,
            0.5 * (y.pixels[0] + y.pixels[1]),
            self.y_label
        );
        for (idx, series) in self.series.iter().enumerate() {
            self.draw(&mut svg, idx, series, [&x, &y]);
        }
        svg + "</svg>"
    }

    /// Draws a series, and its name in the legend.
    fn draw(&self, svg: &mut String, idx: usize, series: &Series, [x, y]: [&Axis; 2]) {
        let color = COLORS[idx % COLORS.len()];
        let pixels: Vec<_> = series
            .points
            .iter()
            .map(|p| [x.pixel(p[0]), y.pixel(p[1])])
            .collect();
        let path: String = pixels
            .iter()
            .map(|[x, y]| format!("{x:.1},{y:.1} "))
            .collect();
        _ = write!(
            svg,
            "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" points=\"{path}\"/>"
        );
        for [x, y] in pixels {
            _ = write!(
                svg,
                "<circle fill=\"{color}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>"
            );
        }
        let (left, top) = (
            SIZE[0] - MARGINS[1] + 14.0,
            MARGINS[2] + 12.0 + 20.0 * idx as f64,
        );
        _ = write!(
            svg,
            "<circle fill=\"{color}\" cx=\"{left}\" cy=\"{top}\" r=\"5\"/><text x=\"{:.1}\" \
             y=\"{:.1}\">{}</text>",
            left + 10.0,
            top + 4.0,
            series.name
        );
    }
}

/// Returns a number with few digits: 0.02, 5, 20k, 1M.
fn short(value: f64) -> String {
    let rounded = |v: f64| {
        let text = format!("{v:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    match value.abs() {
        v if v >= 1e6 => format!("{}M", rounded(value / 1e6)),
        v if v >= 1e4 => format!("{}k", rounded(value / 1e3)),
        _ => rounded(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        let linear = Axis::new([0.0, 0.83].into_iter(), [0.0, 100.0], false);
        assert_eq!(linear.ticks().first(), Some(&0.0));
        assert!(linear.ticks().len() <= MAX_TICKS + 1);
        let log = Axis::new([300.0, 2e6].into_iter(), [0.0, 100.0], true);
        assert_eq!(log.ticks(), [1e3, 1e4, 1e5, 1e6]);
        assert!(log.pixel(300.0) > 0.0 && log.pixel(2e6) < 100.0);
        assert_eq!([0.02, 5.0, 2e4, 1e6].map(short), ["0.02", "5", "20k", "1M"]);
    }
}
