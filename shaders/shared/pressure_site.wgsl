// Blocks of 2³ cells, one per thread, and the blocks around them.
//
// A pass that updates 8 cells loads 8 + 24 values of its neighbourhood, where 8 threads would load
// 56. In the projection's own arrays, cell c = x + 2 y + 4 z of block b = X + 4 Y + 16 Z of a brick
// is element 64 c + b, so that neighbouring threads read neighbouring words.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_real.wgsl"

struct PressureBrick {
    // Slots of the bricks at the lower faces x, y, z, then at the upper ones; 0 if absent.
    faces: array<u32, 6>,
    // Element on the next coarser level that contains block 0.
    above: u32,
    padding: u32,
}

@group(0) @binding(1) var<storage, read> pressure_bricks: array<PressureBrick>;

// Strides between the cells of a block.
const BLOCKED = vec3u(64u, 128u, 256u);
const NATURAL = vec3u(1u, 8u, 64u);

struct Site {
    slot: u32,
    block: u32,
    lower_slot: vec3u,
    lower_block: vec3u,
    upper_slot: vec3u,
    upper_block: vec3u,
}

// Block `block` of brick `slot`; bricks after slot `last` count as absent.
fn site_at(slot: u32, block: u32, last: u32) -> Site {
    return site_beside(slot, block, bricks_beside(slot, block, last));
}

// The bricks beside a brick at a block's own end of each axis. Along each axis at most one
// neighbour of the block lies in another brick.
fn bricks_beside(slot: u32, block: u32, last: u32) -> vec3u {
    let at = vec3u(block & 3u, (block >> 2u) & 3u, block >> 4u);
    let side = select(vec3u(3u, 4u, 5u), vec3u(0u, 1u, 2u), at < vec3u(2u));
    let far = vec3u(
        pressure_bricks[slot].faces[side.x],
        pressure_bricks[slot].faces[side.y],
        pressure_bricks[slot].faces[side.z],
    );
    return select(far, vec3u(0u), far > vec3u(last));
}

fn site_beside(slot: u32, block: u32, far: vec3u) -> Site {
    let at = vec3u(block & 3u, (block >> 2u) & 3u, block >> 4u);
    let step = vec3u(1u, 4u, 16u);
    let is_first = at == vec3u(0u);
    let is_last = at == vec3u(3u);
    return Site(
        slot,
        block,
        select(vec3u(slot), far, is_first),
        select(vec3u(block) - step, vec3u(block) + 3u * step, is_first),
        select(vec3u(slot), far, is_last),
        select(vec3u(block) + step, vec3u(block) - 3u * step, is_last),
    );
}

// Element of a block's first cell.
fn blocked(slot: u32, block: u32) -> u32 {
    return 512u * slot + block;
}

fn natural(slot: u32, block: u32) -> u32 {
    return 512u * slot + 2u * (block & 3u) + 16u * ((block >> 2u) & 3u) + 128u * (block >> 4u);
}

fn blocked_lower(s: Site) -> vec3u {
    return 512u * s.lower_slot + s.lower_block;
}

fn blocked_upper(s: Site) -> vec3u {
    return 512u * s.upper_slot + s.upper_block;
}

fn natural_lower(s: Site) -> vec3u {
    let b = s.lower_block;
    return 512u * s.lower_slot + 2u * (b & vec3u(3u)) + 16u * ((b >> vec3u(2u)) & vec3u(3u))
        + 128u * (b >> vec3u(4u));
}

fn natural_upper(s: Site) -> vec3u {
    let b = s.upper_block;
    return 512u * s.upper_slot + 2u * (b & vec3u(3u)) + 16u * ((b >> vec3u(2u)) & vec3u(3u))
        + 128u * (b >> vec3u(4u));
}

// The `k`-th of the 32 blocks of one colour.
fn coloured_block(k: u32, colour: u32) -> u32 {
    let y = (k >> 1u) & 3u;
    let z = k >> 3u;
    return 2u * (k & 1u) + ((colour + y + z) & 1u) + 4u * y + 16u * z;
}

// Offset of the coarse cell above a block, from `above` of its brick.
fn above_offset(block: u32) -> u32 {
    let at = vec3u(block & 3u, (block >> 2u) & 3u, block >> 4u);
    let half = at >> vec3u(1u);
    let bit = at & vec3u(1u);
    return half.x + 4u * half.y + 16u * half.z + 64u * bit.x + 128u * bit.y + 256u * bit.z;
}

// The 8 cells of a block: c = 0..3 and 4..7.
struct Pair {
    lo: vec4r,
    hi: vec4r,
}

// Values by side: cells with x = 0 (c = 0, 2, 4, 6) and with x = 1, cells with y = 0 (0, 1, 4, 5)
// and with y = 1, cells with z = 0 and with z = 1.
struct Sides {
    xl: vec4r,
    xu: vec4r,
    yl: vec4r,
    yu: vec4r,
    zl: vec4r,
    zu: vec4r,
}

// Regroups a block's own cells by side.
fn sides_of(p: Pair) -> Sides {
    return Sides(
        vec4r(p.lo.xz, p.hi.xz),
        vec4r(p.lo.yw, p.hi.yw),
        vec4r(p.lo.xy, p.hi.xy),
        vec4r(p.lo.zw, p.hi.zw),
        p.lo,
        p.hi,
    );
}

// Sums values given by side, per cell.
fn sum_sides(s: Sides) -> Pair {
    return Pair(
        vec4r(s.xl.x, s.xu.x, s.xl.y, s.xu.y) + vec4r(s.yl.xy, s.yu.xy) + s.zl,
        vec4r(s.xl.z, s.xu.z, s.xl.w, s.xu.w) + vec4r(s.yl.zw, s.yu.zw) + s.zu,
    );
}
