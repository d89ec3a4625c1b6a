//! `learn` and `render --prefetch-sets`.

use crate::tool::Sandbox;

const RENDER: &str =
    "render image.vastex --on plane --size 320x180 --camera-path teleport --latency-frames 3 --json";

/// A sandbox with a trace and what was learnt of it.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::with_container();
    sandbox
        .run(&format!("{RENDER} --record-trace tour.vxtrace").split(' ').collect::<Vec<_>>())
        .expect_code(0);
    let ended = sandbox.run(&["learn", "tour.vxtrace", "-o", "tour.vxsets", "--json"]).expect_code(0);
    let json = ended.json();
    assert!(json["cells"].as_u64() > Some(2) && json["pages"].as_u64() > json["cells"].as_u64(), "{json}");
    assert_eq!(json["bytes"].as_u64(), Some(sandbox.read("tour.vxsets").len() as u64));
    sandbox
}

#[test]
fn what_was_learnt_is_loaded_ahead() {
    let sandbox = sandbox();
    let render = |more: &str| {
        sandbox.run(&format!("{RENDER}{more}").split(' ').collect::<Vec<_>>()).expect_code(0).json()
    };
    let (without, with) = (render(""), render(" --prefetch-sets tour.vxsets --stats-csv stats.csv"));
    assert_eq!(without["pages_wanted"], with["pages_wanted"], "what is only expected is not wanted");
    assert_eq!((&with["converged"], &with["share_at_wanted_level"]), (&true.into(), &1.0.into()));
    let text =
        sandbox.run(&["learn", "tour.vxtrace", "tour.vxtrace", "--cell", "0.5,0.5,0", "-o", "two.vxsets"]);
    let text = text.expect_code(0).stdout;
    assert!(text.contains("0.5 x 0.5 x 0"), "{text}");
}

#[test]
fn nonsense_is_refused_with_a_reason() {
    let sandbox = sandbox();
    let refused = |command: &str, code, says: &str| {
        let ended = sandbox.run(&command.split(' ').collect::<Vec<_>>()).expect_code(code);
        assert!(ended.stderr.contains(says), "{ended}");
    };
    refused("learn -o x.vxsets", 2, "required");
    refused("learn tour.vxtrace -o x.vxsets --cell 1,2", 2, "three numbers");
    refused("learn none.vxtrace -o x.vxsets", 1, "none.vxtrace: it cannot be read");
    refused("learn tour.vxsets -o x.vxsets", 1, "not a trace");
    refused("learn tour.vxtrace -o tour.vxtrace", 1, "choose another name");
    refused(&format!("{RENDER} --prefetch-sets tour.vxtrace"), 1, "not prefetch sets");
    sandbox.write_png("other.png", [100, 100]);
    sandbox.run(&["build", "other.png", "-o", "other.vastex", "--page", "64", "--quiet"]).expect_code(0);
    refused("render other.vastex --prefetch-sets tour.vxsets", 1, "another shape");
    let mut bytes = sandbox.read("tour.vxsets");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    sandbox.write("damaged.vxsets", &bytes);
    refused(
        &format!("{RENDER} --prefetch-sets damaged.vxsets"),
        1,
        "damaged.vxsets: the prefetch sets are damaged",
    );
}
