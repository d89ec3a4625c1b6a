// What a main pass reports: of each cell, in its row of the view, what the pixel that is asked wants.

// A report. Surfaces behind one another have one each.
struct VastexiReport {
    page_low: u32,
    page_high: u32,
    eighth_and_flag: u32, // the flag in the low VASTEXI_FLAG_BITS bits
    nearness: u32,        // larger where the surface is nearer
}

struct VastexiCell {
    count: atomic<u32>, // reports, of which those beyond the cell's room are lost
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
    reports: array<VastexiReport, VASTEXI_RECORDS>,
}

const VASTEXI_FLAG_BITS: u32 = 2u;
