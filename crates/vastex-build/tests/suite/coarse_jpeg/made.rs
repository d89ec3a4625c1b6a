//! Progressive JPEGs that have nothing but DC coefficients, and sequential ones, in every layout that the
//! format allows.

/// What codes of AC coefficients stand for: the end of a block, zeros and how many bits follow.
const AC: [u8; 6] = [0x00, 0xf0, 0x01, 0x32, 0x0a, 0xe1];

/// In which scans the components come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scans {
    /// All in one.
    Together,
    /// One each.
    Apart,
    /// The first by itself, then the others.
    LumaFirst,
}

/// A file to be made.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) size: [usize; 2],
    /// Of each component, blocks of an MCU, across and down.
    pub(super) blocks: Vec<[usize; 2]>,
    pub(super) ids: [u8; 3],
    pub(super) scans: Scans,
    /// True if each scan has all coefficients.
    pub(super) is_sequential: bool,
    /// Lowest bits that come in later scans.
    pub(super) missing_bits: u32,
    /// MCUs between restarts; 0 for none.
    pub(super) restarts: u16,
    /// True if codes have up to 13 bits, else all have four.
    pub(super) has_long_codes: bool,
    pub(super) has_jfif: bool,
    pub(super) adobe: Option<u8>,
    pub(super) seed: u32,
}

impl Made {
    pub(super) fn new(size: [usize; 2], blocks: &[[usize; 2]], seed: u32) -> Made {
        Made {
            size,
            blocks: blocks.to_vec(),
            ids: [1, 2, 3],
            scans: Scans::Together,
            is_sequential: false,
            missing_bits: 0,
            restarts: 0,
            has_long_codes: false,
            has_jfif: false,
            adobe: None,
            seed,
        }
    }

    /// What the coefficients of a component are multiplied by.
    pub(super) fn quant(&self, component: usize) -> u32 {
        3 + 2 * component as u32 + self.seed % 5
    }

    fn most(&self) -> [usize; 2] {
        if self.blocks.len() == 1 {
            return self.blocks[0];
        }
        [0, 1].map(|axis| self.blocks.iter().map(|blocks| blocks[axis]).max().unwrap())
    }

    fn mcus(&self) -> [usize; 2] {
        let most = self.most();
        [0, 1].map(|axis| self.size[axis].div_ceil(8 * most[axis]))
    }

    /// The coefficient of a block: hills, and something of its own.
    fn coefficient(&self, component: usize, x: usize, y: usize) -> i32 {
        let most = 1000 / self.quant(component) as i32;
        let hash = (self.seed ^ (component as u32) << 9)
            .wrapping_add((x as u32).wrapping_mul(2_654_435_761))
            .wrapping_add((y as u32).wrapping_mul(2_246_822_519));
        let hash = (hash ^ hash >> 15).wrapping_mul(3_266_489_917);
        let hill = ((x * 9 + y * 5 + 40 * component) % 200) as i32 - 100;
        let own = ((hash >> 16) % 101) as i32 - 50;
        if hash.is_multiple_of(7) { (hill + own) * most / 150 } else { hill * most / 150 }
    }

    /// The file.
    pub(super) fn file(&self) -> Vec<u8> {
        let mut file = vec![0xff, 0xd8];
        if self.has_jfif {
            segment(&mut file, 0xe0, b"JFIF\0\x01\x02\0\0\x01\0\x01\0\0");
        }
        if let Some(transform) = self.adobe {
            segment(&mut file, 0xee, &[b"Adobe\0\x64\0\0\0\0", &[transform][..]].concat());
        }
        for component in 0..self.blocks.len() {
            let quant = self.quant(component) as u8;
            segment(&mut file, 0xdb, &[&[component as u8][..], &[quant; 64]].concat());
        }
        let [width, height] = self.size.map(|side| (side as u16).to_be_bytes());
        let mut frame = [&[8][..], &height, &width, &[self.blocks.len() as u8]].concat();
        for (n, [across, down]) in self.blocks.iter().enumerate() {
            frame.extend([self.ids[n], (across << 4 | down) as u8, n as u8]);
        }
        segment(&mut file, if self.is_sequential { 0xc0 } else { 0xc2 }, &frame);
        segment(&mut file, 0xdd, &self.restarts.to_be_bytes());
        // As many codes as there are numbers of bits, 0 to 11, in an order of their own.
        let mut counts = [0u8; 16];
        match self.has_long_codes {
            true => counts[1..13].fill(1),
            false => counts[3] = 12,
        }
        segment(&mut file, 0xc4, &[&[0][..], &counts, &self.order()].concat());
        let mut ac_counts = [0u8; 16];
        ac_counts[3] = AC.len() as u8;
        segment(&mut file, 0xc4, &[&[0x10][..], &ac_counts, &AC].concat());
        let all: Vec<usize> = (0..self.blocks.len()).collect();
        let scans: Vec<&[usize]> = match self.scans {
            Scans::Together => vec![&all],
            Scans::Apart => all.chunks(1).collect(),
            Scans::LumaFirst if all.len() == 1 => vec![&all],
            Scans::LumaFirst => vec![&all[..1], &all[1..]],
        };
        for bit in (0..=self.missing_bits).rev() {
            scans.iter().for_each(|scan| self.scan(&mut file, scan, bit));
        }
        file.extend([0xff, 0xd9]);
        file
    }

    fn order(&self) -> [u8; 12] {
        std::array::from_fn(|n| ((5 * n as u32 + self.seed) % 12) as u8)
    }

    /// A scan of the coefficients down to this bit: the first, or one that adds a bit.
    fn scan(&self, file: &mut Vec<u8>, components: &[usize], bit: u32) {
        let is_first = bit == self.missing_bits;
        let before = if is_first { 0 } else { bit + 1 };
        let mut header = vec![components.len() as u8];
        header.extend(components.iter().flat_map(|&component| [self.ids[component], 0]));
        let end = if self.is_sequential { 63 } else { 0 };
        header.extend([0, end, (before << 4 | bit) as u8]);
        segment(file, 0xda, &header);
        let (most, is_single) = (self.most(), components.len() == 1);
        let [columns, rows] = match components {
            [single] => {
                [0, 1].map(|axis| (self.size[axis] * self.blocks[*single][axis]).div_ceil(8 * most[axis]))
            }
            _ => self.mcus(),
        };
        let mut bits = Bits::default();
        let mut last = [0; 3];
        for mcu in 0..columns * rows {
            let restarts = usize::from(self.restarts);
            if restarts > 0 && mcu > 0 && mcu % restarts == 0 {
                bits.end(file);
                file.extend([0xff, 0xd0 + ((mcu / restarts - 1) % 8) as u8]);
                last = [0; 3];
            }
            let (column, row) = (mcu % columns, mcu / columns);
            for &component in components {
                let [across, down] = if is_single { [1, 1] } else { self.blocks[component] };
                for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                    let value = self.coefficient(component, column * across + x, row * down + y) >> bit;
                    match is_first {
                        true => self.difference(&mut bits, value - last[component]),
                        false => bits.put((value & 1) as u32, 1),
                    }
                    if self.is_sequential {
                        // Of a component of less than the full size libjpeg takes more than the DC
                        // coefficient.
                        let is_full = self.blocks[component] == most;
                        self.ac(
                            &mut bits,
                            if is_full { value.unsigned_abs() + 3 * column as u32 } else { 0 },
                        );
                    }
                    last[component] = value;
                }
            }
            bits.flush(file);
        }
        bits.end(file);
    }

    /// The AC coefficients of a block: runs of zeros, numbers of some bits, and the end of the block or not.
    fn ac(&self, bits: &mut Bits, kind: u32) {
        let mut put = |symbol: u8, value: u32| {
            bits.put(AC.iter().position(|&one| one == symbol).unwrap() as u32, 4);
            bits.put(value, u32::from(symbol & 15));
        };
        match kind % 5 {
            0 => {}
            1 => put(0x01, 1),
            2 => {
                [(0x32, 3), (0xf0, 0), (0x0a, 700)]
                    .into_iter()
                    .for_each(|(symbol, value)| put(symbol, value));
            }
            // All 63: nothing ends the block.
            3 => return (0..63).for_each(|n| put(0x01, n % 2)),
            _ => {
                return [(0xf0, 0), (0xf0, 0), (0xf0, 0), (0xe1, 1)].into_iter().for_each(|(s, v)| put(s, v));
            }
        }
        put(0x00, 0);
    }

    fn difference(&self, bits: &mut Bits, value: i32) {
        let category = 32 - value.unsigned_abs().leading_zeros();
        let place = self.order().iter().position(|&n| u32::from(n) == category).unwrap() as u32;
        match self.has_long_codes {
            // One of each length: 00, 010, 0110 and so on.
            true => bits.put((1 << (place + 1)) - 2, place + 2),
            false => bits.put(place, 4),
        }
        let value = if value < 0 { value - 1 } else { value };
        bits.put(value as u32 & ((1 << category) - 1), category);
    }
}

fn segment(file: &mut Vec<u8>, marker: u8, body: &[u8]) {
    file.extend([0xff, marker]);
    file.extend((body.len() as u16 + 2).to_be_bytes());
    file.extend(body);
}

/// Bits on their way into a file.
#[derive(Default)]
struct Bits {
    held: u64,
    count: u32,
    bytes: Vec<u8>,
}

impl Bits {
    fn put(&mut self, bits: u32, count: u32) {
        self.held = self.held << count | u64::from(bits);
        self.count += count;
        while self.count >= 8 {
            self.count -= 8;
            self.bytes.push((self.held >> self.count) as u8);
        }
        self.held &= (1 << self.count) - 1;
    }

    /// Writes whole bytes, with one behind each that could be taken for a marker.
    fn flush(&mut self, file: &mut Vec<u8>) {
        for byte in self.bytes.drain(..) {
            file.push(byte);
            file.extend((byte == 0xff).then_some(0));
        }
    }

    /// Fills the last byte up with ones.
    fn end(&mut self, file: &mut Vec<u8>) {
        let left = (8 - self.count % 8) % 8;
        self.put((1 << left) - 1, left);
        self.flush(file);
    }
}
