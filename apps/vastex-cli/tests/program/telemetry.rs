//! `render --stats-csv`, `--stats-json` and `--dump-pools`: their names, and that their sums are those of the
//! summary.

use std::collections::HashMap;

use serde_json::Value;

use crate::tool::{Ended, Sandbox};

const RENDER: &str = "render image.vastex --size 320x180 --on plane --camera-path fly --frames 40 --json";

fn render(sandbox: &Sandbox, more: &str) -> Ended {
    let args: Vec<&str> = RENDER.split(' ').chain(more.split(' ').filter(|word| !word.is_empty())).collect();
    sandbox.run(&args).expect_code(0)
}

/// A pool of fewer slots than the view wants pages.
fn small_pool(sandbox: &Sandbox) {
    sandbox.write("small.toml", b"[default_pool]\nsize_mib = 0.17\n");
}

/// The rows of a CSV file, by the names of its header.
fn rows(sandbox: &Sandbox, name: &str) -> Vec<HashMap<String, String>> {
    let text = String::from_utf8(sandbox.read(name)).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first = ["frame", "pool", "slots", "occupied", "locked", "wanted", "bias", "uploads", "evictions"];
    assert_eq!(names[..9], first);
    assert_eq!(names[9..11], ["reloads", "failures"]);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), names.len(), "{line}");
        names.iter().zip(cells).map(|(name, cell)| ((*name).to_owned(), cell.to_owned())).collect()
    };
    lines.map(row).collect()
}

fn count(row: &HashMap<String, String>, name: &str) -> u64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name} is {:?}", row[name]))
}

#[test]
fn the_lines_add_up_to_the_summary() {
    let sandbox = Sandbox::with_container();
    small_pool(&sandbox);
    let json = render(&sandbox, "--settings small.toml --stats-csv fly.csv").json();
    let rows = rows(&sandbox, "fly.csv");
    assert_eq!(rows.len(), 40, "one pool, a line for each frame");
    assert!((0..).zip(&rows).all(|(frame, row)| count(row, "frame") == frame && count(row, "pool") == 0));
    let sum = |name: &str| rows.iter().map(|row| count(row, name)).sum::<u64>();
    for (column, key) in
        [("uploads", "tiles_loaded"), ("evictions", "tiles_evicted"), ("reloads", "tiles_reloaded")]
    {
        assert_eq!(sum(column), json[key].as_u64().unwrap(), "{column}");
    }
    let last = rows.last().unwrap();
    for (column, key) in [
        ("slots", "pool_slots"),
        ("occupied", "pool_occupied"),
        ("resident", "pages_resident"),
        ("wanted", "pages_wanted"),
    ] {
        assert_eq!(count(last, column), json[key].as_u64().unwrap(), "{column}");
    }
    assert_eq!(last["bias"].parse::<f64>().ok(), json["mip_bias"].as_f64());
    assert!(sum("uploads") > 0 && sum("ram_misses") > 0, "{last:?}");
    for row in &rows {
        assert!(
            count(row, "locked") <= count(row, "occupied") && count(row, "occupied") <= count(row, "slots")
        );
        let share = row["share_at_wanted"].parse::<f64>().ok();
        assert!(share.is_none_or(|share| (0.0..=1.0).contains(&share)), "{row:?}");
        assert_eq!(share.is_none(), count(row, "frame") < 2, "nothing has come back before: {row:?}");
    }
    assert_eq!((&*rows[0]["feedback_age"], &*rows[0]["sharp_p95"]), ("", ""));
    assert_eq!((&*last["feedback_age"], &*last["sharp_p50"]), ("2", "1"));
}

#[test]
fn json_has_what_csv_has() {
    let sandbox = Sandbox::with_container();
    render(&sandbox, "--stats-csv fly.csv --stats-json fly.json");
    let objects: Vec<Value> = serde_json::from_slice(&sandbox.read("fly.json")).unwrap();
    let rows = rows(&sandbox, "fly.csv");
    assert_eq!(objects.len(), rows.len());
    for (object, row) in objects.iter().zip(&rows) {
        let object = object.as_object().unwrap();
        assert_eq!(object.len(), row.len());
        for (name, value) in object {
            let cell =
                if row[name].is_empty() { Value::Null } else { serde_json::from_str(&row[name]).unwrap() };
            assert_eq!(value.as_f64(), cell.as_f64(), "{name}");
        }
    }
    assert_eq!(
        sandbox.names(),
        ["fly.csv", "fly.json", "image.png", "image.vastex"],
        "nothing else is left behind"
    );
}

#[test]
fn the_dump_says_whose_the_slots_are() {
    let sandbox = Sandbox::with_container();
    small_pool(&sandbox);
    let json = render(&sandbox, "--settings small.toml --dump-pools").json();
    let pool = &json["pools"][0];
    let number = |value: &Value| value.as_u64().unwrap_or_else(|| panic!("{value}"));
    let sum =
        |values: &Value| values.as_array().unwrap().iter().map(|value| number(&value["pages"])).sum::<u64>();
    assert_eq!(number(&pool["pages"]), sum(&pool["textures"]));
    assert_eq!((number(&pool["pages"]), number(&pool["locked"])), (number(&json["pages_resident"]), 1));
    assert_eq!((&pool["slots"], pool["bias"].as_f64()), (&json["pool_slots"], json["mip_bias"].as_f64()));
    let texture = &pool["textures"][0];
    assert_eq!(number(&texture["pages"]), sum(&texture["levels"]));
    assert_eq!((&texture["name"], &texture["finest"]), (&"image.vastex".into(), &0.into()));
    let text = RENDER.replace(" --json", " --dump-pools");
    let text = sandbox.run(&text.split(' ').collect::<Vec<_>>()).expect_code(0).stdout;
    for words in
        ["pool 0, tiles of 72x72 texels of rgba8-srgb: ", "pages of texture 0 (image.vastex): ", "of level 0"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(render(&sandbox, "").json().get("pools").is_none());
}

#[test]
fn places_that_cannot_be_are_refused_before_anything_is_drawn() {
    let sandbox = Sandbox::with_container();
    let before = sandbox.read("image.vastex");
    let refused = |more: &str, says: &str| {
        let args: Vec<&str> = RENDER.split(' ').chain(more.split(' ')).collect();
        let ended = sandbox.run(&args).expect_code(1);
        assert!(ended.stderr.contains(says) && ended.stdout.is_empty(), "{ended}");
    };
    refused("--stats-csv image.vastex", "choose another name");
    refused("--stats-csv a.csv --stats-json a.csv", "the CSV file and the JSON file would be one file");
    refused("--stats-csv .", "add a file name");
    refused("--stats-json nowhere/a.json", "nowhere/a.json: cannot be written");
    assert_eq!((sandbox.read("image.vastex"), sandbox.names().len()), (before, 2));
}
