//! The array of records is what was set, wherever it moves, and what is not submitted changes nothing.

use vastex_core::TextureNumber;
use vastex_wgpu::ParamStore;

use crate::common::{GPU, Random};
use crate::pool_world::texture_words;

const STRIDE: u32 = 7;

fn words(store: &ParamStore) -> Vec<u32> {
    texture_words(store.texture())
}

fn expected(store: &ParamStore, records: usize) -> Vec<u32> {
    // The last number of all is nobody's.
    let of =
        |n: usize| TextureNumber::new(n as u16).map_or(&[[0; 4]; STRIDE as usize][..], |n| store.record(n));
    (0..records).flat_map(of).flatten().copied().collect()
}

#[test]
fn records_are_what_was_set_wherever_they_lie() {
    let mut store = ParamStore::new(&GPU.device, STRIDE).unwrap();
    let mut random = Random(5);
    let (mut moved, mut before) = (0, Vec::new());
    for frame in 0..60u32 {
        // More and more of them.
        for _ in 0..random.below(6) {
            let number = TextureNumber::new(random.below(1 + 20 * frame as usize) as u16).unwrap();
            let words = 1 + random.below(STRIDE as usize);
            let record: Vec<[u32; 4]> =
                (0..words).map(|_| [random.next() as u32 % 100, frame, 1, 2]).collect();
            store.set(number, &record);
        }
        let bound = store.texture().clone();
        let mut encoder = GPU.device.create_command_encoder(&Default::default());
        let written = store.write(&GPU.device, &mut encoder).unwrap();
        if frame % 7 == 3 {
            continue; // dropped
        }
        GPU.queue.submit([encoder.finish()]);
        store.submitted();
        if written.moved {
            moved += 1;
            before.push((frame, bound));
        }
        let found = words(&store);
        let records = found.len() / 4 / STRIDE as usize;
        assert!(found == expected(&store, records), "frame {frame}");
        before.retain(|(moved, _)| moved + 2 > frame);
        for (moved, texture) in &before {
            let found = texture_words(texture);
            let records = found.len() / 4 / STRIDE as usize;
            assert!(records > 0 && found == expected(&store, records), "frame {frame}, before {moved}");
        }
    }
    assert!(moved > 3, "{moved}");
    // The same again sends nothing.
    let record = store.record(TextureNumber::new(3).unwrap()).to_vec();
    store.set(TextureNumber::new(3).unwrap(), &record);
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    assert_eq!(store.write(&GPU.device, &mut encoder).unwrap(), Default::default());
}

/// Commands that were recorded before see a record as it was then, or that there is none any more, whatever
/// moves after it.
#[test]
fn what_parts_stays_as_it_was_where_it_was_until_it_goes() {
    let mut store = ParamStore::new(&GPU.device, STRIDE).unwrap();
    let number = |n| TextureNumber::new(n).unwrap();
    let submit = |store: &mut ParamStore| {
        let mut encoder = GPU.device.create_command_encoder(&Default::default());
        store.write(&GPU.device, &mut encoder).unwrap();
        GPU.queue.submit([encoder.finish()]);
        store.submitted();
    };
    let bound = |store: &ParamStore| store.texture().clone();
    let record_of = |texture: &wgpu::Texture, n: usize| {
        let words = texture_words(texture);
        words[4 * STRIDE as usize * n..][..4].to_vec()
    };
    store.set(number(0), &[[1; 4]]);
    store.set(number(1), &[[2; 4]]);
    submit(&mut store);
    let first = bound(&store);
    // Number 0 lies elsewhere; then all records move, since there are more of them; then it changes, and
    // goes.
    store.part([number(0)]);
    store.set(number(0), &[[3; 4]]);
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    store.write(&GPU.device, &mut encoder).unwrap();
    GPU.queue.submit([encoder.finish()]);
    store.submitted_between();
    let second = bound(&store);
    assert_eq!((record_of(&first, 0), record_of(&second, 0)), (vec![1; 4], vec![3; 4]));
    store.set(number(40), &[[9; 4]]);
    store.set(number(1), &[[4; 4]]);
    submit(&mut store);
    let third = bound(&store);
    store.set(number(0), &[[5; 4]]);
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    store.write(&GPU.device, &mut encoder).unwrap();
    GPU.queue.submit([encoder.finish()]);
    store.submitted_between();
    let seen = [&first, &second, &third].map(|bound| [record_of(bound, 0)[0], record_of(bound, 1)[0]]);
    assert_eq!(seen, [[1, 4], [5, 4], [5, 4]]);
    store.set(number(0), &[]);
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    store.write(&GPU.device, &mut encoder).unwrap();
    GPU.queue.submit([encoder.finish()]);
    store.submitted_between();
    store.set(number(0), &[[6; 4]]);
    submit(&mut store);
    let seen = [&first, &second, &third].map(|bound| record_of(bound, 0)[0]);
    assert_eq!(seen, [0, 6, 6], "what has its number is not shown by what is there of another");
}
