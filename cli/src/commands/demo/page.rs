//! The page of the demo: pictures beside each other, their errors, their commands.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::drawn::{DemoPicture, Way};

const STYLE: &str = include_str!("page.css");

/// The page.
pub(super) fn html(scenes: &[DemoPicture]) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "resample: demo" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "resample: demo" }
                p { "Five scenes made of formulas. Each is drawn as the command line draws it, and the quick way that most programs \
                     go. The error is the peak signal-to-noise ratio in decibels: ten more is a third of the error." }
                @for scene in scenes { (section(scene)) }
            }
        }
    };
    page.into_string()
}

fn section(scene: &DemoPicture) -> Markup {
    html! {
        section {
            h2 { (scene.title) }
            p { (scene.about) }
            div class="ways" { @for way in &scene.ways { (figure(way)) } }
            p class="note" { "Against " (scene.against) "." }
        }
    }
}

fn figure(way: &Way) -> Markup {
    let error = if way.psnr_db.is_finite() {
        format!("{:.1} dB", way.psnr_db)
    } else {
        "the same".to_owned()
    };
    html! {
        figure {
            a href=(way.file) { img src=(way.file) alt=(way.title); }
            figcaption { b { (way.title) } ": " (error) }
            details { summary { "command" } pre { (way.command) } }
        }
    }
}
