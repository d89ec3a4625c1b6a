//! Vastex's policy on the camera paths, beside LRU and Belady's optimum. docs/policies.md has the figures.

use std::time::Duration;

use vastex::Geometry;
use vastex::prefetch::Trace;
use vastex_core::{GeometrySpec, Policy, PoolSize, Replay, ReplaySettings, replay};
use vastex_scenes::{Path, Scene, trace_of};
use vastex_tiles::ends_within;

/// Of the largest frame's set.
const SHARES: [f64; 4] = [1.1, 1.5, 2.0, 3.0];

/// An image of the Earth's shape, on the scenes for which its traces are fixed.
fn traces() -> Vec<(String, Trace)> {
    let geometry = Geometry::new(GeometrySpec::image(32768, 16384)).unwrap();
    let cases = Scene::SMOOTH.into_iter().flat_map(|scene| Path::ALL.map(|path| (scene, path)));
    let threads = cases.map(|(scene, path)| {
        let geometry = geometry.clone();
        let name = format!("{}/{}", scene.name(), path.name());
        std::thread::spawn(move || (name, trace_of(scene, path, &geometry, [1920, 1080])))
    });
    let threads: Vec<_> = threads.collect();
    let join = || threads.into_iter().map(|thread| thread.join().unwrap()).collect();
    ends_within(Duration::from_secs(300), join).unwrap()
}

fn run(trace: &Trace, policy: Policy, share: f64) -> Replay {
    replay(trace, &ReplaySettings::new(policy, PoolSize::Share(share))).unwrap()
}

#[test]
fn vastex_never_loads_more_than_lru_and_closes_a_quarter_of_its_gap_to_the_optimum() {
    let (mut closed, mut table) = (Vec::new(), String::new());
    let mut worse = Vec::new();
    for (name, trace) in traces() {
        for share in SHARES {
            let (lru, vastex) = (run(&trace, Policy::Lru, share), run(&trace, Policy::Vastex, share));
            table += &format!(
                "{name} {share}: optimum {}, lru {}, vastex {}\n",
                lru.loads_optimum, lru.loads, vastex.loads
            );
            if vastex.loads > lru.loads {
                worse.push(format!("{name} at {share}: {} loads, LRU {}", vastex.loads, lru.loads));
            }
            if lru.ratio() > 1.02 {
                let gap = (lru.loads - lru.loads_optimum) as f64;
                closed.push((lru.loads as f64 - vastex.loads as f64) / gap);
            }
        }
    }
    println!("{table}");
    assert!(worse.is_empty(), "{worse:#?}");
    assert!(closed.len() >= 10, "only {} cases leave anything to gain", closed.len());
    let average = closed.iter().sum::<f64>() / closed.len() as f64;
    println!("{:.1} % of the gap closed over {} cases", 100.0 * average, closed.len());
    assert!(average >= 0.25, "{:.1} % of the gap", 100.0 * average);
}

#[test]
fn a_trace_of_a_path_comes_back_from_its_bytes() {
    let geometry = Geometry::new(GeometrySpec::image(4096, 2048)).unwrap();
    let trace = trace_of(Scene::Globe, Path::Spin, &geometry, [320, 180]);
    assert_eq!(trace.frames().len() as u64, Path::Spin.frames());
    assert_eq!(Trace::from_bytes(&trace.to_bytes()), Ok(trace));
}
