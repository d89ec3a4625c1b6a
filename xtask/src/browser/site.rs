//! A browser, and the pages that it is shown by a server of this program's own, on localhost.

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::{setup, shell};

/// The browser is given up after so long without a word of it.
const PATIENCE: Duration = Duration::from_secs(180);

/// What a page asks, and what it is answered.
pub(crate) trait Site {
    /// The answer to what is asked at a path.
    fn respond(&mut self, path: &str, body: &str) -> Answer;

    /// Returns true if all pages have said all that they are to say.
    fn is_done(&self) -> bool;
}

/// What a page is answered.
pub(crate) struct Answer {
    pub(crate) status: &'static str,
    kind: &'static str,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    /// Something of a kind that the browser knows by its name.
    pub(crate) fn of(kind: &'static str, body: impl Into<Vec<u8>>) -> Answer {
        Answer { status: "200 OK", kind, body: body.into() }
    }

    /// A text.
    pub(crate) fn plain(text: impl Into<String>) -> Answer {
        Answer::of("text/plain; charset=utf-8", text.into())
    }

    /// That there is no more.
    pub(crate) fn empty() -> Answer {
        Answer { status: "204 No Content", kind: "text/plain", body: Vec::new() }
    }

    /// That there is no such thing.
    pub(crate) fn missing() -> Answer {
        Answer { status: "404 Not Found", kind: "text/plain", body: Vec::new() }
    }
}

/// Ends with this.
pub(crate) struct Browser(Child);

impl Browser {
    /// Starts the `nth`, which shows a page.
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

/// Shows so many browsers the site until that is done. Fails where they end before, or say nothing for long.
pub(crate) fn show(site: &mut impl Site, browsers: usize) -> Result<()> {
    let mut server = Server::new()?;
    let page = server.page()?;
    let mut browsers = (0..browsers).map(|nth| Browser::start(nth, &page)).collect::<Result<Vec<_>>>()?;
    let mut heard = Instant::now();
    let mut last = "that it has begun".to_owned();
    while !site.is_done() {
        if let Some(asked) = server.hear(site)? {
            (heard, last) = (Instant::now(), asked);
            continue;
        }
        if heard.elapsed() > PATIENCE {
            bail!("the browser has said nothing for {} s; the last was {last}", PATIENCE.as_secs());
        }
        for browser in &mut browsers {
            if let Some(status) = browser.0.try_wait()? {
                bail!("the browser has ended ({status}); the last was {last}");
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

/// Listens on localhost, at a port that is free.
struct Server {
    listener: TcpListener,
    /// Browsers also make connections that they may need later: those on which nothing came yet, and nobody
    /// waits for them.
    silent: Vec<TcpStream>,
}

impl Server {
    fn new() -> Result<Server> {
        let listener = TcpListener::bind("127.0.0.1:0").context("cannot listen on localhost")?;
        listener.set_nonblocking(true)?;
        Ok(Server { listener, silent: Vec::new() })
    }

    fn page(&self) -> Result<String> {
        Ok(format!("http://127.0.0.1:{}/", self.listener.local_addr()?.port()))
    }

    /// Answers whoever has asked something; says what was asked last.
    fn hear(&mut self, site: &mut impl Site) -> Result<Option<String>> {
        match self.listener.accept() {
            Ok((stream, _)) => self.silent.extend(stream.set_nonblocking(true).is_ok().then_some(stream)),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error).context("cannot listen to the browser"),
        }
        let mut last = None;
        for stream in std::mem::take(&mut self.silent) {
            match stream.peek(&mut [0]) {
                Ok(0) => {}
                // A connection that breaks is the browser's to make again.
                Ok(_) => last = answer(stream, site).ok().or(last),
                Err(error) if error.kind() == ErrorKind::WouldBlock => self.silent.push(stream),
                Err(_) => {}
            }
        }
        Ok(last)
    }
}

/// One request, of which something is there; says what it was.
fn answer(mut stream: TcpStream, site: &mut impl Site) -> Result<String> {
    /// Of a body that is told.
    const TOLD: usize = 200;
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    stream.set_write_timeout(Some(Duration::from_secs(30)))?;
    let (path, body) = request(&mut BufReader::new(&stream))?;
    let Answer { status, kind, body: answer } = site.respond(&path, &body);
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        answer.len()
    )?;
    stream.write_all(&answer)?;
    Ok(format!("{path} {}", body.chars().take(TOLD).collect::<String>()))
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

    /// Is done when it has heard something.
    struct Heard(Vec<String>);

    impl Site for Heard {
        fn respond(&mut self, path: &str, body: &str) -> Answer {
            self.0.push(format!("{path} {body}"));
            Answer::empty()
        }

        fn is_done(&self) -> bool {
            !self.0.is_empty()
        }
    }

    #[test]
    fn requests_are_read_whole() {
        let told = "POST /wrong HTTP/1.1\r\nHost: a\r\ncontent-length: 5\r\n\r\nhello";
        assert_eq!(request(&mut told.as_bytes()).unwrap(), ("/wrong".to_owned(), "hello".to_owned()));
        assert!(request(&mut "".as_bytes()).is_err());
        assert!(request(&mut "POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n".as_bytes()).is_err());
    }

    #[test]
    fn a_connection_on_which_nothing_comes_keeps_nobody_waiting() {
        let mut server = Server::new().unwrap();
        let at = server.listener.local_addr().unwrap();
        let (_idle, mut asking) = (TcpStream::connect(at).unwrap(), TcpStream::connect(at).unwrap());
        asking.write_all(b"POST /done HTTP/1.1\r\nContent-Length: 3\r\n\r\nall").unwrap();
        let (mut site, begun) = (Heard(Vec::new()), Instant::now());
        while !site.is_done() && begun.elapsed() < Duration::from_secs(20) {
            server.hear(&mut site).unwrap();
        }
        assert_eq!((site.0, server.silent.len()), (vec!["/done all".to_owned()], 1));
        assert!(begun.elapsed() < Duration::from_secs(20));
    }
}
