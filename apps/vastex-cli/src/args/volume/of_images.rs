//! Words that `vastex render` has for images and not for volumes: each is refused with the reason.

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};

use super::super::value_error;

/// A word, whether a value follows it, and why volumes do not have it.
struct OfImages {
    name: &'static str,
    has_value: bool,
    why: &'static str,
}

const fn with_value(name: &'static str, why: &'static str) -> OfImages {
    OfImages { name, has_value: true, why }
}

const fn alone(name: &'static str, why: &'static str) -> OfImages {
    OfImages { name, has_value: false, why }
}

/// What is said to several.
const LAYERS: &str =
    "channels of a volume are textures of their own; --channels and --range say how they are shown";
const SURFACES: &str = "it is of terrains and planets, which are surfaces of images";
const ESTIMATE: &str = "estimates follow surfaces; what a ray meets follows from the values along it alone";
const ONE_CAMERA: &str =
    "pictures of a volume are of one camera at rest, or of a path's places, each once all of it is there";

/// Each with its reason, as docs/volumes.md tells it.
const ALL: &[OfImages] = &[
    with_value(
        "overlay",
        "overlays show the page of each pixel, and a ray meets many bricks; --explain tells of a pixel of a slice, \
         --dump-pools of all bricks that are loaded",
    ),
    with_value("views", "a picture of a volume has one camera; the library draws several views of one"),
    alone("predict", ONE_CAMERA),
    alone("realtime", ONE_CAMERA),
    alone("until-converged", "pictures of volumes always wait for everything in view"),
    with_value("latency-frames", "a load of a brick takes a frame, so that every run is the same"),
    with_value("fade-ms", "bricks are there at once: a ray blends many of them already"),
    with_value(
        "prefetch-sets",
        "sets are learned of places over an image; each picture of a volume waits for all that it shows",
    ),
    alone(
        "direct",
        "it goes past the system's file cache for containers of images; chunks of volumes go through it",
    ),
    with_value("whole-kib", "a volume of one brick is all tail, and any other is read in bricks"),
    with_value("part-side", "pictures of volumes are drawn in one part"),
    with_value("estimate", ESTIMATE),
    alone("beside", ESTIMATE),
    with_value("estimate-unseen", ESTIMATE),
    with_value(
        "cache-gib",
        "made levels that --cache keeps take a part of the coarsest stored one (docs/volumes.md); the window keeps its directory small",
    ),
    with_value("height-layer", SURFACES),
    with_value("height-scale", SURFACES),
    with_value("height-zero", SURFACES),
    with_value("height", SURFACES),
    with_value("night", SURFACES),
    with_value("clouds", SURFACES),
    with_value("sun", SURFACES),
    with_value("exaggeration", SURFACES),
    with_value("atmosphere", SURFACES),
    with_value("layer", LAYERS),
    with_value("layer-shown", LAYERS),
    with_value("exposure", "channels have a window and gamma; --channels and --range say them"),
    with_value("curve", "channels have a window and gamma; --channels and --range say them"),
    with_value("over", "nothing lies over a volume but --labels"),
    with_value("compare-mode", "nothing lies over a volume but --labels"),
    with_value("placement", "nothing lies over a volume but --labels"),
];

/// The word of images that was given, if one was.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfImagesArgs {
    given: Option<usize>,
}

impl OfImagesArgs {
    /// Fails where one was given.
    pub(super) fn check(self) -> Result<(), clap::Error> {
        match self.given.and_then(|nth| ALL.get(nth)) {
            Some(of) => Err(value_error(&format!("'--{}': {}", of.name, of.why))),
            None => Ok(()),
        }
    }
}

impl Args for OfImagesArgs {
    fn augment_args(command: Command) -> Command {
        let arg = |of: &OfImages| {
            let arg = Arg::new(of.name).long(of.name).hide(true);
            match of.has_value {
                true => arg.action(ArgAction::Append).allow_hyphen_values(true),
                false => arg.action(ArgAction::SetTrue),
            }
        };
        command.args(ALL.iter().map(arg))
    }

    fn augment_args_for_update(command: Command) -> Command {
        OfImagesArgs::augment_args(command)
    }
}

impl FromArgMatches for OfImagesArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<OfImagesArgs, clap::Error> {
        let is_given = |of: &OfImages| matches.value_source(of.name) == Some(ValueSource::CommandLine);
        Ok(OfImagesArgs { given: ALL.iter().position(is_given) })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = OfImagesArgs::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;
    use clap::{CommandFactory, Parser};

    use super::super::super::{Args as Words, RENDER_VOLUME};
    use super::*;

    /// No word that images have is unknown to a picture of a volume: it is taken, or refused with a reason.
    #[test]
    fn every_word_of_images_is_had_or_refused_with_its_reason() {
        let command = Words::command();
        let words = |name: &str| -> Vec<String> {
            let of = command.find_subcommand(name).unwrap();
            of.get_arguments().filter_map(|arg| arg.get_long().map(str::to_owned)).collect()
        };
        let of_volumes = words(RENDER_VOLUME);
        let unknown: Vec<String> =
            words("render").into_iter().filter(|word| !of_volumes.contains(word)).collect();
        assert!(unknown.is_empty(), "{unknown:?}");
        for of in ALL {
            let word = format!("--{}", of.name);
            let value = of.has_value.then_some("1");
            let words = ["vastex", RENDER_VOLUME, "a.zarr", "--on", "volume", &word].into_iter().chain(value);
            let error = Words::try_parse_from(words).unwrap().check().unwrap_err();
            assert!(
                error.kind() == ErrorKind::ValueValidation && error.to_string().contains(of.why),
                "{error}"
            );
        }
    }
}
