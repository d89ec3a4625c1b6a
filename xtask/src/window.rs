//! The step that opens the program's window, on a display that is none.
//!
//! What the window shows is drawn by the same code as the pictures, which the tests compare; here it is opened, redrawn
//! and closed. Where there is no virtual display the step is skipped, loudly.

use anyhow::Result;

use crate::test::Outcome;
use crate::{setup, shell};

const IMAGE: &str = "assets/earth-elevation-1080x540-u16.png";
const FRAMES: &str = "40";

pub(crate) fn check() -> Result<Outcome> {
    if !cfg!(target_os = "linux") {
        return Ok(Outcome::Skipped("virtual displays are looked for on Linux only".to_owned()));
    }
    if let Err(error) = setup::ensure(&setup::VIRTUAL_DISPLAY) {
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether the window still opens !!!!\n");
        return Ok(Outcome::Skipped("no virtual display".to_owned()));
    }
    let container = shell::target_dir().join("window.vastex");
    // The program as its tests have it: asked for by itself it would be compiled anew, with fewer features.
    shell::run(shell::cargo("test").args(["--quiet", "--workspace", "--test", "program", "--no-run"]))?;
    let program = shell::target_dir().join("debug/vastex");
    let mut build = shell::command(&program.to_string_lossy());
    shell::run(build.args(["build", IMAGE, "--quiet", "-o"]).arg(&container))?;
    for scene in ["image", "globe"] {
        let mut command = shell::command("xvfb-run");
        command.args(["-a", "-s", "-screen 0 1280x800x24"]).arg(&program).arg("view").arg(&container);
        shell::run(command.args(["--on", scene, "--exit-after-frames", FRAMES]))?;
    }
    Ok(Outcome::Passed)
}
