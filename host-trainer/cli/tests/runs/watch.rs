//! `train --watch`: a page about a run, for this machine alone.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::Stdio;

use crate::chromium;
use crate::fixture::{capture, folder, pocketsplat, train};

const SCRIPT: &str = include_str!("watch.js");
/// What a page gets instead of answers: after these nobody answers.
const ENDS: [&str; 2] = [
    "const answers = ['<p class=newest></p>', '<p class=last data-state=finished></p>', 'more'];",
    "const answers = ['<p class=newest></p>'];",
];
const FETCH: &str =
    "globalThis.fetch = async () => { if (!answers.length) throw 0; return { text: async () => answers.shift() } };";

/// The answer to one request: status line and headers, content.
fn ask(port: u16, request: &str) -> (String, Vec<u8>) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("somebody answers");
    write!(stream, "{request}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|window| window == b"\r\n\r\n").expect("headers end");
    let content = answer.split_off(end + 4);
    (String::from_utf8(answer).unwrap(), content)
}

#[test]
fn a_run_is_watched_from_this_machine_and_no_other() {
    let output = folder("watch").join("a.psb");
    let mut command = pocketsplat();
    command.arg("train").arg(capture()).arg("-o").arg(&output).args(["--watch", "--effects", "none"]);
    // Long enough to be asked; ended below.
    command.args(["--iterations", "5000"]).stderr(Stdio::piped()).stdout(Stdio::null());
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let line = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("watch it at"))).unwrap().unwrap();
    let port: u16 = line.split(':').next_back().unwrap().trim_end_matches('/').parse().unwrap();
    // What the program says later must not fill the pipe.
    std::thread::spawn(move || lines.for_each(drop));
    let host = format!("Host: 127.0.0.1:{port}");
    let get = |path: &str| ask(port, &format!("GET {path} HTTP/1.1\r\n{host}"));
    let (head, page) = get("/");
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("text/html"), "{head}");
    assert!(String::from_utf8(page).unwrap().contains("<h1>a</h1>"));
    let picture = (0..600).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(100));
        let (head, picture) = get("/preview.jpg");
        head.starts_with("HTTP/1.1 200").then_some(picture)
    });
    assert!(picture.expect("a preview within a minute").starts_with(&[0xff, 0xd8]), "a JPEG");
    assert!(get("/photograph.jpg").1.starts_with(&[0xff, 0xd8]));
    let state = String::from_utf8(get("/state").1).unwrap();
    assert!(state.contains("of 5,000") && state.contains("<svg") && state.contains("/preview.jpg?"), "{state}");
    let page = String::from_utf8(get("/").1).unwrap();
    for (request, status) in [
        (format!("GET /config.toml HTTP/1.1\r\n{host}"), 404),
        (format!("GET /../../etc/passwd HTTP/1.1\r\n{host}"), 404),
        (format!("POST / HTTP/1.1\r\n{host}\r\nContent-Length: 0"), 405),
        (format!("GET / HTTP/1.1\r\nHost: rebound.example:{port}"), 403),
    ] {
        let (head, content) = ask(port, &request);
        assert!(head.starts_with(&format!("HTTP/1.1 {status}")) && content.is_empty(), "{request}: {head}");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // From the disk: its pictures have gone with the program, and answers are made up.
    let page = page.replace("src=\"/", "src=\"data:,");
    for answers in ENDS {
        let page = page.replace("<head>", &format!("<head><script>{answers} {FETCH}</script>"));
        let said = chromium::said_by(&page, SCRIPT);
        assert!(said.is_none_or(|said| said.len() > 6));
    }
    chromium::axe::has_no_violations(
        "page about a run",
        &page.replace("setTimeout(follow, 3000);\n</script>", "</script>"),
    );
}

#[test]
fn the_page_of_a_run_says_that_it_is_finished_and_where_its_report_is() {
    let output = folder("watch-end").join("a.psb");
    let mut command = train(&output);
    let mut child = command.arg("--watch").stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let line = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("watch it at"))).unwrap().unwrap();
    let port: u16 = line.split(':').next_back().unwrap().trim_end_matches('/').parse().unwrap();
    std::thread::spawn(move || lines.for_each(drop));
    let request = format!("GET /state HTTP/1.1\r\nHost: 127.0.0.1:{port}");
    let mut states = Vec::new();
    while child.try_wait().unwrap().is_none()
        && !states.last().is_some_and(|state: &String| state.contains("data-state"))
    {
        states.push(String::from_utf8(ask(port, &request).1).unwrap());
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let last = states.last().unwrap();
    let report = output.with_extension("run").join("report.html");
    assert!(last.contains("state: finished") && last.contains(&report.display().to_string()), "{last}");
    assert!(states.iter().any(|state| state.contains(" it/s<") && state.contains("<span>bundle")), "{states:?}");
    assert!(child.wait().unwrap().success() && report.is_file());
}
