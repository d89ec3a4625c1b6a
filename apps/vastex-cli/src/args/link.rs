//! Links in the place of a source: what they say is put where the command line says it otherwise.

use std::path::{Path, PathBuf};

use vastex_viewer::{Link, LinkError};

use super::{Args, Command, SceneArgs, conflict, value_error};

impl Args {
    /// Puts what links say in the place of them.
    pub(crate) fn follow_links(&mut self) -> Result<(), clap::Error> {
        match &mut self.command {
            Command::Render(args) => args.scene.follow_link(),
            #[cfg(feature = "volumes")]
            Command::RenderVolume(args) => args.follow_view(),
            Command::Info(args) => follow_to_file(&mut args.file),
            #[cfg(feature = "build")]
            Command::Crop(args) => follow_to_file(&mut args.source),
            #[cfg(feature = "view")]
            Command::View(args) => args.scene.follow_link(),
            _ => Ok(()),
        }
    }
}

/// Puts the file that a link is of in its place, for commands that show nothing of it.
fn follow_to_file(source: &mut PathBuf) -> Result<(), clap::Error> {
    if let Some(link) = link_of(source)? {
        *source = link.source.into();
    }
    Ok(())
}

/// The link that stands in the place of a source, if one does.
pub(super) fn link_of(source: &Path) -> Result<Option<Link>, clap::Error> {
    let Some(text) = source.to_str().filter(|text| Link::is_link(text)) else { return Ok(None) };
    let link = text.parse().map_err(|error: LinkError| {
        let begin: String = text.chars().take(100).collect();
        value_error(&format!("'{begin}' for '<SOURCE>': {error}"))
    })?;
    Ok(Some(link))
}

/// Returns true if words of a command line are meant as a link.
#[cfg(feature = "view")]
pub(crate) fn is_link(words: &Path) -> bool {
    words.to_str().is_some_and(Link::is_link)
}

/// An error of the command line without what is for people at a terminal.
#[cfg(feature = "view")]
pub(crate) fn without_help(error: &clap::Error) -> String {
    let text = error.to_string();
    let text = text.split("\n\nFor more information").next().unwrap_or_default();
    text.strip_prefix("error: ").unwrap_or(text).to_owned()
}

impl SceneArgs {
    /// Puts what a link says in its place, where the source is one.
    pub(crate) fn follow_link(&mut self) -> Result<(), clap::Error> {
        let Some(link) = link_of(&self.source)? else { return Ok(()) };
        if link.view.is_some() && self.view.is_some() {
            return Err(conflict(
                "the link says which view is shown, and --view does; leave out one of them",
            ));
        }
        self.view = link.view.or(self.view.take());
        self.source = link.source.into();
        // Files of the link come first, as it counts them.
        self.layers.over.splice(0..0, link.files.into_iter().map(Into::into));
        Ok(())
    }
}
