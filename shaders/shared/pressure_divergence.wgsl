// Outflow of the cells of a block.
#import "shared/pressure_site.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(2) var<storage, read> pressure_block: array<u32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
// With CONTRACTS the flux that makes up for contraction follows.
@group(0) @binding(5) var<storage, read> solid_flux: array<f32>;
@group(0) @binding(10) var<storage, read_write> pressure_stats: PressureStats;

var<workgroup> largest: array<f32, 64>;

fn through(first: u32, s: u32, t: u32) -> vec4r {
    let open = vec4f(
        face_open[first], face_open[first + s], face_open[first + t], face_open[first + s + t]);
    let velocity = vec4f(
        face_velocity[first],
        face_velocity[first + s],
        face_velocity[first + t],
        face_velocity[first + s + t],
    );
    return vec4r(open) * vec4r(velocity);
}

// Flux into the solids from four cells, less that which makes up for contraction, m/s.
fn from_solids(first: u32) -> vec4r {
    let flux = vec4r(vec4f(
        solid_flux[first], solid_flux[first + 1u], solid_flux[first + 8u], solid_flux[first + 9u]));
#ifdef CONTRACTS
    let made_up = phase.stride + first;
    return flux - vec4r(vec4f(
        solid_flux[made_up],
        solid_flux[made_up + 1u],
        solid_flux[made_up + 8u],
        solid_flux[made_up + 9u],
    ));
#else
    return flux;
#endif
}

// Σ ± f u + solid flux − contraction's, m/s; 0 where there is no row.
fn outflow(s: Site) -> Pair {
    let own = natural(s.slot, s.block);
    let upper = natural_upper(s);
    let y = phase.stride;
    let z = 2u * phase.stride;
    let ix = through(own + 1u, 8u, 64u);
    let iy = through(y + own + 8u, 1u, 64u);
    let iz = through(z + own + 64u, 1u, 8u);
    let sum = sum_sides(Sides(
        ix - through(own, 8u, 64u),
        through(upper.x, 8u, 64u) - ix,
        iy - through(y + own, 1u, 64u),
        through(y + upper.y, 1u, 64u) - iy,
        iz - through(z + own, 1u, 8u),
        through(z + upper.z, 1u, 8u) - iz,
    ));
    let lo = from_solids(own);
    let hi = from_solids(own + 64u);
    let rows = pressure_block[64u * s.slot + s.block] >> 8u;
    let is_row_lo = (vec4u(rows) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let is_row_hi = (vec4u(rows) & vec4u(16u, 32u, 64u, 128u)) != vec4u(0u);
    return Pair(
        select(vec4r(0.0), sum.lo + lo, is_row_lo),
        select(vec4r(0.0), sum.hi + hi, is_row_hi),
    );
}

// Bits of the workgroup's largest |∇·u|, 1/s; valid in its first thread.
fn largest_divergence(flow: Pair, local: u32) -> u32 {
    let most = max(abs(flow.lo), abs(flow.hi));
    largest[local] = f32(max(max(most.x, most.y), max(most.z, most.w)));
    workgroupBarrier();
    var worst = 0.0;
    if local == 0u {
        for (var k = 0u; k < 64u; k++) {
            worst = max(worst, largest[k]);
        }
    }
    return bitcast<u32>(worst / phase.cell_size);
}
