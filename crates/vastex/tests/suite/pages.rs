//! What README.md and the pages in docs/ show of Rust compiles: each of their snippets is quoted from here,
//! and a test holds them equal.
//!
//! A region begins with `//# PAGE` and ends with `//#`. White space, comments and commas in front of a
//! bracket are each place's own, so that a page may be laid out for reading.

#![allow(
    dead_code,
    unused_variables,
    unused_mut,
    clippy::needless_pass_by_value,
    clippy::let_unit_value,
    reason = "it is compiled, to be read elsewhere"
)]

use std::future::Future;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use vastex::{BindGroups, Error, Prepared, TextureId, Textures, TileSource, ViewId};

const MY_SHADER: &str = "";

fn draw_scene<'g>(
    _: &mut wgpu::RenderPass<'_>,
    _: &wgpu::RenderPipeline,
    _: impl Into<Option<&'g wgpu::BindGroup>>,
) {
}

fn spawn<T>(_: impl Future<Output = T> + Send) {}

/// An application's scene, drawn with the bind groups of all textures.
struct Scene;

impl Scene {
    fn draw_wanted(&self, _: &mut wgpu::RenderPass<'_>, _: &BindGroups) {}
    fn draw(&self, _: &mut wgpu::CommandEncoder, _: &BindGroups) {}
}

/// The same of one texture.
struct SceneOfOne;

impl SceneOfOne {
    fn draw_wanted(&self, _: &mut wgpu::RenderPass<'_>, _: Option<&wgpu::BindGroup>) {}
    fn draw(&self, _: &mut wgpu::CommandEncoder, _: Option<&wgpu::BindGroup>) {}
}

fn readme(
    (device, queue): (wgpu::Device, wgpu::Queue),
    mut encoder: wgpu::CommandEncoder,
    [feedback_pipeline, pipeline]: [wgpu::RenderPipeline; 2],
    mut main_pass: wgpu::RenderPass<'_>,
    [width, height]: [u32; 2],
) -> Result<(), Error> {
    //# README.md
    let mut textures = vastex::Textures::new(&device, &queue, vastex::Settings::default())?;
    let earth = textures.add_blocking(vastex::open("earth.vastex")?)?;

    let kinds = textures.kinds(earth)?;
    let shader = MY_SHADER.to_owned() + &textures.wgsl(&kinds);
    let layout = textures.bind_group_layout(&kinds);
    let id = textures.shader_id(earth)?;

    textures.feedback(&mut encoder, [width, height], |pass, groups| {
        draw_scene(pass, &feedback_pipeline, groups.get(earth));
    })?;
    textures.update()?;
    draw_scene(&mut main_pass, &pipeline, textures.bind_group(earth)?);
    queue.submit([encoder.finish()]);
    while let Some(event) = textures.poll_event() {}
    //#
    Ok(())
}

fn readme_pixels(mut textures: Textures, pixels: Vec<u8>) -> anyhow::Result<()> {
    //# README.md
    let scan = textures.add_blocking(Arc::new(vastex::ImageSource::rgba8(100_000, 40_000, pixels)?))?;
    //#
    Ok(())
}

fn readme_prepared(
    mut textures: Textures,
    source: Arc<dyn TileSource>,
    prepared: Prepared,
) -> Result<(), Error> {
    //# README.md
    let preparer = textures.preparer();
    let loading = spawn(async move { preparer.read(source).await });
    let clouds = textures.add(prepared)?;
    //#
    Ok(())
}

fn readme_sampled(textures: &Textures, island: TextureId, uv: [f32; 2]) -> anyhow::Result<()> {
    let missing = || anyhow::anyhow!("it has none");
    //# README.md
    let height = textures.texture(island)?.layer("height").ok_or_else(missing)?;
    let ground = textures.cpu().sample(height, uv, 0.0);
    //#
    Ok(())
}

fn readme_group(mut textures: Textures, [earth, lights, clouds]: [TextureId; 3]) -> Result<(), Error> {
    //# README.md
    let planet = textures.add_group([("color", earth), ("night", lights), ("clouds", clouds)])?;
    let kinds = textures.kinds(planet)?;
    let shader = MY_SHADER.to_owned() + &textures.wgsl(&kinds);
    let ids = textures.bindings().ids(planet)?;
    //#
    Ok(())
}

fn frame(
    mut textures: Textures,
    mut encoder: wgpu::CommandEncoder,
    queue: wgpu::Queue,
    scene: Scene,
    [width, height]: [u32; 2],
) -> Result<(), Error> {
    //# docs/in-your-engine.md
    textures.feedback(&mut encoder, [width, height], |pass, groups| scene.draw_wanted(pass, groups))?;
    textures.update()?;
    textures.main_pass(&mut encoder, [width, height], |encoder, groups| scene.draw(encoder, groups))?;
    queue.submit([encoder.finish()]);
    //#
    Ok(())
}

fn pass_of_the_host(
    mut textures: Textures,
    mut encoder: wgpu::CommandEncoder,
    [width, height]: [u32; 2],
) -> Result<(), Error> {
    //# docs/in-your-engine.md
    if let Some(begun) = textures.view_mut(ViewId::MAIN)?.begin_feedback(&mut encoder, [width, height])? {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(begun.color_attachment())],
            depth_stencil_attachment: Some(begun.depth_attachment()),
            ..Default::default()
        });
        let [x, y, w, h] = begun.scissor();
        pass.set_scissor_rect(x, y, w, h);
        drop(pass);
        textures.view_mut(ViewId::MAIN)?.end_feedback(&mut encoder)?;
    }
    //#
    Ok(())
}

fn on_another_thread(mut textures: Textures) -> Result<Option<TextureId>, Error> {
    let mut clouds = None;
    //# docs/in-your-engine.md
    let (preparer, (done, arrived)) = (textures.preparer(), std::sync::mpsc::channel());
    let source = vastex::open("clouds.vastex")?;
    std::thread::spawn(move || done.send(pollster::block_on(preparer.read(source))));
    if let Ok(read) = arrived.try_recv() {
        clouds = Some(textures.add(read?)?);
    }
    //#
    Ok(clouds)
}

fn every_mode_of_feedback(
    mut textures: Textures,
    mut encoder: wgpu::CommandEncoder,
    (scene, earth): (SceneOfOne, TextureId),
    size: [u32; 2],
) -> Result<(), Error> {
    //# docs/feedback.md
    textures.feedback(&mut encoder, size, |pass, groups| scene.draw_wanted(pass, groups.get(earth)))?;
    textures.update()?;
    textures.main_pass(&mut encoder, size, |encoder, groups| scene.draw(encoder, groups.get(earth)))?;
    //#
    Ok(())
}

fn fading(mut textures: Textures, delta_time: Duration) {
    //# docs/fading.md
    let settings = vastex::Settings { fade: Duration::from_millis(150), ..Default::default() };
    textures.set_frame_time(delta_time);
    //#
}

fn one_limit(mut textures: Textures, paths: Vec<PathBuf>) -> Result<(), Error> {
    //# docs/settings.md
    let limit = vastex::source::ReadLimit::new(16);
    for path in paths {
        textures
            .add_blocking(Arc::new(vastex::source::LimitedSource::new(vastex::open(path)?, limit.clone())))?;
    }
    //#
    Ok(())
}

fn disk_cache(mut textures: Textures, directory: PathBuf) -> anyhow::Result<()> {
    //# docs/disk-cache.md
    let tier = Arc::new(vastex::source::DiskTier::open(directory, 4 << 30)?);
    let source = vastex::open("/net/archive/earth.vastex")?;
    let key = source.identity().unwrap_or(vastex::source::SourceKey::of("earth, 2nd edition"));
    let earth = textures.add_blocking(Arc::new(vastex::source::DiskCache::new(source, tier.clone(), key)))?;
    //#
    Ok(())
}

/// The regions of this file for a page, in order.
fn regions(page: &str) -> Vec<String> {
    let begin = format!("    //# {page}\n");
    let parts = include_str!("pages.rs").split(&begin).skip(1);
    parts.filter_map(|part| Some(plain(part.split_once("    //#\n")?.0))).collect()
}

/// The snippets of Rust on a page, in order.
fn snippets(text: &str) -> Vec<String> {
    let parts = text.split("\n```rust").skip(1);
    parts.filter_map(|part| Some(plain(part.split_once('\n')?.1.split_once("\n```")?.0))).collect()
}

/// Code without comments, white space and commas in front of brackets.
fn plain(code: &str) -> String {
    let without_blocks = |line: &str| match (line.find("/*"), line.find("*/")) {
        (Some(begin), Some(end)) if begin < end => format!("{}{}", &line[..begin], &line[end + 2..]),
        _ => line.to_owned(),
    };
    // No string here has two slashes in it but in front of a host's name.
    let lines = code.lines().map(|line| without_blocks(line.split(" //").next().unwrap_or_default()));
    let code: String = lines.filter(|line| !line.starts_with("//")).collect();
    let code: String = code.split_whitespace().collect();
    [")", "]", "}"].iter().fold(code, |code, bracket| code.replace(&format!(",{bracket}"), bracket))
}

#[test]
fn what_the_pages_show_is_what_is_compiled_here() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let docs = std::fs::read_dir(root.join("docs")).unwrap();
    let names = docs.map(|entry| format!("docs/{}", entry.unwrap().file_name().to_string_lossy()));
    let pages = names.filter(|name| name.ends_with(".md")).chain(["README.md".to_owned()]);
    let mut shown = 0;
    for page in pages {
        let text = std::fs::read_to_string(root.join(&page)).unwrap();
        let (snippets, regions) = (snippets(&text), regions(&page));
        assert_eq!(
            snippets.len(),
            regions.len(),
            "{page} has other snippets than are compiled in {}",
            file!()
        );
        for (snippet, region) in snippets.iter().zip(&regions) {
            assert_eq!(snippet, region, "{page} says other than what is compiled in {}", file!());
        }
        shown += snippets.len();
    }
    assert!(shown > 9, "{shown} snippets");
}
