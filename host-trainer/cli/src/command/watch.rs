//! `train --watch`: a page about a run while it goes on, for this machine alone.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use pocketsplat_capture::dataset::Image;
use pocketsplat_trainer::train::run::newest_preview;
use pocketsplat_viewer::escaped;
use tiny_http::{Header, Method, Request, Response, Server};

use super::report::STYLE;
use crate::plot::{Recording, learning_curve_svg, thousands};

const PAGE: &str = include_str!("watch/watch.html");

/// What the page shows.
struct Watched {
    folder: PathBuf,
    iterations: u32,
    /// The photograph that the previews are of, as a JPEG.
    photograph: Option<Vec<u8>>,
}

type Answer = Response<Cursor<Vec<u8>>>;

/// A port of the loopback interface that is this program's.
pub(super) struct Port {
    server: Server,
    number: u16,
}

impl Port {
    /// * `number`: 0 takes a free one.
    pub(super) fn open(number: u16) -> Result<Self> {
        let server = Server::http(("127.0.0.1", number)).map_err(|error| {
            anyhow!("could not serve the page on port {number}: {error}; choose another, as --watch 8000")
        })?;
        let Some(number) = server.server_addr().to_ip().map(|address| address.port()) else {
            return Err(anyhow!("the page has no address; leave --watch out"));
        };
        Ok(Self { server, number })
    }

    /// Serves a page about the run in `folder` until the program ends; says where.
    pub(super) fn serve(self, folder: &Path, iterations: u32, photograph: Option<&Image>) -> Result<()> {
        let Self { server, number } = self;
        eprintln!("watch it at http://127.0.0.1:{number}/");
        let photograph = photograph.map(Image::to_jpeg).transpose()?;
        let watched = Watched { folder: folder.to_owned(), iterations, photograph };
        std::thread::spawn(move || {
            for request in server.incoming_requests() {
                let answer = answer(&watched, &request, number);
                // Whoever asked may have gone.
                let _ = request.respond(answer);
            }
        });
        Ok(())
    }
}

fn answer(watched: &Watched, request: &Request, port: u16) -> Answer {
    let host = request.headers().iter().find(|header| header.field.equiv("Host")).map(|header| header.value.as_str());
    // Another site's page whose name was made to mean this machine.
    if !host.is_some_and(|host| [format!("127.0.0.1:{port}"), format!("localhost:{port}")].contains(&host.to_owned())) {
        return refusal(403);
    }
    if *request.method() != Method::Get {
        return refusal(405);
    }
    let path = request.url().split('?').next().unwrap_or_default();
    let found = match path {
        "/" => Some(("text/html; charset=utf-8", page(watched).into_bytes())),
        "/state" => Some(("text/html; charset=utf-8", state(watched).into_bytes())),
        "/preview.jpg" => {
            newest(watched).and_then(|(_, path)| std::fs::read(path).ok()).map(|bytes| ("image/jpeg", bytes))
        }
        "/photograph.jpg" => watched.photograph.clone().map(|bytes| ("image/jpeg", bytes)),
        _ => None,
    };
    let Some((kind, bytes)) = found else { return refusal(404) };
    let header = |name: &str, value: &str| Header::from_bytes(name, value);
    let headers = [
        header("Content-Type", kind),
        header("Cache-Control", "no-store"),
        header("X-Content-Type-Options", "nosniff"),
    ];
    headers.into_iter().flatten().fold(Response::from_data(bytes), Response::with_header)
}

fn refusal(status: u16) -> Answer {
    Response::from_data(Vec::new()).with_status_code(status)
}

fn newest(watched: &Watched) -> Option<(u32, PathBuf)> {
    newest_preview(&watched.folder)
}

fn page(watched: &Watched) -> String {
    let name = watched.folder.file_stem().unwrap_or_default().to_string_lossy();
    let folder = std::path::absolute(&watched.folder).unwrap_or_else(|_| watched.folder.clone());
    PAGE.replace("{{STYLE}}", STYLE.trim_end())
        .replace("{{FOLDER}}", &escaped(&folder.to_string_lossy()))
        .replace("{{TITLE}}", &escaped(&name))
        .replace("{{STATE}}", &state(watched))
}

/// How far the run is: what the page asks for again and again.
fn state(watched: &Watched) -> String {
    let rows = match Recording::read(&watched.folder.join("progress.csv")) {
        Ok(Recording::Learning(rows)) => rows,
        _ => Vec::new(),
    };
    let Some(row) = rows.last() else {
        return "<p>The first iterations are on their way.</p>".to_owned();
    };
    let (done, all) = (row.iteration, watched.iterations);
    let mut text = format!(
        "<div class=\"facts\"><div><b>{} of {}</b><span>iterations</span>\
         <progress max=\"{all}\" value=\"{done}\" aria-label=\"iterations\"></progress></div>\n",
        thousands(done.into()),
        thousands(all.into())
    );
    if let Some(psnr_db) = row.psnr_db {
        text += &format!("<div><b>{psnr_db:.2} dB</b><span>PSNR, training views</span></div>\n");
    }
    text += &format!("<div><b>{}</b><span>anchors</span></div></div>\n", thousands(row.anchors as f64));
    if let Some((iteration, _)) = newest(watched) {
        let photograph = match &watched.photograph {
            Some(_) => {
                "<figure><img src=\"/photograph.jpg\" alt=\"the photograph\"><figcaption>photograph</figcaption></figure>"
            }
            None => "",
        };
        text += &format!(
            "<section aria-labelledby=\"newest\"><h2 id=\"newest\">Photograph and picture</h2>\n<div class=\"pair\">{photograph}<figure>\
             <img src=\"/preview.jpg?{iteration}\" alt=\"the picture\"><figcaption>after {} iterations</figcaption></figure></div></section>\n",
            thousands(iteration.into())
        );
    }
    let curves = learning_curve_svg(rows, all).map_or_else(
        |error| format!("<p>{}</p>", escaped(&error.to_string())),
        |svg| {
            format!(
                "<div class=\"figure\" role=\"img\" aria-label=\"Curves over the iterations: PSNR of the training views, number of \
                 anchors, rate\">{svg}</div>"
            )
        },
    );
    text + &format!("<section aria-labelledby=\"curves\"><h2 id=\"curves\">How training goes</h2>\n{curves}</section>")
}
