//! The step that runs a part of the GPU tests on a second driver: SwiftShader, which comes with Chromium.
//!
//! All other tests run on whatever adapter the machine has, in CI Mesa's software driver. What is drawn right
//! by one driver alone may be so by its good will; SwiftShader is strict where Mesa is not, and has few bind
//! groups and small textures. Where it is not to be had the step is skipped, loudly; where CI runs it fails.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::outcome::{Outcome, cargo_test};
use crate::{setup, shaders, shell};

/// What the adapter's name has, and no other's.
const NAME: &str = "SwiftShader";
/// Tells tests the name that their adapter must have.
const ADAPTER: &str = "WGPU_ADAPTER_NAME";
/// The test that prints the adapter's name.
const NAMING: &str = "device::the_adapter_is_the_one_that_is_asked_for";
/// Where distributions put Chromium's libraries.
const PLACES: &[&str] =
    &["/usr/lib/chromium", "/usr/lib64/chromium-browser", "/opt/google/chrome", "/usr/lib/chromium-browser"];
const LIBRARY: &str = "libvk_swiftshader.so";

/// What is run: a fixed sample that takes a minute of a processor, most of it to compile shaders. Each must
/// exist, and pass.
const SAMPLE: &[&str] = &[
    NAMING,
    // Values: every filter and every format of texels, levels, seams, fixed point, sixteen bits, places.
    // SwiftShader reads compressed blocks wrongly in compute shaders (ARCHITECTURE.md, "Drivers").
    "sampling::every_format_of_texels_agrees_with_its_twin",
    "sampling::the_levels_of_a_texture_may_be_clamped_and_biased",
    "seams::where_uv_jumps_there_is_no_seam",
    "fixed::places_fold_as_the_twin_folds_them_up_to_the_largest_texture",
    "exact::sixteen_bits_come_back_exact_where_the_device_filters_them",
    "inspect::places_are_what_the_page_table_says",
    "property::every_pixel_shows_its_texel_where_edges_mirror",
    // Page tables of both kinds, as they change, grow and lie in textures.
    "pool_tables::tables_of_many_textures_follow_whatever_comes_and_goes",
    "pool_tables::what_a_table_leaves_midway_is_as_good_as_new",
    "pool_tables::levels_are_sent_by_and_by_where_the_gpu_cannot_fill_them",
    "pool_tables::one_hash_table_follows_all_textures_of_its_pool",
    "pool_tables_wgsl::shaders_find_every_page_of_every_texture_of_a_pool",
    "params::records_are_what_was_set_wherever_they_lie",
    "page_tables::pictures_are_the_same_through_either_kind_in_every_frame",
    "pools::page_tables_grow_when_the_view_comes_near",
    // Feedback in every mode, of groups and in texture space.
    "feedback::compaction_agrees_with_that_on_the_cpu",
    "modes::the_nearest_surface_is_heard_in_whatever_order_they_are_drawn",
    "modes::of_more_surfaces_than_a_cell_has_room_for_those_drawn_first_are_heard",
    "groups::feedback_of_a_group_names_pages_of_every_level_of_its_shape",
    "texture_space::levels_come_back_and_the_sharpest_of_what_overlaps_stays",
    "dropped::whatever_is_dropped_of_inline_feedback_the_picture_comes_right",
    "dropped::whatever_is_dropped_of_raw_feedback_the_picture_comes_right",
    // Fading, groups, uploads, resizing, explaining.
    "fade::a_pool_that_takes_the_place_of_another_goes_on_where_that_was",
    "fade::either_kind_of_page_table_fades_alike",
    "mixing::in_a_group_each_member_has_its_own_filter",
    "belt::rooms_come_back_and_no_more_are_made_than_are_filled_at_once",
    "uploads::by_default_tiles_go_by_the_belt_in_real_time_and_through_the_queue_in_lock_step",
    "uploads::a_belt_without_room_keeps_nothing_from_the_screen",
    "pools::tile_sizes_and_formats_live_side_by_side",
    "resize::a_pool_that_still_holds_the_view_shows_the_same_picture",
    "resize::a_pool_that_is_too_small_becomes_coarser_and_sharpens_when_it_grows",
    "explain::a_pixel_wants_what_it_wants_in_a_view_of_the_whole_picture",
    // Volumes: slices, light of several channels, labels. Lists of layers, and a planet with heights.
    "volumes::slices_are_the_voxels",
    "volumes::three_channels_add_their_light",
    "labels::slices_have_the_labels_of_their_voxels",
    "shown_layers::layers_are_drawn_in_their_order",
    "lit_planet::a_planet_without_sun_and_air_is_the_globe",
    // Whole scenes beside ordinary textures.
    "matrix::pictures_by_chance_equal_those_of_an_ordinary_texture",
];
/// Of the pictures by chance so many.
const PICTURES: [&str; 2] = ["VASTEX_PICTURES", "3"];

pub(crate) fn check() -> Result<Outcome> {
    let Some(library) = find()? else {
        println!("\n!!!! SKIPPED: there is no {LIBRARY}, so nothing says what a second driver draws !!!!\n");
        return Ok(Outcome::Skipped(format!("no {NAME}")));
    };
    let manifest = write_manifest(&library)?;
    let mut command = cargo_test();
    command.args([
        "--workspace",
        "--no-fail-fast",
        "--test",
        "gpu",
        "--test",
        "suite",
        "--test",
        "scenes",
        "--",
    ]);
    command.args(["--exact", "--show-output"]).args(SAMPLE);
    command.env("VK_DRIVER_FILES", &manifest).env("VK_ICD_FILENAMES", &manifest);
    command.env(ADAPTER, NAME).env(PICTURES[0], PICTURES[1]).env(shaders::LOG, shaders::handed_over());
    let told = shell::output_shown(&mut command, std::io::stdout())?;
    let adapter = told.lines().find_map(|line| line.strip_prefix("adapter: "));
    let adapter = adapter.context("no test has said which adapter it had")?;
    let missing = missing(&told);
    if !missing.is_empty() {
        bail!(
            "these tests of the sample were not run, perhaps since they have other names: {}",
            missing.join(", ")
        );
    }
    println!("{} tests passed on {adapter}", SAMPLE.len());
    Ok(Outcome::Passed)
}

/// The driver's library, with Chromium installed where it is missing; `None` if it cannot be had.
fn find() -> Result<Option<PathBuf>> {
    if let Some(library) = library() {
        return Ok(Some(library));
    }
    let installed = setup::ensure(&setup::BROWSER);
    let found = library();
    if found.is_none() && shell::is_ci() {
        installed?;
        bail!("Chromium is there and {LIBRARY} is not where it is looked for: {}", PLACES.join(", "));
    }
    Ok(found)
}

fn library() -> Option<PathBuf> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    PLACES.iter().map(|place| Path::new(place).join(LIBRARY)).find(|library| library.is_file())
}

/// What leads the Vulkan loader to the library.
fn write_manifest(library: &Path) -> Result<PathBuf> {
    let path = shell::target_dir().join("swiftshader.json");
    let library = library.to_str().context("the path of the library is not text")?;
    let text = format!(
        "{{\"file_format_version\": \"1.0.0\", \"ICD\": {{\"library_path\": {library:?}, \"api_version\": \"1.1.0\"}}}}\n"
    );
    std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path)
}

/// Those of the sample that a run of tests says nothing of.
fn missing(told: &str) -> Vec<&'static str> {
    let is_told = |name: &str| told.lines().any(|line| line == format!("test {name} ... ok"));
    SAMPLE.iter().copied().filter(|name| !is_told(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_that_did_not_run_is_missed() {
        let told: String = SAMPLE.iter().map(|name| format!("test {name} ... ok\n")).collect();
        assert!(missing(&told).is_empty());
        assert_eq!(missing(&told.replace(NAMING, "device::another")), [NAMING]);
    }
}
