//! The layers of a build: which image makes which, and whether they suit one another.
//!
//! What becomes of their rows is [`crate::pyramid::stack`]'s business.

use std::path::{Path, PathBuf};

use vastex_core::{AddressMode, Description, Dims, Geometry, GeometrySpec, Layer, LayerFormat, NodataValue};

use super::{BuildError, BuildOptions, LayerReport, fingerprint, place};
use crate::image::tiff::file::pyramid::bands_in_path;
use crate::image::{Notice, Opened, RowReader, TiffAbout, in_srgb, open_with_files_while};
use crate::progress::Progress;
use crate::pyramid::stack::LayerPlan;
use crate::texels::LayerInput;
use crate::texels::blocks;
use crate::texels::convert::{Conversion, layer_format, possible_formats};
use crate::texels::filter::{LayerFilter, LevelsFrom, Meaning};
use crate::texels::scaled::{Blend, Scaled};

/// An image that is open, and the layer that it makes.
pub(crate) struct OpenLayer {
    pub(crate) path: PathBuf,
    /// All that is read of it.
    files: Vec<PathBuf>,
    pub(crate) reader: Box<dyn RowReader>,
    pub(crate) layer: Layer,
    /// As asked for.
    filter: Option<LayerFilter>,
    /// True if its numbers are colours.
    is_color: bool,
}

impl OpenLayer {
    /// All that is read of it: files, and directories of tiles.
    pub(crate) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    fn open(
        input: LayerInput,
        output: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<OpenLayer, BuildError> {
        let LayerInput { name, path, format, filter } = input;
        let opened = open_with_files_while(&path, &|| progress.opening());
        let opened = opened.map_err(|fault| BuildError::input(&path, fault))?;
        let Opened { mut reader, files } = opened;
        if options.tolerant {
            reader.tolerate();
        }
        place::check(&files, output)?;
        let filter = filter.or(options.filter);
        let of_format = |format| Layer::new(name.clone(), format);
        let expected = of_format(format.unwrap_or_else(|| layer_format(reader.header())));
        let is_color = LayerFilter::is_of_color(filter, &expected);
        if is_color {
            reader = in_srgb(reader);
        }
        // A profile may have told that the colours are light.
        let layer = of_format(format.unwrap_or_else(|| layer_format(reader.header())));
        if layer.format.is_compressed() && !blocks::AVAILABLE {
            return Err(BuildError::NoEncoders(layer.format.name()));
        }
        Ok(OpenLayer { path, files, reader, layer, filter, is_color })
    }

    fn size(&self) -> [u32; 2] {
        [self.reader.header().width, self.reader.header().height]
    }

    /// How its levels are made.
    pub(crate) fn filter(&self, options: &BuildOptions) -> Result<LayerFilter, BuildError> {
        let Layer { name, format, .. } = &self.layer;
        let asked = self.filter;
        let mut filter = asked.unwrap_or_else(|| LayerFilter::for_layer(name, *format, options.linear));
        // Asked for by name, it is refused where it makes no sense.
        if filter.from == LevelsFrom::Chain && (asked.is_some() || !filter.kernel.picks()) {
            filter.from = options.levels_from;
        }
        let filter = filter.for_format(*format)?;
        Ok(LayerFilter { nodata: filter.nodata.or_else(|| self.nodata(filter, options)), ..filter })
    }

    /// The value of texels without data, as the layer stores it. Directions have none.
    fn nodata(&self, filter: LayerFilter, options: &BuildOptions) -> Option<NodataValue> {
        let header = self.reader.header();
        let value = options.nodata.of(header.nodata).filter(|_| filter.meaning != Meaning::Normal)?;
        Conversion::new(header, self.layer.format, self.is_color)?.nodata(value)
    }

    /// What mixing its texels means.
    fn blend(&self, options: &BuildOptions) -> Result<Blend, BuildError> {
        let filter = self.filter(options)?;
        Ok(match filter.meaning {
            _ if !filter.kernel.may_mix() || filter.nodata.is_some() => Blend::Pick,
            Meaning::Normal => Blend::Normal,
            _ if self.is_color => Blend::Color,
            _ => Blend::Stored,
        })
    }

    /// What there is to say of what was made of it, besides what is found while tiles are made.
    pub(crate) fn report(&self, plan: &LayerPlan) -> LayerReport {
        let mut notices = self.reader.header().notices_of_layer();
        notices.extend(plan.conversion.notices());
        notices.extend(plan.filter.nodata.map(Notice::NodataLeftOut));
        LayerReport { path: self.path.clone(), layer: self.layer.clone(), filter: plan.filter, notices }
    }

    /// What becomes of its rows in a texture of that shape.
    pub(crate) fn plan(&self, geometry: &Geometry, options: &BuildOptions) -> Result<LayerPlan, BuildError> {
        let (header, format) = (self.reader.header(), self.layer.format);
        let filter = self.filter(options)?;
        let conversion =
            Conversion::new(header, format, self.is_color).ok_or_else(|| BuildError::Format {
                path: self.path.clone(),
                image: header.format.to_string(),
                format: format.name(),
                possible: possible_formats(header.format)
                    .map(LayerFormat::name)
                    .collect::<Vec<_>>()
                    .join(", "),
            })?;
        Ok(LayerPlan {
            geometry: geometry.of_layer(self.layer.scale),
            layer: self.layer.clone(),
            conversion,
            filter,
            border_color: options.border_color,
        })
    }
}

/// What is known of the texels of a texture of that size, as its container keeps it: what the first of the
/// files says that say something and have its resolution.
pub(crate) fn about(layers: &[OpenLayer], [width, height, _]: [u32; 3]) -> String {
    let whole = layers.iter().filter(|layer| layer.layer.scale == 1);
    let mut said = whole.map(|layer| TiffAbout::kept_of_file(&layer.path, [width, height]));
    said.find(|said| !said.is_empty()).unwrap_or_default()
}

/// Bytes that the readers of all layers hold besides, where so many pieces of each image are decoded ahead.
pub(crate) fn memory_ahead(layers: &[OpenLayer], pieces: usize) -> u64 {
    layers.iter().fold(0, |sum: u64, layer| sum.saturating_add(layer.reader.memory_ahead(pieces)))
}

/// Opens all images and finds each layer's share of the resolution. At least one input.
pub(crate) fn open_all(
    inputs: Vec<LayerInput>,
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Vec<OpenLayer>, BuildError> {
    let open = |input| OpenLayer::open(input, output, options, progress);
    let layers: Result<Vec<_>, _> = inputs.into_iter().map(open).collect();
    let layers = layers?;
    let texels = |layer: &OpenLayer| layer.size().map(u64::from).iter().product::<u64>();
    // Among equals the first.
    let Some(largest) = layers.iter().rev().max_by_key(|layer| texels(layer)) else { return Ok(layers) };
    let whole = largest.size();
    let fit = |mut layer: OpenLayer| {
        let size = layer.size();
        let sizes = [1, 2, 4].map(|scale| (scale, whole.map(|n| n.div_ceil(scale))));
        let distance = |to: [u32; 2]| -> f64 {
            (0..2).map(|axis| (f64::from(to[axis]) / f64::from(size[axis])).ln().abs()).sum()
        };
        // Among those that are as near the finest.
        let nearest = sizes.into_iter().min_by(|(_, a), (_, b)| distance(*a).total_cmp(&distance(*b)));
        if let Some((scale, to)) = nearest {
            layer.layer.scale = scale;
            if to != size {
                let wraps = options.address[0] == AddressMode::Wrap || layer.reader.header().wraps;
                let blend = layer.blend(options)?;
                layer.reader = Box::new(Scaled::new(layer.reader, to, scale, blend, wraps));
            }
        }
        Ok(layer)
    };
    layers.into_iter().map(fit).collect()
}

/// The texture that the layers make.
pub(crate) fn describe(layers: &[OpenLayer], options: &BuildOptions) -> Result<Description, BuildError> {
    let mut size = [1; 2];
    for layer in layers {
        size = [0, 1].map(|axis| size[axis].max(layer.size()[axis]));
    }
    let [x, y] = options.address;
    let wraps = layers.iter().any(|layer| layer.reader.header().wraps);
    let x = if wraps && x == AddressMode::Clamp { AddressMode::Wrap } else { x };
    let filters: Vec<LayerFilter> =
        layers.iter().map(|layer| layer.filter(options)).collect::<Result<_, _>>()?;
    let described = |(layer, filter): (&OpenLayer, &LayerFilter)| Layer {
        is_mixable: filter.kernel.may_mix(),
        nodata: filter.nodata,
        ..layer.layer.clone()
    };
    let layers: Vec<_> = layers.iter().zip(&filters).map(described).collect();
    let geometry = Geometry::new(GeometrySpec {
        dims: Dims::D2,
        size: [size[0], size[1], 1],
        page: options.page,
        border: options.border,
        address: [x, y, AddressMode::Clamp],
        positions: LayerFilter::common_positions(&filters)?,
        tail_align: Description::tail_align(&layers),
    })?;
    let description =
        Description { border_color: options.border_color, ..Description::new(geometry, layers) };
    description.check().map_err(|error| {
        let unit = description.layers.iter().map(|layer| layer.scale * layer.format.block_side()).max();
        BuildError::layers(error, options.page, options.border, unit.unwrap_or(1))
    })?;
    Ok(description)
}

/// What the parts of a build, or a build and the one that it resumes, must have in common besides the
/// description.
pub(crate) struct Same {
    /// What decides the bytes, wherever the inputs lie: for parts, which may come from several machines.
    pub(crate) anywhere: String,
    /// What decides the bytes of a build of these very files, which nobody has changed.
    pub(crate) here: String,
    /// What identifies these very files, whatever is made of them.
    pub(crate) input: String,
}

/// Returns the fingerprints of all that a build reads, the mask and the insets included, with the program's
/// version and the options that change what is made of it. Reads a sample of each file; fails if one cannot
/// be read.
pub(crate) fn fingerprint(
    layers: &[OpenLayer],
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Same, BuildError> {
    let go_on = || progress.opening();
    let of_input = |path: &Path, files: &[PathBuf]| {
        let failed = |error: std::io::Error| BuildError::Input { path: path.into(), fault: error.into() };
        fingerprint::input_fingerprint(files, &go_on).map_err(failed)?.ok_or(BuildError::Cancelled)
    };
    let of_others = options.mask.iter().chain(options.insets.iter().map(|inset| &inset.image));
    let mut inputs = Vec::with_capacity(layers.len());
    for layer in layers {
        inputs.push(of_input(&layer.path, &layer.files)?);
    }
    for path in of_others {
        let opened = open_with_files_while(path, &go_on).map_err(|fault| BuildError::input(path, fault))?;
        inputs.push(of_input(path, &opened.files)?);
    }
    let contents: Vec<u64> = inputs.iter().map(|input| input.contents).collect();
    let times: Vec<u64> = inputs.iter().map(|input| input.times).collect();
    let BuildOptions { compression, quality, drop_transparent, tolerant, .. } = options;
    let masked = options.mask.is_some();
    let version = env!("CARGO_PKG_VERSION");
    let bands: Vec<_> =
        layers.iter().map(|layer| bands_in_path(&layer.path).map(|(_, bands)| bands)).collect();
    let what = (version, &contents, bands, compression, quality, masked, drop_transparent, tolerant);
    let anywhere = format!("{what:?}");
    let (here, input) = (format!("{anywhere} {times:?}"), format!("{contents:?} {times:?}"));
    Ok(Same { anywhere, here, input })
}
