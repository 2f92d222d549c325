//! Panels side by side: truth and the modes as 1 − AO, and below each mode its signed difference.

use aogrid_scene::GBuffer;

use super::Compared;
use crate::pictures::canvas::{Canvas, INK};
use crate::pictures::panels::{GAP, LINE, NO_SURFACE, Panel, SCALE_HEIGHT, gray, signed};

/// Returns the panels as PNG.
pub(super) fn png(
    compared: &Compared<'_>,
    (gbuffer, pixels): &(GBuffer, Vec<usize>),
) -> anyhow::Result<Vec<u8>> {
    let [width, height] = gbuffer.size;
    let columns = compared.modes.len() as u32 + 1;
    let (top, bottom) = (LINE, 2 * LINE + height);
    let mut canvas = Canvas::new(
        columns * (width + GAP) - GAP,
        bottom + height + LINE + SCALE_HEIGHT,
    );
    let mut panel = Panel {
        canvas: &mut canvas,
        width,
        pixels,
    };
    panel.clear([0, top], NO_SURFACE, height);
    panel.fill([0, top], &compared.truth.occlusion, gray);
    panel.canvas.text(0, 2, "truth", INK);
    let pairs = compared.modes.iter().zip(compared.errors);
    for (column, ((mode, shaded), errors)) in (1..).zip(pairs) {
        let x = column * (width + GAP);
        let truth = &compared.truth.occlusion;
        let differences = shaded.occlusion.iter().zip(truth).map(|(a, b)| a - b);
        panel.clear([x, top], NO_SURFACE, height);
        panel.fill([x, top], &shaded.occlusion, gray);
        panel.clear([x, bottom], NO_SURFACE, height);
        panel.fill([x, bottom], &differences.collect::<Vec<_>>(), signed);
        panel.canvas.text(x, 2, mode.name, INK);
        if let Some(all) = &errors.all {
            let text = format!("less truth: RMSE {:.4}, bias {:+.4}", all.rmse, all.bias);
            panel.canvas.text(x, bottom - LINE + 2, &text, INK);
        }
        panel.scale([x, bottom + height + 2]);
    }
    crate::pictures::png(&canvas.into_image())
}
