//! `render --record-trace` and `replay`.

use crate::tool::Sandbox;

/// A sandbox with a trace of a path that moves.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::with_container();
    let record =
        "render image.vastex --size 160x90 --camera-path spin --frames 60 --record-trace spin.vxtrace";
    sandbox.run(&record.split(' ').collect::<Vec<_>>()).expect_code(0);
    sandbox
}

#[test]
fn a_recorded_trace_is_replayed_under_every_policy() {
    let sandbox = sandbox();
    let names = sandbox.names();
    assert_eq!(names, ["image.png", "image.vastex", "spin.vxtrace"], "nothing else is left behind");
    for policy in ["lru", "clock", "s3fifo", "lru-level", "vastex"] {
        let ended =
            sandbox.run(&["replay", "spin.vxtrace", "--pool-share", "1.1", "--policy", policy, "--json"]);
        let json = ended.expect_code(0).json();
        let count = |key: &str| json[key].as_u64().unwrap_or_else(|| panic!("{key} in {json}"));
        assert_eq!(
            (json["policy"].as_str(), count("frames")),
            (Some(policy), 58),
            "two are under way at the end"
        );
        assert!(count("loads") >= count("loads_optimum") && count("loads_optimum") > 0);
        assert!(count("pool_tiles") >= count("working_set_max") && count("evictions") <= count("loads"));
        assert_eq!(count("loads") - count("reloads") + 1, count("pages"), "all but the tail is loaded");
        assert!(json.get("frames_to_full").is_none());
    }
    let timed =
        sandbox.run(&["replay", "spin.vxtrace", "--latency-frames", "2", "--tiles-per-frame", "1", "--json"]);
    let json = timed.expect_code(0).json();
    assert!(json["frames_to_full"].as_u64() >= json["frames_to_full_bound"].as_u64(), "{json}");
    assert!(json["missing_level_frames"].as_f64().unwrap() > 0.0);
    let text = sandbox.run(&["replay", "spin.vxtrace", "--pool-tiles", "500"]).expect_code(0).stdout;
    assert!(text.contains("a pool of 500 tiles") && text.contains("0 reloads"), "{text}");
}

#[test]
fn the_same_run_records_the_same_bytes() {
    let (one, other) = (sandbox(), sandbox());
    assert_eq!(one.read("spin.vxtrace"), other.read("spin.vxtrace"));
}

#[test]
fn nonsense_is_refused_with_a_reason() {
    let sandbox = sandbox();
    let refused = |args: &[&str], code, says: &str| {
        let ended = sandbox.run(&[&["replay"], args].concat()).expect_code(code);
        assert!(ended.stderr.contains(says), "{ended}");
        assert!(ended.stdout.is_empty(), "{ended}");
    };
    refused(&["spin.vxtrace", "--pool-share", "0.9"], 2, "below the largest frame's set");
    refused(&["spin.vxtrace", "--policy", "belady"], 2, "vastex");
    refused(&["spin.vxtrace", "--tiles-per-frame", "0"], 2, "unlimited");
    refused(&["spin.vxtrace", "--pool-tiles", "9", "--pool-share", "2"], 2, "cannot be used with");
    refused(&["spin.vxtrace", "--pool-tiles", "1"], 1, "below the largest frame's set");
    refused(&["none.vxtrace"], 1, "none.vxtrace: it cannot be read");
    refused(&["."], 1, "it cannot be read");
    refused(&["image.png"], 1, "image.png: not a trace");
    let mut bytes = sandbox.read("spin.vxtrace");
    let middle = bytes.len() / 2;
    sandbox.write("cut.vxtrace", &bytes[..middle]);
    refused(&["cut.vxtrace"], 1, "damaged");
    bytes[middle] ^= 1;
    sandbox.write("damaged.vxtrace", &bytes);
    refused(&["damaged.vxtrace"], 1, "checksum");
}

#[test]
fn a_trace_takes_no_other_files_place() {
    let sandbox = Sandbox::with_container();
    let before = sandbox.read("image.vastex");
    let ended = sandbox.run(&["render", "image.vastex", "--frames", "1", "--record-trace", "image.vastex"]);
    assert!(ended.expect_code(1).stderr.contains("choose another name"));
    let ended =
        sandbox.run(&["render", "image.vastex", "--frames", "1", "-o", "x.png", "--record-trace", "x.png"]);
    assert!(ended.expect_code(1).stderr.contains("would be one file"));
    assert_eq!((sandbox.read("image.vastex"), sandbox.names().len()), (before, 2));
}
