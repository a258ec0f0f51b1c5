// The coarse part of the V-cycle in one workgroup: the residuals of the finer level, from the first
// level that it can process down to the last, and back. If that is the finest level, its share of
// residual · correction.
#import "shared/pressure_cycle.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

// Symmetric sweeps on the last level, whose one brick has at most 8 cells per edge. Half as many
// cost one iteration in nine, twice as many save none (measured, tank of 64³).
const SWEEPS = 8u;

fn site_of(level: u32, i: u32, colour: u32) -> Site {
    return site_at(
        phase.levels[level].x + i / 32u, coloured_block(i & 31u, colour), last_slot(level));
}

// 64 threads: a workgroup of 256 takes twice the time on a software device, where a barrier's cost
// grows with the number of threads.
@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) local: u32) {
    let finer = max(phase.level, 1u) - 1u;
    let blocks = select(0u, 32u * phase.levels[finer].y, phase.level > 0u);
    for (var i = local; i < blocks; i += 64u) {
        let first = site_of(finer, i, 0u);
        let second = site_of(finer, i, 1u);
        let above = pressure_bricks[first.slot].above;
        pressure_residual[above + above_offset(first.block)] = passed_by_first(first);
        pressure_residual[above + above_offset(second.block)] = passed_by_second(second);
    }
    storageBarrier();
    for (var level = phase.level; level < phase.last_level; level++) {
        let count = 32u * phase.levels[level].y;
        for (var i = local; i < count; i += 64u) {
            smooth_first_at(site_of(level, i, 0u));
        }
        storageBarrier();
        for (var i = local; i < count; i += 64u) {
            _ = smooth_at(site_of(level, i, 1u));
        }
        storageBarrier();
        for (var i = local; i < count; i += 64u) {
            restrict_at(site_of(level, i, 0u));
        }
        storageBarrier();
    }
    let count = 32u * phase.levels[phase.last_level].y;
    for (var i = local; i < count; i += 64u) {
        smooth_first_at(site_of(phase.last_level, i, 0u));
    }
    storageBarrier();
    for (var sweep = 0u; sweep < 2u * SWEEPS; sweep++) {
        for (var i = local; i < count; i += 64u) {
            _ = smooth_at(site_of(phase.last_level, i, (sweep + 1u) & 1u));
        }
        storageBarrier();
    }
    for (var level = phase.last_level; level > phase.level; level--) {
        let count = 32u * phase.levels[level - 1u].y;
        for (var i = local; i < count; i += 64u) {
            _ = smooth_corrected_at(site_of(level - 1u, i, 1u));
        }
        storageBarrier();
        for (var i = local; i < count; i += 64u) {
            _ = smooth_at(site_of(level - 1u, i, 0u));
        }
        storageBarrier();
    }
    var product = real(0.0);
    let last = select(0u, 512u * phase.levels[0].y, phase.level == 0u);
    for (var i = local; i < last; i += 64u) {
        let e = 512u * phase.levels[0].x + i;
        product += pressure_residual[e] * pressure_correction[e];
    }
    let sum = sum_workgroup(product, local);
    if local == 0u && phase.level == 0u {
        pressure_sums[CORRECTED] = sum;
    }
}
