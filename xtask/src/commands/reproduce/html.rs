//! The report: one HTML file that loads nothing.

use std::fmt::Write;
use std::path::Path;

use anyhow::Context;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::figures::Figure;
use super::finding::{Finding, Table};
use super::misprints::Misprint;

const STYLE: &str = include_str!("report.css");

/// A figure with its finding.
pub(super) struct Judged {
    pub(super) figure: Figure,
    pub(super) finding: Finding,
}

/// Returns the report. The pictures in `folder` become part of it.
pub(super) fn report(
    folder: &Path,
    machine: &str,
    judged: &[Judged],
    misprints: &[Misprint],
) -> anyhow::Result<String> {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>aogrid: the papers, reproduced</title><style>{STYLE}</style></head><body><main>\
         <h1>The papers, reproduced</h1>\
         <p>Figures and tables of Malmer et al., <cite>Fast Precomputed Ambient Occlusion for Proximity \
         Shadows</cite> (INRIA RR-5779, 2005; <cite>journal of graphics tools</cite>, 2007: JGT), of GPU Gems, \
         chapter 17, and of McGuire's <cite>Ambient Occlusion Volumes</cite> (AOV), each with the commands that \
         make it, the papers' claim in our words, and what is seen here. Made by aogrid {} with \
         <code>cargo xtask reproduce</code>. {}</p>",
        env!("CARGO_PKG_VERSION"),
        escape(machine)
    );
    html += "<div class=\"wide\"><table><thead><tr><th>figure</th><th>subject</th><th>claim</th></tr></thead><tbody>";
    for Judged { figure, finding } in judged {
        _ = write!(
            html,
            "<tr><td><a href=\"#{}\">{}</a></td><td>{}</td><td class=\"{}\">{}</td></tr>",
            figure.id,
            escape(figure.source),
            escape(figure.title),
            finding.verdict.class(),
            finding.verdict.word()
        );
    }
    html += "</tbody></table></div>";
    for judged in judged {
        section(&mut html, folder, judged)?;
    }
    html += "<section id=\"misprints\"><h2>What we found in the papers</h2>";
    for misprint in misprints {
        _ = write!(
            html,
            "<h3>{}</h3><dl><dt>printed</dt><dd>{}</dd><dt>right</dt><dd>{}</dd><dt>shown by</dt><dd>{}</dd></dl>",
            escape(misprint.place),
            escape(misprint.printed),
            escape(misprint.ours),
            escape(&misprint.number)
        );
    }
    html += "</section></main></body></html>\n";
    Ok(html)
}

/// Adds the section of a figure.
fn section(html: &mut String, folder: &Path, judged: &Judged) -> anyhow::Result<()> {
    let Judged { figure, finding } = judged;
    _ = write!(
        html,
        "<section id=\"{}\"><h2>{}</h2><p class=\"source\">{}</p><p><b>Claim.</b> {}</p>\
         <p><b class=\"{}\">It {}.</b> {}</p>",
        figure.id,
        escape(figure.title),
        escape(figure.source),
        escape(figure.claim),
        finding.verdict.class(),
        finding.verdict.word(),
        escape(&finding.text)
    );
    for table in &finding.tables {
        add_table(html, table);
    }
    for plot in &finding.plots {
        _ = write!(
            html,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            plot.svg(),
            escape(&plot.title)
        );
    }
    for step in &figure.steps {
        if let Some(picture) = step.picture(figure.id) {
            let path = folder.join(&picture);
            let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
            _ = write!(
                html,
                "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
                escape(&picture),
                STANDARD.encode(bytes)
            );
        }
    }
    html.push_str("<details><summary>Commands</summary><pre>");
    for step in &figure.steps {
        _ = writeln!(html, "cargo xtask {}", escape(&step.command(figure.id)));
    }
    html.push_str("</pre></details></section>");
    Ok(())
}

fn add_table(html: &mut String, table: &Table) {
    html.push_str("<div class=\"wide\"><table><thead><tr>");
    for text in &table.header {
        _ = write!(html, "<th>{}</th>", escape(text));
    }
    html.push_str("</tr></thead><tbody>");
    for row in &table.rows {
        html.push_str("<tr>");
        for text in row {
            _ = write!(html, "<td>{}</td>", escape(text));
        }
        html.push_str("</tr>");
    }
    html.push_str("</tbody></table></div>");
}

/// Returns a text as HTML.
fn escape(text: &str) -> String {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;");
    escaped.replace('>', "&gt;").replace('"', "&quot;")
}
