//! An inset as it is written on the command line.

use vastex_build::Inset;

/// `IMAGE@X,Y,LEVEL`; the name of the image may hold the sign itself. What is a layer's name in it,
/// [`of_layer`] tells.
pub(super) fn parse_inset(text: &str) -> Result<Inset, String> {
    let inset = text.rsplit_once('@').filter(|(image, _)| !image.is_empty()).and_then(|(image, place)| {
        let mut numbers = place.split(',');
        let at = [numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?];
        let finer = numbers.next()?.parse().ok().filter(|finer| *finer < 32)?;
        numbers.next().is_none().then(|| Inset { layer: None, image: image.into(), at, finer })
    });
    inset.ok_or_else(|| {
        "write the image, column and row in its own texels, and how many levels it is finer, as in rome.png@8192,4096,3".into()
    })
}

/// The same in a texture of named layers: what stands before an equals sign is the layer's name.
pub(super) fn of_layer(inset: &Inset) -> Inset {
    let text = inset.image.to_string_lossy();
    match text.split_once('=') {
        Some((layer, image)) => Inset { layer: Some(layer.into()), image: image.into(), ..inset.clone() },
        None => inset.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_before_the_image_is_the_layers() {
        let parsed = of_layer(&parse_inset("height=a=b.png@1,2,3").unwrap());
        assert_eq!((parsed.layer.as_deref(), parsed.image.to_str()), (Some("height"), Some("a=b.png")));
        let parsed = of_layer(&parse_inset("a.png@1,2,3").unwrap());
        assert_eq!((parsed.layer, parsed.image.to_str(), parsed.at), (None, Some("a.png"), [1, 2]));
    }

    #[test]
    fn insets_are_an_image_a_place_and_a_level() {
        let inset = |image: &str, at, finer| Ok(Inset { layer: None, image: image.into(), at, finer });
        assert_eq!(parse_inset("rome.png@8192,0,3"), inset("rome.png", [8192, 0], 3));
        assert_eq!(parse_inset("a@b,c@1,2,0"), inset("a@b,c", [1, 2], 0));
        for bad in
            ["", "a.png", "@1,2,3", "a@1,2", "a@1,2,3,4", "a@1,-2,3", "a@1,2,32", "a@1,2,", "a@1.5,2,1"]
        {
            assert!(parse_inset(bad).is_err(), "{bad}");
        }
    }
}
