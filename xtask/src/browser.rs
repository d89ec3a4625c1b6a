//! The step that hands every shader text to a browser: headless Chromium, which holds them to WGSL as browsers do.
//!
//! A page from a server of this program's own, on localhost, makes a module of each text and a pipeline of each kind, and posts back what
//! it was told. Where there is no browser and none can be installed the step is skipped, loudly; where CI runs it fails.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::test::Outcome;
use crate::{setup, shaders, shell};

const PAGE: &str = include_str!("browser.html");
/// Entry points of the compute shaders, by the file that has their text.
const COMPUTED: &str = r#"[["library-table", "fill"], ["library-table", "evict"], ["library-table", "load"],
    ["library-table", "write"], ["library-compact", "count"], ["library-compact", "append"],
    ["library-inline", "forget"], ["library-inline", "settle"]]"#;
/// Bytes of texts in one answer.
const BATCH: usize = 4 << 20;
/// The browser is given up after so long without a word of it.
const PATIENCE: Duration = Duration::from_secs(180);
/// Faults that are shown.
const SHOWN: usize = 20;

pub(crate) fn check() -> Result<Outcome> {
    if let Err(error) = setup::ensure(&setup::BROWSER) {
        if std::env::var_os("CI").is_some_and(|ci| ci == "true") {
            return Err(error);
        }
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether browsers take the shaders !!!!\n");
        return Ok(Outcome::Skipped("no browser".to_owned()));
    }
    if !shaders::written().is_dir() {
        shaders::write(&shaders::written())?;
    }
    let texts: BTreeMap<String, String> = shaders::texts(&shaders::written())?.into_iter().collect();
    let listener = TcpListener::bind("127.0.0.1:0").context("cannot listen on localhost")?;
    listener.set_nonblocking(true)?;
    let profile = shell::target_dir().join("browser-profile");
    let _ = std::fs::remove_dir_all(&profile);
    let page = format!("http://127.0.0.1:{}/", listener.local_addr()?.port());
    let mut browser = Browser(start(&profile, &page)?);
    let mut told = Told::new(&texts);
    told.listen(&listener, &mut browser.0)?;
    if !told.wrong.is_empty() {
        let shown: Vec<&str> = told.wrong.iter().take(SHOWN).map(String::as_str).collect();
        bail!("the browser has {} complaints, such as\n{}", told.wrong.len(), shown.join("\n"));
    }
    println!("{} of {} texts taken without a word", told.done.unwrap_or_default(), texts.len());
    Ok(Outcome::Passed)
}

/// Ends with this.
struct Browser(Child);

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn program() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| shell::on_path(name))
}

/// On its software driver, so that it is the same everywhere, and without a word to anybody but this program.
fn start(profile: &Path, page: &str) -> Result<Child> {
    let name = program().context("no browser")?;
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

/// What the page asks for, and what it has said.
struct Told<'a> {
    texts: &'a BTreeMap<String, String>,
    batches: Vec<Vec<(&'a str, &'a str)>>,
    wrong: Vec<String>,
    done: Option<String>,
}

impl<'a> Told<'a> {
    fn new(texts: &'a BTreeMap<String, String>) -> Told<'a> {
        let (mut batches, mut bytes) = (vec![Vec::new()], 0);
        for (name, text) in texts {
            if bytes > BATCH {
                batches.push(Vec::new());
                bytes = 0;
            }
            bytes += text.len();
            if let Some(batch) = batches.last_mut() {
                batch.push((name.as_str(), text.as_str()));
            }
        }
        Told { texts, batches, wrong: Vec::new(), done: None }
    }

    /// Until the page is done, or nothing is heard of it any more.
    fn listen(&mut self, listener: &TcpListener, browser: &mut Child) -> Result<()> {
        let mut heard = Instant::now();
        let mut last = "that it has begun".to_owned();
        while self.done.is_none() {
            match listener.accept() {
                Ok((stream, _)) => {
                    heard = Instant::now();
                    // A connection that breaks is the browser's to make again.
                    if let Ok(asked) = self.answer(stream) {
                        last = asked;
                    }
                }
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                    if heard.elapsed() > PATIENCE {
                        bail!(
                            "the browser has said nothing for {} s; the last was {last}",
                            PATIENCE.as_secs()
                        );
                    }
                    if let Some(status) = browser.try_wait()? {
                        bail!("the browser has ended ({status}); the last was {last}");
                    }
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(error) => return Err(error).context("cannot listen to the browser"),
            }
        }
        Ok(())
    }

    /// One request; says what it was.
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
        if let Some(nth) = path.strip_prefix("/texts/") {
            let Some(batch) = nth.parse().ok().and_then(|nth: usize| self.batches.get(nth)) else {
                return ("204 No Content", "text/plain", String::new());
            };
            return plain(batch.iter().map(|(name, text)| format!("{name}\u{1}{text}\u{1}")).collect());
        }
        if let Some(name) = path.strip_prefix("/text/") {
            return self.texts.get(name).map_or(missing, |text| plain(text.clone()));
        }
        match path {
            "/" => ("200 OK", "text/html; charset=utf-8", PAGE.replace("COMPUTED_ENTRIES", COMPUTED)),
            "/wrong" => {
                self.wrong.push(body.to_owned());
                plain(String::new())
            }
            "/done" => {
                self.done = Some(body.to_owned());
                plain(String::new())
            }
            "/alive" => plain(String::new()),
            _ => missing,
        }
    }
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
    fn every_text_is_in_one_batch() {
        let texts = (0..40).map(|n| (format!("{n}.wgsl"), "x".repeat(BATCH / 7))).collect();
        let mut told = Told::new(&texts);
        assert!(told.batches.len() > 3);
        assert_eq!(told.batches.concat().len(), texts.len());
        let last = told.batches.len();
        assert_eq!(told.respond(&format!("/texts/{last}"), "").0, "204 No Content");
        assert_eq!(told.respond("/text/none.wgsl", "").0, "404 Not Found");
        told.respond("/wrong", "a: b");
        told.respond("/done", "all");
        assert_eq!((told.wrong.len(), told.done.as_deref()), (1, Some("all")));
    }
}
