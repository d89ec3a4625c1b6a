//! `render --estimate`: a picture without a feedback pass, or beside one.

use serde_json::Value;

use crate::tool::Sandbox;

fn summary(sandbox: &Sandbox, more: &str) -> Value {
    let command = format!("render image.vastex --size 320x180 --on plane --camera-path fly --json {more}");
    let ended = sandbox.run(&command.split_whitespace().collect::<Vec<_>>()).expect_code(0);
    serde_json::from_str(&ended.stdout).unwrap()
}

#[test]
fn every_estimate_feeds_the_pager_alone_and_beside_feedback() {
    let sandbox = Sandbox::with_container();
    let fed = summary(&sandbox, "-o fed.png");
    for estimate in ["distance", "quadtree", "texture-space"] {
        let alone = summary(&sandbox, &format!("--estimate {estimate} -o {estimate}.png"));
        assert_eq!((&alone["converged"], &alone["feedback_bytes_read"]), (&true.into(), &0.into()));
        assert_eq!(alone["share_at_wanted_level"], 1.0);
        assert!(
            sandbox.read(&format!("{estimate}.png")) == sandbox.read("fed.png"),
            "{estimate}: another picture"
        );
        let beside = summary(&sandbox, &format!("--estimate {estimate} --beside --estimate-unseen 1"));
        assert_eq!(beside["pages_wanted"], fed["pages_wanted"], "what is only estimated is not wanted");
        assert!(beside["feedback_bytes_read"].as_u64() > Some(0));
    }
}

#[test]
fn what_goes_with_an_estimate_asks_for_one() {
    let sandbox = Sandbox::with_container();
    for more in
        ["--beside", "--estimate-unseen 1", "--estimate guess", "--estimate quadtree --estimate-unseen -1"]
    {
        let command = format!("render image.vastex {more}");
        sandbox.run(&command.split_whitespace().collect::<Vec<_>>()).expect_code(2);
    }
}
