//! Shader texts in a browser: headless Chromium, which holds them to WGSL as browsers do. The suite's step
//! hands it a sample that stands for all of them, `cargo xtask campaign shaders` every text.
//!
//! A page from a server of this program's own, on localhost, makes a module of each text and a pipeline of
//! each kind, and posts back what it was told. A browser checks shaders on one thread, so several run at
//! once, and each takes the next texts that nobody has. Texts whose names say so it is to refuse, as it alone
//! does: where derivatives are taken behind a condition. Where there is no browser and none can be installed
//! the step is skipped, loudly; where CI runs it fails.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::outcome::Outcome;
use crate::shell::Usage;
use crate::{cover, setup, shaders, shell};

const PAGE: &str = include_str!("browser.html");
/// Entry points of the compute shaders, by the file that has their text.
const COMPUTED: &str = r#"[["library-tables", "fill"], ["library-tables", "evict"], ["library-tables", "load"],
    ["library-tables", "write"], ["library-compact", "count"], ["library-compact", "append"],
    ["library-inline", "forget"], ["library-inline", "settle"]]"#;
/// What the names of texts begin with that are to be refused.
const TO_BE_REFUSED: &str = "refused-";
/// Bytes of texts in one answer.
const BATCH: usize = 1 << 20;
/// Browsers at work at once, at most; each needs some 500 MiB.
const BROWSERS: usize = 4;
/// The browser is given up after so long without a word of it.
const PATIENCE: Duration = Duration::from_secs(180);
/// Faults that are shown.
const SHOWN: usize = 20;

/// The step: a sample in which any two options of a text meet as they do in all texts.
pub(crate) fn check() -> Result<Outcome> {
    check_texts(|texts| cover::of_pairs(texts.keys().map(String::as_str)))
}

/// `cargo xtask campaign shaders`: every text, some minutes of two processors.
pub(crate) fn campaign(options: &[&str]) -> Result<()> {
    if let [option, ..] = options {
        return Err(Usage(format!("campaign shaders takes no argument '{option}'")).into());
    }
    shaders::write_anew()?;
    check_texts(|texts| texts.keys().map(String::as_str).collect()).map(drop)
}

/// Has modules made of the texts that are chosen by their names, and every pipeline.
fn check_texts(choose: impl FnOnce(&BTreeMap<String, String>) -> BTreeSet<&str>) -> Result<Outcome> {
    if let Err(error) = setup::ensure(&setup::BROWSER) {
        if shell::is_ci() {
            return Err(error);
        }
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether browsers take the shaders !!!!\n");
        return Ok(Outcome::Skipped("no browser".to_owned()));
    }
    if !shaders::written().is_dir() {
        shaders::write(&shaders::written())?;
    }
    let texts: BTreeMap<String, String> = shaders::texts(&shaders::written())?.into_iter().collect();
    let chosen = choose(&texts);
    let listener = TcpListener::bind("127.0.0.1:0").context("cannot listen on localhost")?;
    listener.set_nonblocking(true)?;
    let page = format!("http://127.0.0.1:{}/", listener.local_addr()?.port());
    let at_once = std::thread::available_parallelism().map_or(1, usize::from).min(BROWSERS);
    let mut browsers = (0..at_once).map(|nth| Browser::start(nth, &page)).collect::<Result<Vec<_>>>()?;
    let mut told = Told::new(&texts, &chosen);
    told.listen(&listener, &mut browsers)?;
    if !told.wrong.is_empty() {
        let shown: Vec<&str> = told.wrong.iter().take(SHOWN).map(String::as_str).collect();
        bail!("the browser has {} complaints, such as\n{}", told.wrong.len(), shown.join("\n"));
    }
    if told.modules != chosen.len() {
        bail!("the browser has made {} modules of {} texts", told.modules, chosen.len());
    }
    let to_be_refused = chosen.iter().filter(|name| name.starts_with(TO_BE_REFUSED)).count();
    if to_be_refused == 0 || told.refused != to_be_refused {
        bail!("the browser has refused {} of {to_be_refused} texts that it is to refuse", told.refused);
    }
    println!(
        "{at_once} browsers took {} of {} texts without a word, but for {to_be_refused} that they are to refuse; each said:",
        chosen.len(),
        texts.len()
    );
    told.done.iter().for_each(|done| println!("  {done}"));
    Ok(Outcome::Passed)
}

/// Ends with this.
struct Browser(Child);

impl Browser {
    fn start(nth: usize, page: &str) -> Result<Browser> {
        let profile = shell::target_dir().join(format!("browser-profile-{nth}"));
        let _ = std::fs::remove_dir_all(&profile);
        start(&profile, page).map(Browser)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// On its software driver, so that it is the same everywhere, and without a word to anybody but this program.
fn start(profile: &Path, page: &str) -> Result<Child> {
    let name = setup::browser().context("no browser")?;
    let mut command = Command::new(name);
    command.arg(format!("--user-data-dir={}", profile.display())).args([
        "--headless",
        "--no-first-run",
        "--no-default-browser-check",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-extensions",
        "--enable-unsafe-webgpu",
        "--enable-features=Vulkan",
        "--use-vulkan=swiftshader",
        "--use-angle=swiftshader",
        "--use-webgpu-adapter=swiftshader",
    ]);
    if shell::output(shell::command("id").arg("-u")).is_ok_and(|user| user.trim() == "0") {
        command.arg("--no-sandbox"); // which it has not for root
    }
    command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().with_context(|| format!("cannot start {name}"))
}

/// What the pages ask for, and what they have said.
struct Told<'a> {
    texts: &'a BTreeMap<String, String>,
    /// Not taken yet.
    batches: Vec<Vec<(&'a str, &'a str)>>,
    /// How many of the pipelines, which the page numbers, are taken.
    pipelines: usize,
    /// How many modules the pages say they have made, and how many of those they have refused as they should.
    modules: usize,
    refused: usize,
    wrong: Vec<String>,
    /// What each page said at its end.
    done: Vec<String>,
}

impl<'a> Told<'a> {
    /// Of all texts, which pipelines are made of, those that are chosen are taken in batches.
    fn new(texts: &'a BTreeMap<String, String>, chosen: &BTreeSet<&str>) -> Told<'a> {
        let (mut batches, mut bytes) = (vec![Vec::new()], 0);
        for (name, text) in texts.iter().filter(|(name, _)| chosen.contains(name.as_str())) {
            if bytes > BATCH {
                batches.push(Vec::new());
                bytes = 0;
            }
            bytes += text.len();
            if let Some(batch) = batches.last_mut() {
                batch.push((name.as_str(), text.as_str()));
            }
        }
        Told { texts, batches, pipelines: 0, modules: 0, refused: 0, wrong: Vec::new(), done: Vec::new() }
    }

    /// Until every page is done, or nothing is heard of them any more.
    fn listen(&mut self, listener: &TcpListener, browsers: &mut [Browser]) -> Result<()> {
        let mut heard = Instant::now();
        let mut last = "that it has begun".to_owned();
        let mut silent = Vec::new();
        while self.done.len() < browsers.len() {
            if let Some(asked) = self.hear(listener, &mut silent)? {
                (heard, last) = (Instant::now(), asked);
                continue;
            }
            if heard.elapsed() > PATIENCE {
                bail!("the browser has said nothing for {} s; the last was {last}", PATIENCE.as_secs());
            }
            for browser in &mut *browsers {
                if let Some(status) = browser.0.try_wait()? {
                    bail!("the browser has ended ({status}); the last was {last}");
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Answers whoever has asked something; says what was asked last. Browsers also make connections that
    /// they may need later: those on which nothing came yet are `silent`, and nobody waits for them.
    fn hear(&mut self, listener: &TcpListener, silent: &mut Vec<TcpStream>) -> Result<Option<String>> {
        match listener.accept() {
            Ok((stream, _)) => silent.extend(stream.set_nonblocking(true).is_ok().then_some(stream)),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error).context("cannot listen to the browser"),
        }
        let mut last = None;
        for stream in std::mem::take(silent) {
            match stream.peek(&mut [0]) {
                Ok(0) => {}
                // A connection that breaks is the browser's to make again.
                Ok(_) => last = self.answer(stream).ok().or(last),
                Err(error) if error.kind() == ErrorKind::WouldBlock => silent.push(stream),
                Err(_) => {}
            }
        }
        Ok(last)
    }

    /// One request, of which something is there; says what it was.
    fn answer(&mut self, mut stream: TcpStream) -> Result<String> {
        stream.set_nonblocking(false)?;
        stream.set_read_timeout(Some(Duration::from_secs(30)))?;
        stream.set_write_timeout(Some(Duration::from_secs(30)))?;
        let (path, body) = request(&mut BufReader::new(&stream))?;
        let (status, kind, answer) = self.respond(&path, &body);
        write!(
            stream,
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
            answer.len()
        )?;
        stream.write_all(answer.as_bytes())?;
        Ok(format!("{path} {body}"))
    }

    fn respond(&mut self, path: &str, body: &str) -> (&'static str, &'static str, String) {
        let plain = |text: String| ("200 OK", "text/plain; charset=utf-8", text);
        let missing = ("404 Not Found", "text/plain", String::new());
        if let Some(name) = path.strip_prefix("/text/") {
            return self.texts.get(name).map_or(missing, |text| plain(text.clone()));
        }
        match path {
            "/" => ("200 OK", "text/html; charset=utf-8", page()),
            "/take/texts" => match self.batches.pop() {
                Some(batch) => {
                    plain(batch.iter().map(|(name, text)| format!("{name}\u{1}{text}\u{1}")).collect())
                }
                None => ("204 No Content", "text/plain", String::new()),
            },
            "/take/pipeline" => {
                self.pipelines += 1;
                plain((self.pipelines - 1).to_string())
            }
            "/made" => {
                self.modules += body.parse().unwrap_or(0);
                plain(String::new())
            }
            "/refused" => {
                self.refused += 1;
                plain(String::new())
            }
            "/wrong" => {
                self.wrong.push(body.to_owned());
                plain(String::new())
            }
            "/done" => {
                self.done.push(body.to_owned());
                plain(String::new())
            }
            _ => missing,
        }
    }
}

fn page() -> String {
    PAGE.replace("COMPUTED_ENTRIES", COMPUTED).replace("TO_BE_REFUSED", &format!("{TO_BE_REFUSED:?}"))
}

/// The path and the body of a request.
fn request(reader: &mut impl BufRead) -> Result<(String, String)> {
    /// Of what the page posts.
    const MOST: usize = 1 << 20;
    let mut line = String::new();
    reader.read_line(&mut line)?;
    let path = line.split(' ').nth(1).context("no request")?.to_owned();
    let mut length = 0;
    loop {
        let mut header = String::new();
        reader.read_line(&mut header)?;
        let header = header.trim_end();
        if header.is_empty() {
            break;
        }
        if let Some((name, value)) = header.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().context("a length that is no number")?;
        }
    }
    if length > MOST {
        bail!("a request of {length} bytes");
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    Ok((path, String::from_utf8_lossy(&body).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_whole() {
        let told = "POST /wrong HTTP/1.1\r\nHost: a\r\ncontent-length: 5\r\n\r\nhello";
        assert_eq!(request(&mut told.as_bytes()).unwrap(), ("/wrong".to_owned(), "hello".to_owned()));
        assert!(request(&mut "".as_bytes()).is_err());
        assert!(request(&mut "POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n".as_bytes()).is_err());
    }

    #[test]
    fn a_connection_on_which_nothing_comes_keeps_nobody_waiting() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let at = listener.local_addr().unwrap();
        let (_idle, mut asking) = (TcpStream::connect(at).unwrap(), TcpStream::connect(at).unwrap());
        asking.write_all(b"POST /done HTTP/1.1\r\nContent-Length: 3\r\n\r\nall").unwrap();
        let texts = BTreeMap::new();
        let mut told = Told::new(&texts, &BTreeSet::new());
        let (mut silent, begun) = (Vec::new(), Instant::now());
        while told.done.is_empty() && begun.elapsed() < Duration::from_secs(20) {
            told.hear(&listener, &mut silent).unwrap();
        }
        assert_eq!((told.done, silent.len()), (vec!["all".to_owned()], 1));
        assert!(begun.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn every_chosen_text_is_taken_once_and_every_text_can_be_had() {
        let texts: BTreeMap<String, String> =
            (0..40).map(|n| (format!("{n}.wgsl"), "x".repeat(BATCH / 7))).collect();
        let chosen: BTreeSet<&str> = texts.keys().skip(1).map(String::as_str).collect();
        let mut told = Told::new(&texts, &chosen);
        let mut taken = Vec::new();
        loop {
            let (status, _, batch) = told.respond("/take/texts", "");
            if status == "204 No Content" {
                break;
            }
            taken.extend(batch.split('\u{1}').step_by(2).filter(|name| !name.is_empty()).map(str::to_owned));
        }
        taken.sort();
        assert_eq!(taken, chosen.into_iter().collect::<Vec<_>>());
        assert_eq!(told.respond("/text/0.wgsl", "").0, "200 OK");
        assert_eq!(told.respond("/take/pipeline", "").2, "0");
        assert_eq!(told.respond("/take/pipeline", "").2, "1");
        assert_eq!(told.respond("/text/none.wgsl", "").0, "404 Not Found");
        assert!(told.respond("/", "").2.contains("name.startsWith(\"refused-\")"));
        told.respond("/refused", "refused-a: derivatives");
        told.respond("/made", "17");
        told.respond("/made", "3");
        told.respond("/wrong", "a: b");
        told.respond("/done", "all");
        assert_eq!((told.modules, told.refused, told.wrong.len()), (20, 1, 1));
        assert_eq!(told.done, ["all"]);
    }
}
