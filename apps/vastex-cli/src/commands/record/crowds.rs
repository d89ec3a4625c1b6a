//! Worlds of many textures in several pools: what the pager decided, frame by frame, whatever applications
//! ask of them.

use std::path::Path;

use anyhow::{Result, anyhow};
use vastex_core::sim::{Crowd, Path as Way, Random, Watch, contents_of_chance};
use vastex_core::{
    BiasRule, Budgets, Geometry, GeometrySpec, GroupNumber, Integrator, LevelRule, PoolId, Region,
    TextureNumber, Urgency, ViewId,
};

use super::write;

const BUDGETS: Budgets = Budgets { upload_bytes_per_frame: 2000, in_flight_bytes: 20_000 };
const SCREEN: [u32; 2] = [240, 135];
/// Frames that a crowd lives.
const FRAMES: u64 = 160;
/// Crowds to which everything happens by chance.
const CHANCES: u64 = 40;

/// What happens before a frame.
type Script = fn(&mut Crowd, u64) -> Result<(), String>;

pub(super) fn record(directory: &Path, only: &str) -> Result<()> {
    let crowds: [(&str, [u32; 3], Script); 10] = [
        ("come-and-go", [300, 300, 300], come_and_go),
        ("small", [300, 12, 40], |_, _| Ok(())),
        ("views", [300, 300, 300], views),
        ("groups", [300, 300, 300], groups),
        ("shared", [120, 120, 120], shared),
        ("asked", [300, 200, 200], asked),
        ("resized", [300, 300, 300], resized),
        ("lost", [300, 300, 300], lost),
        ("silent", [300, 300, 300], silent),
        ("integrating", [60, 40, 30], |_, _| Ok(())),
    ];
    for (name, slots, script) in crowds {
        let name = format!("many-{name}");
        if name.starts_with(only) {
            let rule = match name.ends_with("integrating") {
                true => BiasRule::Integrating(Integrator::default()),
                false => BiasRule::Solved,
            };
            let lived = three_pools(slots, rule).and_then(|crowd| live(crowd, script));
            write(directory, &format!("{name}.txt"), lived.map_err(|why| anyhow!("{name}: {why}"))?)?;
        }
    }
    for seed in 0..CHANCES {
        let name = format!("many-chance-{seed}");
        if name.starts_with(only) {
            let lived = by_chance(seed).map_err(|why| anyhow!("{name}: {why}"))?;
            write(directory, &format!("{name}.txt"), lived)?;
        }
    }
    Ok(())
}

fn live(mut crowd: Crowd, script: Script) -> Result<String, String> {
    for frame in 1..=FRAMES {
        script(&mut crowd, frame)?;
        crowd.step()?;
    }
    Ok(ended(&mut crowd))
}

fn ended(crowd: &mut Crowd) -> String {
    let counts: Vec<_> = crowd.pager.pools().map(|pager| (pager.pool(), pager.stats())).collect();
    counts.iter().for_each(|(pool, counts)| crowd.log.counts(*pool, counts));
    crowd.log.take()
}

/// Pools of small, middling and large tiles, with a texture in the first and two in the others.
fn three_pools(slots: [u32; 3], rule: BiasRule) -> Result<Crowd, String> {
    let mut crowd = Crowd::new(BUDGETS, SCREEN, 1);
    crowd.log.begin();
    for (slots, (page, tile_bytes)) in slots.into_iter().zip([(64, 100), (128, 400), (256, 1600)]) {
        let pool = crowd.add_pool(slots, tile_bytes, Some(rule)).map_err(|error| error.to_string())?;
        for way in [Way::Fly, Way::Spin].into_iter().take(if page > 64 { 2 } else { 1 }) {
            add(&mut crowd, pool, page, way)?;
        }
    }
    Ok(crowd)
}

fn add(crowd: &mut Crowd, pool: PoolId, page: u32, way: Way) -> Result<TextureNumber, String> {
    let spec = GeometrySpec { page, ..GeometrySpec::image(16384, 8192) };
    crowd.add(pool, spec, way).map_err(|error| error.to_string())
}

fn nth(crowd: &Crowd, number: usize) -> Result<TextureNumber, String> {
    crowd.textures().nth(number).ok_or_else(|| "no such texture".to_owned())
}

fn come_and_go(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    match frame {
        30 => crowd.remove(nth(crowd, 1)?),
        31 => add(crowd, PoolId::new(1), 128, Way::Zoom).map(drop),
        60 => crowd.remove(nth(crowd, 0)?),
        80 => add(crowd, PoolId::new(0), 64, Way::Spin).map(drop),
        _ => Ok(()),
    }
}

fn views(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    let beside: Vec<ViewId> = crowd.views_beside().collect();
    match frame {
        5 | 20 => {
            let watch = Watch { ahead: 40 * frame / 5, every: 1 + frame / 20 };
            crowd.add_view(if frame == 5 { 0.5 } else { 4.0 }, watch).map_err(|error| error.to_string())?;
        }
        50 => crowd.change_view(beside[0], Watch { ahead: 150, every: 2 }, true),
        60 => crowd.change_view(beside[1], Watch { ahead: 0, every: 0 }, false),
        80 => crowd.remove_view(beside[0]),
        _ => {}
    }
    Ok(())
}

fn groups(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    let members: Vec<TextureNumber> = crowd.textures().collect();
    match frame {
        10 => {
            crowd.pager.set_levels(members[1], LevelRule { bias: 0.75, finest: 1, coarsest: 5 });
            crowd.group(&members[..3], Way::Zoom).map_err(|error| error.to_string())?;
        }
        40 => drop(crowd.group(&members[2..], Way::Teleport).map_err(|error| error.to_string())?),
        45 => crowd.pager.set_turns(3),
        70 => {
            let first: Vec<GroupNumber> = crowd.groups().collect();
            crowd.ungroup(first[0])?;
        }
        _ => {}
    }
    Ok(())
}

/// Pages of the same content, which becomes another here and there.
fn shared(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    if frame == 1 {
        for (pool, page) in [(0, 64), (1, 128)] {
            let spec = GeometrySpec { page, ..GeometrySpec::image(9000, 7000) };
            let contents = |geometry: &Geometry| Some(contents_of_chance(geometry, 5, 0.7));
            crowd
                .add_with(PoolId::new(pool), spec, Way::Spin, contents)
                .map_err(|error| error.to_string())?;
        }
    }
    if frame.is_multiple_of(20) {
        let at = frame as u32 * 40;
        let region = Region::image(at..at + 900, at / 2..at / 2 + 700).on_levels(0..=(frame / 20) as u8);
        for texture in [nth(crowd, 5)?, nth(crowd, 6)?, nth(crowd, 1)?] {
            crowd.change(texture, &region);
        }
    }
    Ok(())
}

/// Prefetches with and without deadlines, pins, views expected, and tickets let go of.
fn asked(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    let ask = |crowd: &mut Crowd, number: usize, region: Region, urgency: Option<Urgency>| {
        let refused = crowd.ask(nth(crowd, number)?, &region, urgency).err();
        refused.into_iter().for_each(|why| crowd.log.line(format_args!("refused: {why}")));
        Ok(())
    };
    let urgent = |priority, deadline| Some(Urgency { priority, deadline });
    if frame == 45 {
        // What is asked for has its turn when the view has all.
        crowd.hold();
    }
    match frame {
        5 => ask(crowd, 0, Region::image(0..3000, 0..2000).on_levels(3..=4), urgent(0, None)),
        8 => ask(crowd, 1, Region::image(8000..12_000, 100..4000).on_levels(2..=4), urgent(1, Some(30))),
        12 => ask(crowd, 1, Region::image(0..16_384, 0..8192).on_levels(4..=4), None),
        20 => ask(crowd, 3, Region::image(4000..9000, 2000..6000).on_levels(2..=3), urgent(-1, Some(60))),
        25 => ask(crowd, 4, Region::whole().on_levels(4..=5), None),
        30 => ask(crowd, 4, Region::whole(), None),
        40..=42 => {
            crowd.expect(nth(crowd, 2)?, frame + 30);
            Ok(())
        }
        50 => {
            let texture = nth(crowd, 1)?;
            crowd.change(texture, &Region::image(0..5000, 0..5000).on_levels(0..=4));
            Ok(())
        }
        70 => {
            let open = crowd.tickets.first().copied();
            open.map_or(Ok(()), |ticket| crowd.release(ticket))
        }
        _ => Ok(()),
    }
}

fn resized(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    let sizes = [(10, 1, 500), (30, 1, 40), (35, 0, 60), (50, 1, 300), (60, 2, 2), (70, 2, 25), (90, 0, 900)];
    if frame == 5 {
        let region = Region::image(0..8000, 0..4000).on_levels(3..=4);
        crowd.ask(nth(crowd, 1)?, &region, None).map_err(|error| error.to_string())?;
    }
    for (_, pool, slots) in sizes.into_iter().filter(|(at, ..)| *at == frame) {
        if !crowd.resize(PoolId::new(pool), slots)? {
            crowd.log.line(format_args!("refused: pool {pool} of {slots} slots"));
        }
    }
    Ok(())
}

fn lost(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    if frame == 5 {
        let region = Region::image(0..8000, 0..4000).on_levels(3..=4);
        crowd.ask(nth(crowd, 2)?, &region, None).map_err(|error| error.to_string())?;
    }
    if frame == 50 {
        crowd.lose_device();
    }
    Ok(())
}

/// A source of which nothing is heard any more, others that fail and are mended.
fn silent(crowd: &mut Crowd, frame: u64) -> Result<(), String> {
    if frame == 10 {
        let texture = nth(crowd, 3)?;
        crowd.loads.silent.push(texture);
    }
    crowd.loads.broken = if (20..60).contains(&frame) { 0.2 } else { 0.0 };
    crowd.loads.slow = 0.2;
    Ok(())
}

/// A crowd to which everything happens by chance.
fn by_chance(seed: u64) -> Result<String, String> {
    let mut random = Random::new(seed);
    let mut random = move |below: u64| random.below(below);
    let budgets = Budgets { upload_bytes_per_frame: 20 + random(3000), in_flight_bytes: random(20_000) };
    let mut crowd = Crowd::new(budgets, SCREEN, seed);
    crowd.log.begin();
    crowd.loads.latency_frames = random(10);
    crowd.loads.lanes = [1, 6, 25, 64][random(4) as usize];
    (crowd.loads.failing, crowd.loads.slow) = if random(2) == 0 { (0.2, 0.2) } else { (0.0, 0.0) };
    let pools = 1 + random(4);
    for pool in 0..pools {
        let (slots, tile_bytes) = (20 + random(200) as u32, 1 + random(2000));
        crowd.add_pool(slots, tile_bytes, Some(BiasRule::Solved)).map_err(|error| error.to_string())?;
        add_by_chance(&mut crowd, &mut random, PoolId::new(pool as u16));
    }
    for _ in 0..FRAMES {
        crowd.step()?;
        let pool = PoolId::new(random(pools) as u16);
        match random(24) {
            0 | 1 => add_by_chance(&mut crowd, &mut random, pool),
            2 => {
                let textures: Vec<TextureNumber> = crowd.textures().collect();
                if textures.len() > 1 {
                    crowd.remove(textures[random(textures.len() as u64) as usize])?;
                }
            }
            3 => drop(crowd.resize(pool, 2 + random(300) as u32)?),
            4..8 => ask_by_chance(&mut crowd, &mut random)?,
            8 if crowd.views_beside().count() < 3 => {
                let watch = Watch { ahead: random(200), every: random(6) };
                crowd.add_view(1.0 + random(4) as f32, watch).map_err(|error| error.to_string())?;
            }
            9 => {
                let view = crowd.views_beside().next();
                view.into_iter().for_each(|view| crowd.remove_view(view));
            }
            10 if seed % 4 == 3 => crowd.lose_device(),
            11 => {
                let members: Vec<TextureNumber> = crowd.textures().filter(|_| random(2) == 0).collect();
                let bias = random(33) as f32 / 8.0 - 2.0;
                let rule = LevelRule { bias, finest: random(3) as u8, coarsest: 4 + random(8) as u8 };
                members.first().into_iter().for_each(|texture| {
                    crowd.pager.set_levels(*texture, rule);
                });
                // Of no members there is none.
                let _ = crowd.group(&members, Way::ALL[random(5) as usize]);
            }
            _ => {}
        }
    }
    Ok(ended(&mut crowd))
}

/// A texture of chance; a pool that is too small for it refuses it.
fn add_by_chance(crowd: &mut Crowd, random: &mut impl FnMut(u64) -> u64, pool: PoolId) {
    let (width, height) = (200 + random(20_000) as u32, 200 + random(20_000) as u32);
    // All textures of a pool have tiles of one size.
    let page = [50, 100, 200, 90][usize::from(pool.number()) % 4];
    let spec = GeometrySpec { page, ..GeometrySpec::image(width, height) };
    let (way, seed, share) = (Way::ALL[random(5) as usize], random(1000), random(3) as f64 * 0.3);
    let contents = |geometry: &Geometry| (share > 0.0).then(|| contents_of_chance(geometry, seed, share));
    if let Err(why) = crowd.add_with(pool, spec, way, contents) {
        crowd.log.line(format_args!("refused: {why}"));
    }
}

/// Prefetches, pins, lets go of a ticket, expects a view, or changes the content of a texture.
fn ask_by_chance(crowd: &mut Crowd, random: &mut impl FnMut(u64) -> u64) -> Result<(), String> {
    let textures: Vec<TextureNumber> = crowd.textures().collect();
    let Some(&texture) = textures.get(random(1 + textures.len() as u64) as usize) else { return Ok(()) };
    let (x, y) = (random(8000) as u32, random(8000) as u32);
    let (width, height, finest) = (1 + random(4000) as u32, 1 + random(4000) as u32, random(5) as u8);
    let region = Region::image(x..x + width, y..y + height).on_levels(finest..=finest + random(3) as u8);
    let urgency = match random(5) {
        0 => None,
        1 => {
            crowd.change(texture, &region);
            return Ok(());
        }
        2 => {
            crowd.expect(texture, crowd.frame + random(50));
            return Ok(());
        }
        3 => return crowd.tickets.first().copied().map_or(Ok(()), |ticket| crowd.release(ticket)),
        _ => {
            let deadline = (random(2) == 0).then(|| crowd.frame + random(60));
            Some(Urgency { priority: random(3) as i32 - 1, deadline })
        }
    };
    if let Err(why) = crowd.ask(texture, &region, urgency) {
        crowd.log.line(format_args!("refused: {why}"));
    }
    Ok(())
}
