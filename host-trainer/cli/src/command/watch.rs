//! `train --watch`: a page about a run while it goes on, for this machine alone.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use pocketsplat_capture::dataset::Image;
use pocketsplat_files::shell_word;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::run::newest_preview;
use pocketsplat_viewer::escaped;
use tiny_http::{Header, Method, Request, Response, Server};

use super::estimate::{bundle_bytes, duration};
use super::progress::two_digits;
use super::report::STYLE;
use super::report::amounts::size;
use crate::plot::{LearningRow, Recording, learning_curve_svg, thousands};
use crate::say::say;

const PAGE: &str = include_str!("watch/watch.html");

/// Somebody who has asked within this time still looks at the page, which asks every three seconds.
const LOOKED_AT: Duration = Duration::from_secs(8);
/// A page that does not ask within this time any more is not waited for.
const LAST_ANSWER: Duration = Duration::from_secs(5);
/// Rows of progress.csv whose time says how fast the run is.
const RATE_ROWS: usize = 20;

/// What the page shows.
struct Watched {
    folder: PathBuf,
    config: TrainConfig,
    /// The photograph that the previews are of, as a JPEG.
    photograph: Option<Vec<u8>>,
    last: Mutex<Last>,
}

/// How a run ended, as its page says it last.
#[derive(Clone, Debug)]
pub(super) enum Ending {
    /// All iterations are done.
    Finished {
        /// The page about the run, where there is one.
        report: Option<PathBuf>,
    },
    /// It was interrupted or failed: why.
    Stopped(String),
}

/// What a page was told last.
#[derive(Default)]
struct Last {
    ending: Option<Ending>,
    asked: Option<Instant>,
    is_told: bool,
}

impl Watched {
    fn last(&self) -> MutexGuard<'_, Last> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A page that is being served.
pub(super) struct Served(Arc<Watched>);

impl Served {
    /// Tells those who look at the page how the run ended, once, before the program ends and nobody answers any more.
    pub(super) fn end(self, ending: Ending) {
        let started = Instant::now();
        let is_looked_at = {
            let mut last = self.0.last();
            last.ending = Some(ending);
            last.asked.is_some_and(|asked| asked.elapsed() < LOOKED_AT)
        };
        while is_looked_at && !self.0.last().is_told && started.elapsed() < LAST_ANSWER {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
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
            anyhow!("could not serve the page on port {number}: {error}; choose another, as --watch=8000")
        })?;
        let Some(number) = server.server_addr().to_ip().map(|address| address.port()) else {
            return Err(anyhow!("the page has no address; leave --watch out"));
        };
        Ok(Self { server, number })
    }

    /// Serves a page about the run in `folder` until the program ends; says where.
    pub(super) fn serve(self, folder: &Path, config: &TrainConfig, photograph: Option<&Image>) -> Result<Served> {
        let Self { server, number } = self;
        say!("watch it at http://127.0.0.1:{number}/");
        let photograph = photograph.map(Image::to_jpeg).transpose()?;
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let watched = Arc::new(Watched { folder, config: *config, photograph, last: Mutex::default() });
        let served = Served(Arc::clone(&watched));
        std::thread::spawn(move || {
            for request in server.incoming_requests() {
                let is_ended = watched.last().ending.is_some();
                let answer = answer(&watched, &request, number);
                let asks_for_state = ["/", "/state"].contains(&request.url()) && answer.status_code().0 == 200;
                // Whoever asked may have gone.
                let _ = request.respond(answer);
                if asks_for_state {
                    let mut last = watched.last();
                    (last.asked, last.is_told) = (Some(Instant::now()), is_ended);
                }
            }
        });
        Ok(served)
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
    ended(watched) + &progress(watched)
}

/// How the run ended, once it has.
fn ended(watched: &Watched) -> String {
    let (name, said) = match &watched.last().ending {
        None => return String::new(),
        Some(Ending::Finished { report: Some(path) }) => {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            ("finished", format!("its report is <code>{}</code>", escaped(&path.display().to_string())))
        }
        Some(Ending::Finished { report: None }) => ("finished", "it has no report".to_owned()),
        Some(Ending::Stopped(why)) => {
            let word = escaped(&shell_word(&watched.folder));
            let resume = format!("to go on, <code>pocketsplat train --resume {word}</code>");
            ("stopped", format!("{}; {resume}", escaped(why)))
        }
    };
    format!("<p role=\"status\" data-state=\"{name}\"><strong>state: {name}</strong> · {said}</p>\n")
}

/// Iterations a second of the last rows of a run, in the time that it trained.
fn rate(rows: &[LearningRow]) -> Option<f64> {
    let last = rows.last()?;
    let first = rows.get(rows.len().saturating_sub(RATE_ROWS)).filter(|first| first.iteration < last.iteration);
    let (from, since_s) = first.map_or((0, Some(0.0)), |first| (first.iteration, first.seconds));
    let rate = f64::from(last.iteration - from) / (last.seconds? - since_s?);
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

fn progress(watched: &Watched) -> String {
    let rows = match Recording::read(&watched.folder.join("progress.csv")) {
        Ok(Recording::Learning(rows)) => rows,
        _ => Vec::new(),
    };
    let Some(row) = rows.last() else {
        return "<p>The first iterations are on their way.</p>".to_owned();
    };
    let (done, all) = (row.iteration, watched.config.iterations);
    let mut text = format!(
        "<div class=\"facts\"><div><b>{} of {}</b><span>iterations</span>\
         <progress max=\"{all}\" value=\"{done}\" aria-label=\"iterations\"></progress></div>\n",
        thousands(done.into()),
        thousands(all.into())
    );
    if let Some(psnr_db) = row.psnr_db {
        text += &format!("<div><b>{psnr_db:.2} dB</b><span>PSNR, training views</span></div>\n");
    }
    text += &format!("<div><b>{}</b><span>anchors</span></div>\n", thousands(row.anchors as f64));
    let bytes = bundle_bytes(&watched.config, row.anchors, row.bits());
    text += &format!("<div><b>about {}</b><span>bundle</span></div>\n", size(bytes));
    if let Some(rate) = rate(&rows).filter(|_| done < all && watched.last().ending.is_none()) {
        let minutes = f64::from(all - done) / rate / 60.0;
        text += &format!(
            "<div><b>{} it/s</b><span>iterations a second</span></div>\n<div><b>{}</b><span>left</span></div>\n",
            two_digits(rate),
            duration(minutes)
        );
    }
    text += "</div>\n";
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

#[cfg(test)]
mod tests {
    use super::*;

    fn watched(folder: &Path) -> Watched {
        let config = TrainConfig { iterations: 400, ..TrainConfig::default() };
        Watched { folder: folder.to_owned(), config, photograph: None, last: Mutex::default() }
    }

    #[test]
    fn the_page_says_what_the_terminal_does_until_it_says_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let rows: String = (1..=30).map(|i| format!("{},20.5,1000,{:.1},300,20,10\n", 10 * i, f64::from(i))).collect();
        let heads = "iteration,psnr_db,anchors,seconds,feature_bits,log_scale_bits,offset_bits\n";
        std::fs::write(folder.path().join("progress.csv"), heads.to_owned() + &rows).unwrap();
        let watched = watched(folder.path());
        let said = state(&watched);
        // 40 kB and 1,000 anchors of 330 bits; ten iterations a second, 100 of them left.
        assert!(
            said.contains("<b>about 79 KiB</b>") && said.contains("10.0 it/s") && said.contains("<b>10 seconds</b>"),
            "{said}"
        );
        assert!(!said.contains("data-state"), "{said}");
        watched.last().ending = Some(Ending::Finished { report: Some("/a <b>/report.html".into()) });
        let said = state(&watched);
        assert!(said.contains("state: finished") && said.contains("/a &lt;b&gt;/report.html"), "{said}");
        assert!(!said.contains("<span>left"), "{said}");
        watched.last().ending = Some(Ending::Stopped("it was interrupted".to_owned()));
        assert!(state(&watched).contains("pocketsplat train --resume"), "how to go on");
    }

    #[test]
    fn nobody_is_waited_for_who_does_not_look() {
        let served = Served(Arc::new(watched(Path::new("none"))));
        let started = Instant::now();
        served.end(Ending::Finished { report: None });
        assert!(started.elapsed() < LAST_ANSWER / 2);
    }
}
