//! What the machine must have, and how it gets it: by apt on Debian and Ubuntu, by name elsewhere.
//!
//! Each need says how its presence is seen, so that nothing is installed that is there already.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::shell;

/// Something that a command needs from the machine.
pub(crate) struct Need {
    /// What it is, for a person.
    what: &'static str,
    /// What it is needed for.
    why: &'static str,
    /// True if the machine has it.
    present: fn() -> bool,
    /// The packages that bring it, on Debian and Ubuntu.
    debian: &'static [&'static str],
    /// What to install on other systems.
    elsewhere: &'static str,
}

pub(crate) const C_COMPILER: Need = Need {
    what: "a C and C++ compiler",
    why: "the encoders of JPEG, Zstandard and BC7 are C and C++ libraries",
    present: has_c_compiler,
    debian: &["gcc", "g++", "libc6-dev"],
    elsewhere: "gcc and g++, or clang (on macOS: xcode-select --install; on Windows: the Visual Studio build tools)",
};

pub(crate) const NASM: Need = Need {
    what: "the assembler nasm, where JPEG needs it",
    why: "the JPEG decoder's SIMD code is compiled with it on x86; without it, JPEG images are read about three times slower",
    present: || !cfg!(any(target_arch = "x86", target_arch = "x86_64")) || shell::on_path("nasm"),
    debian: &["nasm"],
    elsewhere: "nasm (https://www.nasm.us)",
};

pub(crate) const MINGW: Need = Need {
    what: "a C and C++ compiler for Windows",
    why: "the encoders of JPEG, Zstandard and BC7 are C and C++ libraries",
    present: || ["x86_64-w64-mingw32-gcc", "x86_64-w64-mingw32-g++"].into_iter().all(shell::on_path),
    debian: &["gcc-mingw-w64-x86-64", "g++-mingw-w64-x86-64"],
    elsewhere: "MinGW-w64 (Fedora: mingw64-gcc-c++; Arch and Homebrew: mingw-w64-gcc or mingw-w64)",
};

pub(crate) const GRAPHICS_DRIVER: Need = Need {
    what: "a graphics driver",
    why: "Vastex draws with Vulkan; Mesa's software driver does where there is no GPU",
    present: has_graphics_driver,
    debian: &["mesa-vulkan-drivers"],
    elsewhere: "a Vulkan driver (Fedora: mesa-vulkan-drivers vulkan-loader; Arch: vulkan-swrast vulkan-icd-loader)",
};

pub(crate) const VIRTUAL_DISPLAY: Need = Need {
    what: "a virtual display",
    why: "the window is opened on it",
    present: has_virtual_display,
    debian: &[
        "xvfb",
        "xauth",
        "xdotool",
        "libx11-xcb1",
        "libxkbcommon-x11-0",
        "libxcursor1",
        "libxi6",
        "libxrandr2",
    ],
    elsewhere: "Xvfb with xvfb-run, xdotool, and libxkbcommon-x11",
};

pub(crate) const ACCESSIBILITY: Need = Need {
    what: "the registry of accessible programs, and a session bus",
    why: "the window says there what a screen reader hears",
    present: || {
        let service = "/usr/share/dbus-1/services/org.a11y.Bus.service";
        Path::new(service).is_file() && ["dbus-daemon", "gdbus"].into_iter().all(shell::on_path)
    },
    debian: &["at-spi2-core", "dbus", "libglib2.0-bin"],
    elsewhere: "at-spi2-core, dbus and gdbus (Fedora: at-spi2-core dbus-daemon glib2; Arch: at-spi2-core dbus glib2)",
};

pub(crate) const BROWSER: Need = Need {
    what: "Chromium",
    why: "shaders are handed to a browser, which refuses what other compilers take, and its software driver draws a sample of the tests",
    present: || browser().is_some(),
    debian: &["chromium"],
    elsewhere: "Chromium or Chrome",
};

pub(crate) const VIPS: Need = Need {
    what: "libvips' programs",
    why: "the benchmark runs beside them",
    present: || shell::on_path("vips"),
    debian: &["libvips-tools"],
    elsewhere: "libvips with its command line tools (Fedora: vips-tools; Arch and Homebrew: libvips or vips)",
};

pub(crate) const GNU_TIME: Need = Need {
    what: "GNU time",
    why: "it reads the CPU time and the peak memory of the programs that are measured",
    present: || Path::new(crate::measure::GNU_TIME).is_file(),
    debian: &["time"],
    elsewhere: "GNU time as /usr/bin/time",
};

pub(crate) const PYTHON: Need = Need {
    what: "Python with venv",
    why: "some of what the benchmark runs beside is written in it",
    present: || shell::succeeds(shell::command("python3").args(["-c", "import ensurepip, venv"])),
    debian: &["python3", "python3-venv"],
    elsewhere: "Python 3 with its venv module",
};

/// The name of the browser that there is.
pub(crate) fn browser() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| shell::on_path(name))
}

/// Makes sure that the machine has what is needed, installing it where it can; says what and why.
pub(crate) fn ensure(need: &Need) -> Result<()> {
    if (need.present)() {
        println!("found {}", need.what);
        return Ok(());
    }
    println!("installing {}, since there is none: {}", need.what, need.why);
    install(need.debian).with_context(|| {
        format!(
            "{} is missing ({}) and could not be installed; please install {}",
            need.what, need.why, need.elsewhere
        )
    })?;
    if !(need.present)() {
        bail!("{} is still missing after installing {}", need.what, need.debian.join(" "));
    }
    Ok(())
}

/// As [`ensure`], for what makes things faster only: where it cannot be had, says so and goes on.
pub(crate) fn ensure_if_possible(need: &Need) {
    if let Err(error) = ensure(need) {
        println!("going on without {}: {error:#}", need.what);
    }
}

/// Installs packages with apt, with a fresh list of packages where the first attempt fails.
pub(crate) fn install(packages: &[&str]) -> Result<()> {
    if !shell::on_path("apt-get") {
        bail!("this system has no apt-get");
    }
    let install = || {
        let mut command = apt_get()?;
        shell::run(command.args(["install", "-y", "--no-install-recommends"]).args(packages))
    };
    install().or_else(|_| {
        println!("once more, with a fresh list of packages");
        shell::run(apt_get()?.arg("update"))?;
        install()
    })
}

/// Adds a component of the toolchain, such as rustfmt, where `cargo <subcommand>` does not start.
pub(crate) fn ensure_component(subcommand: &str, component: &str) -> Result<()> {
    if shell::succeeds(shell::cargo(subcommand).arg("--version")) {
        println!("found cargo {subcommand}");
        return Ok(());
    }
    println!("adding {component} to the toolchain, since cargo {subcommand} is missing");
    shell::run(shell::command("rustup").args(["component", "add", component])).with_context(|| {
        format!("cargo {subcommand} is missing; please install {component} for your toolchain")
    })
}

/// apt-get with the rights that it needs and without questions.
fn apt_get() -> Result<Command> {
    let is_root = shell::output(shell::command("id").arg("-u"))?.trim() == "0";
    if !is_root && !shell::on_path("sudo") {
        bail!("installing packages needs root, and there is no sudo");
    }
    let mut command = shell::command(if is_root { "env" } else { "sudo" });
    command.args(["DEBIAN_FRONTEND=noninteractive", "apt-get"]);
    Ok(command)
}

fn has_c_compiler() -> bool {
    // On Windows the build scripts look the compiler up in the registry, where this program does not.
    let has = |variable: &str, program: &str| std::env::var_os(variable).is_some() || shell::on_path(program);
    cfg!(windows) || (has("CC", "cc") && has("CXX", "c++"))
}

fn has_virtual_display() -> bool {
    let libraries = shell::output(shell::command("/sbin/ldconfig").arg("-p"));
    shell::on_path("xvfb-run")
        && shell::on_path("xdotool")
        && libraries.is_ok_and(|libs| libs.contains("libxkbcommon-x11.so.0"))
}

fn has_graphics_driver() -> bool {
    if cfg!(any(target_os = "macos", windows)) {
        return true; // Metal and Direct3D come with the system.
    }
    let loader = shell::output(shell::command("/sbin/ldconfig").arg("-p"))
        .is_ok_and(|libs| libs.contains("libvulkan.so.1"));
    let gpu =
        ["/dev/dri/renderD128", "/dev/nvidiactl", "/dev/dxg"].iter().any(|device| Path::new(device).exists());
    loader && drives(&driver_manifests(), gpu)
}

/// Returns true if one of these Vulkan drivers has something to drive: a hardware driver on a machine without
/// a GPU has not.
fn drives(manifests: &[PathBuf], gpu: bool) -> bool {
    let software = |manifest: &PathBuf| {
        let name = manifest.file_name().unwrap_or_default().to_string_lossy();
        name.contains("lvp") || name.contains("swiftshader")
    };
    manifests.iter().any(|manifest| gpu || software(manifest))
}

/// The Vulkan drivers that the loader would find.
fn driver_manifests() -> Vec<PathBuf> {
    let is_manifest =
        |path: &PathBuf| path.extension().is_some_and(|extension| extension == "json") && path.is_file();
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        if let Some(files) = std::env::var_os(variable) {
            return std::env::split_paths(&files).filter(is_manifest).collect();
        }
    }
    ["/usr/share", "/usr/local/share", "/etc"]
        .iter()
        .filter_map(|directory| std::fs::read_dir(Path::new(directory).join("vulkan/icd.d")).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(is_manifest)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hardware_driver_alone_needs_a_gpu() {
        let hardware = PathBuf::from("/usr/share/vulkan/icd.d/radeon_icd.x86_64.json");
        let software = PathBuf::from("/usr/share/vulkan/icd.d/lvp_icd.x86_64.json");
        assert!(!drives(&[], true));
        assert!(!drives(std::slice::from_ref(&hardware), false));
        assert!(drives(std::slice::from_ref(&hardware), true));
        assert!(drives(&[hardware, software], false));
    }
}
